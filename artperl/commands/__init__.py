"""Verbs of the program ``artperl``."""
