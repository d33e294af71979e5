"""Boxes of parts from where their points are."""
