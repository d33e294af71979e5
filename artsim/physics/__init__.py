"""Objects that move under forces."""
