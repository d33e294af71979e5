"""Average precision of 9D part poses over the detections of many images.

Rule. Objects that were found in an image take, from the highest score down, one true object each: of the free ones of
their category in their image, that of which they have most parts right (then the nearest). An object without a right
part takes none. Roots are compared with roots, and other parts one to one so that most are right: files number parts in
different orders. A part of a found object is a true positive if it is right, and a false positive otherwise, with the
object's score. True parts that nobody has right are missed. The average precision of a category is the area below the
curve of precision over recall, whose precision is made to fall only (all points, as in PASCAL VOC from 2010 on). Parts
of equal score come together. An object that could not be estimated is a miss, never left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from artperl.evaluation.box_overlap import iou_exact
from artperl.evaluation.metrics import rotation_error
from artperl.evaluation.part_detection import precision_recall

Array = NDArray[np.float64]
Right = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class PosedObject:
    """Parts of an object in an image, the root first. Camera frame, metres."""

    image: str
    category: str
    rotation: Array
    """(K, 3, 3) float."""
    center: Array
    size: Array
    """(K, 3) float. Of the posed boxes."""
    score: float = 1.0
    """Of a found object."""
    counted: bool = True
    """Of a true object: whether it is to be found. Who finds another one neither wins nor loses."""
    equals: tuple[PosedObject, ...] = ()
    """Of a true object: the same one as it looks the same, its parts renumbered. Each of them is as true."""


Criterion = Callable[[PosedObject, PosedObject], Right]
"""(F, T) whether each part of a found object has the pose of each part of a true one."""


def within_degrees(most: float) -> Criterion:
    """Rotations that differ by at most so many degrees."""
    return lambda found, true: rotation_error(found.rotation[:, None], true.rotation[None]) <= most


def within_metres(most: float) -> Criterion:
    """Box centres at most so many metres apart."""
    return lambda found, true: np.linalg.norm(found.center[:, None] - true.center[None], axis=-1) <= most


def overlapping(least: float) -> Criterion:
    """Posed boxes whose exact intersection over union is at least this."""

    def right(found: PosedObject, true: PosedObject) -> Right:
        shape = (len(found.center), len(true.center))
        first, second = (
            [np.broadcast_to(np.expand_dims(value, axis), (*shape, *value.shape[1:]))
             for value in (obj.rotation, obj.center, obj.size)]
            for obj, axis in ((found, 1), (true, 0))
        )  # fmt: skip
        return np.asarray(iou_exact(*first, *second) >= least)

    return right


CRITERIA: dict[str, Criterion] = {
    "5_degrees": within_degrees(5.0),
    "5_cm": within_metres(0.05),
    "iou_50": overlapping(0.5),
}
"""ReArtMix's, by their keys in JSON."""


def pair_parts(right: Right) -> Right:
    """(F,) which parts of a found object are right, given (F, T) which have the pose of which true part.

    The root, first on both sides, can be that of the other alone; the others are paired so that most are right.
    """
    paired = np.zeros(len(right), dtype=bool)
    paired[0] = right[0, 0]
    rest = right[1:, 1:]
    if rest.size:
        mine, theirs = linear_sum_assignment(rest, maximize=True)
        paired[1 + mine] = rest[mine, theirs]
    return paired


def average_precision(found: Sequence[PosedObject], true: Sequence[PosedObject], criterion: Criterion) -> float | None:
    """Average precision of the parts of one category's objects, by the rule of this module.

    Returns
    -------
    float or None
        0 to 1; None where there is no true object to find.
    """
    total = sum(len(obj.center) for obj in true if obj.counted)
    if total == 0:
        return None
    scores, right = match(found, true, criterion)
    precision, recall = precision_recall(scores, right, total)
    falling = np.maximum.accumulate(precision[::-1])[::-1]
    return float(np.sum(np.diff(recall, prepend=0.0) * falling))


def match(found: Sequence[PosedObject], true: Sequence[PosedObject], criterion: Criterion) -> tuple[Array, Right]:
    """Score of each part of the found objects of a category, and whether it is right; without those of true objects
    that do not count."""
    free: dict[str, list[PosedObject]] = {}
    for obj in true:
        free.setdefault(obj.image, []).append(obj)
    scores, right = [np.zeros(0)], [np.zeros(0, dtype=bool)]
    for obj in sorted(found, key=lambda o: -o.score):  # stable: of equal ones the first given
        best, taken, rank = np.zeros(len(obj.center), dtype=bool), None, (0, 0.0)
        for other in free.get(obj.image, []):
            ways = [pair_parts(criterion(obj, true)) for true in (other, *other.equals)]
            parts = max(ways, key=lambda way: int(way.sum()))
            order = (int(parts.sum()), -float(np.linalg.norm(obj.center[0] - other.center[0])))
            if order[0] > 0 and (taken is None or order > rank):
                best, taken, rank = parts, other, order
        if taken is not None:
            free[obj.image].remove(taken)
        if taken is None or taken.counted:
            scores.append(np.full(len(best), obj.score))
            right.append(best)
    return np.concatenate(scores), np.concatenate(right)


def ap_table(found: Sequence[PosedObject], true: Sequence[PosedObject]) -> dict[str, Any]:
    """Average precision of each category of the true objects by each criterion, in JSON's terms.

    Returns
    -------
    dict
        ``{category: {criterion: x, "objects": n, "parts": n, "found": n}}``.
    """
    table: dict[str, Any] = {}
    for category in sorted({obj.category for obj in true if obj.counted}):
        mine = [obj for obj in found if obj.category == category]
        theirs = [obj for obj in true if obj.category == category]
        counted = [obj for obj in theirs if obj.counted]
        table[category] = {name: average_precision(mine, theirs, rule) for name, rule in CRITERIA.items()}
        table[category] |= {
            "objects": len(counted), "parts": sum(len(obj.center) for obj in counted), "found": len(mine)
        }  # fmt: skip
    return table
