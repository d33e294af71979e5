"""Protocols that fill the paper's tables."""
