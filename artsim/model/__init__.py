"""What an articulated object is, how it is posed and seen; no backend."""
