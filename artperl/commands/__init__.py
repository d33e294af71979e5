"""The verbs of the program artperl."""
