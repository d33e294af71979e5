"""Verbs of the program ``artsim``: the options of each, and what it prints."""
