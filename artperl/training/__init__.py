"""Training and testing in one loop."""
