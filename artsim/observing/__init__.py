"""From a frame to a labelled sample."""
