"""Loaded objects made ready to be exported: proper names, joints that are 0 at rest, and something that collides."""

from dataclasses import replace
from typing import Literal, get_args

import numpy as np

from artsim.errors import ConfigError
from artsim.loading.decomposition import DEFAULTS, DecompositionOptions, decompose
from artsim.model.convex_bodies import DEFAULT_DENSITY, add_surface_bodies, convex_hull
from artsim.model.objects import ArticulatedObject, Body

Collision = Literal["pieces", "hull", "surface"]
"""What of a loaded part collides: convex pieces of its surface, its convex hull, or its surface as it is."""
_THIN = 1e-3
"""Least thickness of a hull, over the object's diagonal."""


def prepare(
    obj: ArticulatedObject,
    collision: Collision = "pieces",
    decomposition: DecompositionOptions = DEFAULTS,
    progress: bool = True,
) -> ArticulatedObject:
    """A loaded object as :func:`artsim.export.export` takes it.

    Parts that have a body, as those of procedural objects and of MJCF and USD files do, keep it.

    Parameters
    ----------
    obj : ArticulatedObject
    collision : "pieces", "hull" or "surface"
        Things can be put into what is made of pieces. Simulators that take convex shapes only make a hull of a surface.
    decomposition : DecompositionOptions, optional
        Of pieces.
    progress : bool
        Show a progress bar.

    Raises
    ------
    ConfigError
        When there is no such collision geometry, or CoACD is needed and not installed.
    """
    if collision not in get_args(Collision):
        raise ConfigError(f"there is no {collision!r}", "collision", f"use {', '.join(get_args(Collision))}")
    if collision == "pieces":
        obj = decompose(obj, decomposition, progress)
    elif collision == "hull":
        thickness = _THIN * obj.diagonal / obj.scale
        parts = []
        for part in obj.parts:
            if part.body is None and len(part.faces):
                hull = convex_hull(part.vertices[np.unique(part.faces)], thickness)
                part = replace(part, body=Body((hull,), DEFAULT_DENSITY, hull))
            parts.append(part)
        obj = replace(obj, parts=tuple(parts))
    return add_surface_bodies(obj)
