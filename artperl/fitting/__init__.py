"""Fitting a reference to a cloud (ArtPERL, section 4.4)."""
