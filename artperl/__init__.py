"""ArtPERL."""
