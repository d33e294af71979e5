"""The rest state of each category: laptops, boxes, knives and the like closed, handles of buckets upright.

Everything else is at its file's zero.

The zero of a PartNet-Mobility joint differs between instances: a laptop's may stand at any opening angle. Where the
file's zero cannot be trusted, the closed state is found from geometry and limits, so that it is the same for every
instance, known or not. In PartNet-Mobility doors, drawers and lids of appliances are closed at their zero, and
eyeglasses open.
"""

from collections.abc import Callable, Sequence

import numpy as np

from artsim.common.products import norm
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import Part, Repair
from artsim.model.transforms import transform_points

_STATES = 61  # of a joint's range that are looked at before refining
_HINGED_SHUT = np.deg2rad(15.0)  # a lid's limit may lie this far beyond the state in which it is shut
_AS_SMALL = 1.01  # volumes that differ by less are alike: rings and blades hide a little angle
_UPRIGHT = np.deg2rad(3.0)  # a handle that leans by less stands upright


def canonical_category(name: str) -> str:
    """``StorageFurniture`` and ``storage furniture`` are both ``storage_furniture``."""
    words = "".join(f"_{c.lower()}" if c.isupper() else c for c in name.strip()).replace(" ", "_").replace("-", "_")
    return "_".join(word for word in words.split("_") if word)


def rest_state(tree: KinematicTree, parts: Sequence[Part], category: str) -> tuple[Array, list[Repair]]:
    """State that every instance of a category is aligned at, and the reasons where it is not the file's zero.

    Parameters
    ----------
    tree : KinematicTree
        With rest state 0, in the base link's frame (Z up).
    parts : sequence of Part
        In the same frame, at the file's zero state.
    category : str
        As :func:`canonical_category` writes it.

    Returns
    -------
    rest : (K,) float
        Within the limits.
    reasons : list of Repair
        Notes: the joint's own values stay those of the file.
    """
    rest = np.clip(0.0, tree.limits[:, 0], tree.limits[:, 1])
    reasons = {int(k): "0 is outside its limits" for k in np.flatnonzero(rest)}
    rule = _RULES.get(category)
    if rule is not None:
        shape = _Shape(tree, parts, rest)
        for k in tree.free_joints:
            if np.isfinite(tree.limits[k]).all() and tree.limits[k, 0] < tree.limits[k, 1]:
                found = rule(shape, int(k))
                if found is not None:
                    rest[k] = found
                    reasons[int(k)] = _REASONS.get(category, f"a {category.replace('_', ' ')} is closed there")
    return rest, [
        Repair(
            f"joint {tree.joints[k].name!r}", f"rest state {_value(tree, k, rest[k])} instead of 0: {reason}", note=True
        )
        for k, reason in sorted(reasons.items())
        if rest[k] != 0.0
    ]


def _value(tree: KinematicTree, k: int, state: float) -> str:
    return f"{state:.4g} m" if tree.types[k] == "prismatic" else f"{np.rad2deg(state):.1f} deg"


class _Shape:
    """An object reduced to the corners of its parts' convex hulls, posed one joint at a time."""

    def __init__(self, tree: KinematicTree, parts: Sequence[Part], rest: Array):
        self.tree = tree
        self.rest = rest
        self.labels = [part.label for part in parts]
        self.corners = [hull_corners(part) for part in parts]
        sizes = [np.sort(np.ptp(corners, axis=0)) if len(corners) else np.zeros(3) for corners in self.corners]
        self.breadth = np.array([size[1] for size in sizes])  # second largest side of each part's box

    def posed(self, k: int, state: float) -> list[Array]:
        """Corners of every part with joint k at a state and all others at rest."""
        q = self.rest.copy()
        q[k] = state
        T = self.tree.forward_kinematics(q)
        return [transform_points(T[i], corners) for i, corners in enumerate(self.corners)]

    def hull_volume(self, k: int, state: float) -> float:
        """Volume of the convex hull of the whole object: least when it is folded up, however it is turned."""
        from scipy.spatial import ConvexHull, QhullError

        corners = np.concatenate(self.posed(k, state))
        try:
            return float(ConvexHull(corners, qhull_options="QJ").volume)
        except QhullError:  # parts of very different sizes, or very far apart
            return float(np.ptp(corners, axis=0).prod())

    def states(self, k: int) -> Array:
        """States over a joint's range."""
        low, high = self.tree.limits[k]
        return np.linspace(low, high, _STATES)

    def best(self, cost: Callable[[float], float], k: int) -> float:
        """The least-cost state of a joint."""
        states = self.states(k)
        state = states[np.argmin([cost(state) for state in states])]
        return self.refined(cost, k, float(state), float(states[1] - states[0]))

    def refined(self, cost: Callable[[float], float], k: int, state: float, reach: float) -> float:
        """The least-cost state within reach of one, cut to the limits."""
        from scipy.optimize import minimize_scalar

        low, high = np.clip([state - reach, state + reach], *self.tree.limits[k]).tolist()
        best = minimize_scalar(cost, bounds=(low, high), method="bounded", options={"xatol": 1e-4})
        # The search stays inside its bounds: a limit itself may be better.
        return float(min((low, float(best.x), high), key=cost))


def hull_corners(part: Part) -> Array:
    """(C, 3) corners of a part's convex hull; none for a part without geometry."""
    from scipy.spatial import ConvexHull, QhullError

    if len(part.faces) == 0:
        return np.zeros((0, 3))
    vertices = part.vertices[np.unique(part.faces)]
    try:
        return vertices[ConvexHull(vertices, qhull_options="QJ").vertices]
    except QhullError:  # sides of very different lengths; without a hull, all of them are its corners
        return vertices


def _closing_end(shape: _Shape, k: int) -> float:
    """The limit at which the object takes less room."""
    return float(min(shape.tree.limits[k], key=lambda state: shape.hull_volume(k, state)))


def _shut_lid(shape: _Shape, k: int) -> float | None:
    """A laptop's lid: lying flat, at the end of its range where it lies on the base."""
    if shape.tree.types[k] != "revolute" or shape.breadth[k] < shape.breadth[1:].max():
        return None
    return shape.refined(lambda q: float(np.ptp(shape.posed(k, q)[k][:, 2])), k, _closing_end(shape, k), _HINGED_SHUT)


def _covering_flap(shape: _Shape, k: int) -> float | None:
    """A box's flap or lid: lying flat, over the middle of the box."""
    if shape.tree.types[k] != "revolute" or len(shape.corners[0]) == 0:
        return None
    body = 0.5 * (shape.corners[0].min(axis=0) + shape.corners[0].max(axis=0))

    def cost(state: float) -> float:
        flap = shape.posed(k, state)[k]
        low, high = flap.min(axis=0), flap.max(axis=0)
        return float(high[2] - low[2] + norm(0.5 * (low + high)[:2] - body[:2]))

    return shape.best(cost, k)


def _folded(shape: _Shape, k: int) -> float | None:
    """A knife: blade folded or drawn back to the end of its range."""
    return _closing_end(shape, k)


def _shut_case(shape: _Shape, k: int) -> float | None:
    """A suitcase's lid, at the end of its range; its handles stay where they are."""
    if shape.tree.types[k] != "revolute" or "handle" in shape.labels[k]:
        return None
    return _closing_end(shape, k)


def _arms_together(shape: _Shape, k: int) -> float | None:
    """Staplers: arms together; of nearly equal states, the one nearest the file's zero."""
    if shape.tree.types[k] != "revolute":
        return None
    states = shape.states(k)
    volumes = np.array([shape.hull_volume(k, state) for state in states])
    least = shape.refined(lambda q: shape.hull_volume(k, q), k, float(states[volumes.argmin()]), states[1] - states[0])
    limit = _AS_SMALL * min(shape.hull_volume(k, least), volumes.min())
    candidates = np.array([least, shape.rest[k], *states[volumes <= limit]])
    good = [state for state in candidates if shape.hull_volume(k, state) <= limit]
    return float(min(good, key=abs))


def _blades_together(shape: _Shape, k: int) -> float | None:
    """Scissors: shut as far as they go, unless the range goes beyond the state in which blades lie on each other."""
    together = _arms_together(shape, k)
    if together is None:
        return None
    end = _closing_end(shape, k)
    return end if shape.hull_volume(k, end) <= _AS_SMALL * shape.hull_volume(k, together) else together


def _upright_handle(shape: _Shape, k: int) -> float | None:
    """A bucket's handle: upright, as far as it goes; files have it anywhere from one rim to the other."""
    if shape.tree.types[k] != "revolute" or "handle" not in shape.labels[k] or len(shape.corners[k]) == 0:
        return None

    def cost(state: float) -> float:
        return -float(shape.posed(k, state)[k][:, 2].mean())

    upright = shape.best(cost, k)
    zero = float(shape.rest[k])
    return zero if abs(upright - zero) < _UPRIGHT else upright


_REASONS = {"bucket": "its handle is upright there"}
"""Of rules that do not close what they are for."""

_RULES: dict[str, Callable[[_Shape, int], float | None]] = {
    "laptop": _shut_lid,
    "box": _covering_flap,
    "stapler": _arms_together,
    "scissors": _blades_together,
    "bucket": _upright_handle,
    "knife": _folded,
    "cutter": _folded,
    "suitcase": _shut_case,
}
