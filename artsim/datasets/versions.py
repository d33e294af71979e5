"""Packages that the bytes of a dataset follow from, besides its plan."""

from artsim.renderers.ray_scenes import RAY_LIBRARY

VERSIONS_OF = ("artsim", "numpy", "scipy", "trimesh", RAY_LIBRARY)
