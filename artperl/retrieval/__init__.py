"""References for what is perceived (ArtPERL, section 4.2)."""
