"""What each point of a cloud is: its part, and its place in the rest frame."""
