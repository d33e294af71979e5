"""Whether a family reaches beyond the real objects of its category, ratio by ratio.

:mod:`artsim.checks.realism` asks how near the nearest procedural object comes to a real one. This module asks how far
a family reaches: for each ratio, the range of the real objects, the range that the family has to reach, and the range
that it does reach. The required range goes beyond the real one by half of its width at both ends. So an unseen object
that differs from the known ones by half as much again is still one of the family's kind.
"""

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from artsim.model.objects import ArticulatedObject

BEYOND = 0.5
"""How far a family has to reach beyond the real range at each end, over the width of that range."""

ROUNDING = 0.003
"""How far short of a range a family may end: a finite sample seldom meets the ends of the range that it draws from."""

_AXES = "xyz"
_FULL_TURN = 2.0 * np.pi

Values = dict[str, list[float]]
"""Ratio -> its values; one for the object, or one for each part or joint."""


@dataclass(frozen=True)
class Quantity:
    """How a kind of ratio is widened."""

    least: float
    """Smallest margin when one object is known, less the more are: a share of the value if ``relative``."""
    relative: bool
    """Whether ``least`` is a share of the value."""
    low: float
    high: float
    """Values beyond which nothing can lie."""


QUANTITIES = {
    "extent": Quantity(0.25, True, 0.0, 0.98),
    "size": Quantity(0.25, True, 0.0, 1.0),
    "lean": Quantity(0.0, False, 0.0, np.pi / 4),
    "place": Quantity(0.05, False, -np.inf, 0.5),
    # A part that turns by more than half a turn passes through its own body in most categories.
    "opens": Quantity(0.25, True, 0.0, np.pi),
    "slides": Quantity(0.25, True, 0.0, 1.0),
}
"""First word of a ratio's name -> how it is widened."""


def ratios(obj: ArticulatedObject) -> Values:
    """All ratios of an object in its rest frame; lengths over the diagonal, angles in radians.

    Returns
    -------
    dict of str to list of float
        ``extent x`` of the whole object; ``size x of the root``; and for the joints of each kind, say those that turn
        about an axis near z: ``size x`` of their parts, ``lean`` of the axis from z, ``opens`` or ``slides`` (the
        farthest state from rest), and for turning ones ``place x`` and ``place y`` of the axis: its distance inwards
        from the nearer face of the object's box, over the box's side. Parts without a shape have no size.
    """
    tree, diagonal = obj.tree, obj.diagonal
    low, high = obj.bounds
    side = np.maximum(high - low, 1e-9 * diagonal)
    found: Values = defaultdict(list)
    for axis in range(3):
        found[f"extent {_AXES[axis]}"].append(float(side[axis] / diagonal))
        if len(obj.parts[0].faces):
            found[f"size {_AXES[axis]} of the root"].append(float(obj.box_size[0, axis] / diagonal))
    for k in range(1, len(obj)):
        if tree.types[k] == "fixed":
            continue
        direction = tree.axes[k]
        main = int(np.abs(direction).argmax())
        turns = tree.types[k] in ("revolute", "continuous", "screw")
        kind = f"turning about {_AXES[main]}" if turns else f"sliding along {_AXES[main]}"
        for axis in range(3):
            found[f"size {_AXES[axis]} {kind}"].append(float(obj.box_size[k, axis] / diagonal))
            if turns and axis != main:
                at_center = obj.box_center[k, main] - tree.origins[k, main]
                point = tree.origins[k] + at_center / direction[main] * direction
                inwards = min(point[axis] - low[axis], high[axis] - point[axis])
                found[f"place {_AXES[axis]} {kind}"].append(float(inwards / side[axis]))
        found[f"lean {kind}"].append(float(np.arccos(min(1.0, abs(direction[main])))))
        farthest = float(np.abs(tree.limits[k] - tree.rest[k]).max())
        if turns:
            found[f"opens {kind}"].append(min(farthest, _FULL_TURN))
        elif np.isfinite(farthest):
            found[f"slides {kind}"].append(farthest / diagonal)
    return dict(found)


def required_range(name: str, values: Sequence[float], objects: int) -> tuple[float, float]:
    """Range that a family has to reach, given a ratio's values in some number of real objects."""
    quantity = QUANTITIES[name.split()[0]]
    low, high = min(values), max(values)
    least = quantity.least / objects
    margins = [max(BEYOND * (high - low), least * (abs(end) if quantity.relative else 1.0)) for end in (low, high)]
    # A ratio has no negative values: half of the least one is as far below as it has to go.
    below = max(low - margins[0], 0.5 * low) if quantity.relative else low - margins[0]
    return max(below, min(quantity.low, low)), min(high + margins[1], max(quantity.high, high))


@dataclass(frozen=True)
class Reach:
    """One ratio of a category."""

    name: str
    real: tuple[float, float]
    required: tuple[float, float]
    family: tuple[float, float]
    """(float, float). Lowest and highest value; ``family`` is NaN where no procedural object has this ratio."""

    @property
    def holds_real(self) -> bool:
        """Whether every real object lies within the family."""
        return self._covers(self.real)

    @property
    def reaches(self) -> bool:
        """Whether the family reaches over the whole required range."""
        return self._covers(self.required)

    def _covers(self, values: tuple[float, float]) -> bool:
        return self.family[0] <= values[0] + ROUNDING and values[1] <= self.family[1] + ROUNDING


def reach(real: Mapping[str, Values], family: Iterable[Values]) -> list[Reach]:
    """Compare a family with the real objects of its category, ratio by ratio.

    Parameters
    ----------
    real : mapping of str to Values
        Object id -> its :func:`ratios`.
    family : iterable of Values
        Of many procedural objects.
    """
    pooled, ours, count = _pool(real.values()), _pool(family), _counts(real.values())
    found = []
    for name in sorted(pooled):
        values, made = pooled[name], ours.get(name, [np.nan])
        ends = (float(min(made)), float(max(made)))
        found.append(Reach(name, (min(values), max(values)), required_range(name, values, count[name]), ends))
    return found


def left_out(real: Mapping[str, Values]) -> dict[str, list[str]]:
    """Object id -> the ratios in which it lies outside of the range that all the others require.

    A ratio that no other object has is not counted: nothing is known of it without this object.
    """
    outside = {}
    for name, values in real.items():
        others = [other for key, other in real.items() if key != name]
        pooled, count = _pool(others), _counts(others)
        ranges = {ratio: required_range(ratio, pooled[ratio], count[ratio]) for ratio in values if ratio in pooled}
        outside[name] = [r for r, (low, high) in ranges.items() if not low <= min(values[r]) <= max(values[r]) <= high]
    return outside


def _counts(objects: Iterable[Values]) -> Counter[str]:
    return Counter(name for values in objects for name in values)


def _pool(objects: Iterable[Values]) -> Values:
    pooled: Values = defaultdict(list)
    for values in objects:
        for name, some in values.items():
            pooled[name].extend(some)
    return dict(pooled)
