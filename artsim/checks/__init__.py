"""Gates that objects and files pass."""
