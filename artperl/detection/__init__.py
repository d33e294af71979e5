"""Finding the objects of an image: which categories, which pixels."""
