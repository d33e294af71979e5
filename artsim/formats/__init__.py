"""Finished datasets in the formats that other programs read."""
