"""Finding the objects of an image: which categories, which pixels."""

SHIPPED = "tabletop"
"""Name of the detector that comes with the package: of small things on tables."""
