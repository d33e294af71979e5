"""Packages that the bytes of a dataset follow from, besides its plan."""

VERSIONS_OF = ("artsim", "numpy", "scipy", "trimesh", "embreex")
