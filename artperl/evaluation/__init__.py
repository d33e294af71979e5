"""How good an estimate is: metrics, protocols, tables."""
