"""Runs that make many files: tasks, the processes that do them, what is done already, and where files lie."""
