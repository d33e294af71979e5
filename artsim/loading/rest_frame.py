"""The rest frame of each category: files that lie otherwise than others of their category are turned.

PartNet-Mobility's objects stand upright with their front to -X once loaded, and nearly all of a category lie alike. Its
scissors do not: their zero is 34 degrees open and symmetric about Y, so that closed blades lean by 17 degrees.
"""

from collections.abc import Callable, Sequence

import numpy as np

from artsim.common.products import dot, norm, unit
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import Part, Repair

_ALIKE = np.deg2rad(1.0)
"""Files that lean by less than this are alike."""
_BESIDE = 0.25
"""Share of the reach from the pivot, within which blades and rings run into each other."""

_ROUNDS = 4
"""Which corner of a blunt point is the outermost depends on the direction that is sought."""


def rest_rotation(
    tree: KinematicTree, parts: Sequence[Part], rest: Array, category: str
) -> tuple[Array | None, list[Repair]]:
    """Turn that brings an object into the rest frame of its category, and the reason.

    Parameters
    ----------
    tree : KinematicTree
        Axes and origins at rest, in the base link's frame (Z up).
    parts : sequence of Part
        At rest, in the same frame.
    rest : (K,) float
        The rest state.
    category : str
        As :func:`artsim.loading.rest_state.canonical_category` writes it.

    Returns
    -------
    rotation : (3, 3) float or None
        Base link's axes -> rest frame's axes; None where the object lies as others do.
    reasons : list of Repair
        A note: what the file says stays as it is.
    """
    rule = _RULES.get(category)
    rotation = None if rule is None else rule(tree, parts, rest)
    if rotation is None:
        return None, []
    angle = float(np.arccos(np.clip(0.5 * (np.trace(rotation) - 1.0), -1.0, 1.0)))
    if angle < _ALIKE:
        return None, []
    name = category.replace("_", " ")
    what = f"turned by {np.rad2deg(angle):.1f} deg into the rest frame of {name}: {_WHY[category]}"
    return rotation, [Repair("rest frame", what, note=True)]


def _points_to_y(tree: KinematicTree, parts: Sequence[Part], rest: Array) -> Array | None:
    """Closed scissors: flat, points at +Y, opening about +Z, which puts the root's ring towards -X."""
    if list(tree.types[1:]) != ["revolute"] or not all(len(part.faces) for part in parts):
        return None
    low, high = tree.limits[1]
    opens = 1.0 if high - rest[1] >= rest[1] - low else -1.0
    up = opens * unit(tree.axes[1])
    flat = [_across(part.vertices[np.unique(part.faces)] - tree.origins[1], up) for part in parts]
    every = np.concatenate(flat)
    far = every[np.argmax(norm(every))]
    along, side = unit(far), unit(np.cross(up, far))
    # Rings stand apart where blades lie on each other: of both ends, the narrow one has the points.
    reach, width = dot(every, along), dot(every, side)
    front, back = reach > _BESIDE * reach.max(), reach < _BESIDE * reach.min()
    if not front.any() or not back.any():
        return None
    y = along if np.ptp(width[front]) < np.ptp(width[back]) else -along
    for _ in range(_ROUNDS):
        # Each blade's outermost point: where one is longer, or the pair is not quite shut, the middle is between both.
        tips = [unit(part[np.argmax(dot(part, y))]) for part in flat]
        y = unit(tips[0] + tips[1])
    return np.stack([np.cross(y, up), y, up])


def _across(vectors: Array, axis: Array) -> Array:
    """(N, 3) components of vectors (N, 3) perpendicular to a unit axis."""
    result: Array = vectors - dot(vectors, axis)[:, None] * axis
    return result


_RULES: dict[str, Callable[[KinematicTree, Sequence[Part], Array], Array | None]] = {"scissors": _points_to_y}
_WHY = {"scissors": "closed blades lie along Y, points at +Y, and open about +Z"}
