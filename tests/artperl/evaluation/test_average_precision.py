"""Average precision by its rule: a case worked out by hand, and a second implementation on random ones."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artperl.evaluation.average_precision import (
    CRITERIA,
    Criterion,
    PosedObject,
    ap_table,
    average_precision,
    overlapping,
    pair_parts,
    within_degrees,
    within_metres,
)


def posed(
    image: str, degrees: list[float], x: list[float], score: float = 1.0, counted: bool = True, category: str = "box"
) -> PosedObject:
    """An object whose parts are turned about z and lie along x, cubes of 10 cm."""
    rotation = Rotation.from_euler("z", np.reshape(degrees, (-1, 1)), degrees=True).as_matrix().reshape(-1, 3, 3)
    center = np.stack([x, np.zeros(len(x)), np.ones(len(x))], axis=1)
    return PosedObject(image, category, rotation, center, np.full((len(x), 3), 0.1), score, counted)


def test_a_case_worked_out_by_hand() -> None:
    true = [posed("a", [0, 0], [0, 1]), posed("b", [0, 90], [0, 1])]  # four parts
    found = [
        posed("a", [4, 6], [0, 1], 0.9),  # one part of two is within 5 degrees
        posed("a", [0, 0], [0, 1], 0.8),  # the true object is taken: two false positives
        posed("b", [0, 90], [0, 1], 0.7),  # both parts
        posed("c", [0, 0], [0, 1], 0.6),  # nothing is in this image
    ]
    # Score: right / found / recall: .9: 1/2, 1/4; .8: 1/4; .7: 3/6, 3/4; .6: 3/8. Precision made to fall only:
    # 1/2 up to a recall of 1/4 (from .9, and from .7 as well), and 1/2 up to 3/4; nothing beyond.
    assert average_precision(found, true, within_degrees(5.0)) == pytest.approx(0.5 * 0.75)
    assert average_precision(found[2:], true, within_degrees(5.0)) == pytest.approx(0.5)
    assert average_precision([], true, within_degrees(5.0)) == 0.0
    assert average_precision(found, [], within_degrees(5.0)) is None


def test_perfect_estimates_have_all_and_an_object_that_does_not_count_neither_helps_nor_harms() -> None:
    true = [posed("a", [0, 10], [0, 1]), posed("a", [0, 10], [3, 4]), posed("a", [50, 0], [6, 7], counted=False)]
    found = [posed("a", [0, 10], [3, 4], 0.2), posed("a", [0, 10], [0, 1], 0.3), posed("a", [50, 0], [6, 7], 0.9)]
    for rule in CRITERIA.values():
        assert average_precision(found, true, rule) == 1.0
    assert average_precision(found[1:], true, within_metres(0.05)) == 0.5


def test_cubes_that_are_shifted_have_the_overlap_of_their_common_part() -> None:
    true = posed("a", [0], [0.0])
    for shift in (0.02, 0.033, 0.034, 0.05):
        common = 0.1 - shift
        right = common / (0.1 + shift) >= 0.5
        assert overlapping(0.5)(posed("a", [0], [shift]), true).tolist() == [[right]]


def test_roots_are_compared_with_roots_and_others_in_the_best_order() -> None:
    right = np.array([[False, True, True], [True, False, True], [True, True, False]])
    assert pair_parts(right).tolist() == [False, True, True]
    assert pair_parts(np.array([[True], [True]])).tolist() == [True, False]


def test_an_object_that_looks_the_same_is_right_in_each_way() -> None:
    true = posed("a", [0, 0], [0.0, 0.5])
    swapped = posed("a", [0, 0], [0.5, 0.0])
    rule = within_metres(0.05)
    assert average_precision([swapped], [true], rule) == 0.0
    assert average_precision([swapped], [replace(true, equals=(swapped,))], rule) == 1.0
    assert average_precision([true], [replace(true, equals=(swapped,))], rule) == 1.0


def test_the_table_has_every_category_that_is_there() -> None:
    table = ap_table([posed("a", [0], [0.0], category="drawer")], [posed("a", [0], [0.0])])
    assert table == {"box": {"5_degrees": 0.0, "5_cm": 0.0, "iou_50": 0.0, "objects": 1, "parts": 1, "found": 0}}


def slow_average_precision(found: list[PosedObject], true: list[PosedObject], rule: Criterion) -> float:
    """The rule again, by trying all pairings of parts and every threshold."""
    entries: list[tuple[float, bool]] = []
    taken: set[int] = set()
    for one in sorted(range(len(found)), key=lambda n: (-found[n].score, n)):
        options = []
        for t, other in enumerate(true):
            if t in taken or other.image != found[one].image:
                continue
            right = rule(found[one], other)
            F, T = right.shape
            best: list[bool] = []
            for order in permutations(range(1, max(F, T))):
                flags = [bool(right[0, 0])]
                flags += [order[p] < T and bool(right[p + 1, order[p]]) if p < len(order) else False
                          for p in range(F - 1)] if F > 1 else []  # fmt: skip
                if not best or sum(flags) > sum(best):
                    best = flags
            gap = float(np.linalg.norm(found[one].center[0] - other.center[0]))
            if sum(best):
                options.append((-sum(best), gap, t, best))
        if options:
            _, _, t, best = min(options)
            taken.add(t)
            entries += [(found[one].score, flag) for flag in best]
        else:
            entries += [(found[one].score, False)] * len(found[one].center)
    total = sum(len(t.center) for t in true)
    curve = []
    for threshold in sorted({score for score, _ in entries}, reverse=True):
        above = [flag for score, flag in entries if score >= threshold]
        curve.append((sum(above) / total, sum(above) / len(above)))
    area = before = 0.0
    for i, (recall, _) in enumerate(curve):
        area += (recall - before) * max(precision for _, precision in curve[i:])
        before = recall
    return area


@pytest.mark.parametrize("seed", range(8))
def test_a_second_implementation_agrees_on_random_scenes(seed: int) -> None:
    rng = np.random.default_rng(seed)

    def draw(parts: int, noise: float) -> tuple[list[float], list[float]]:
        return (rng.normal(0, 4 * noise, parts)).tolist(), (
            np.arange(parts) + rng.normal(0, 0.04 * noise, parts)
        ).tolist()

    true, found = [], []
    for _ in range(12):
        image, parts = str(rng.integers(4)), int(rng.integers(1, 4))
        true.append(posed(image, *draw(parts, 0.0)))
        for _ in range(rng.integers(3)):
            score = round(float(rng.random()), 1)  # some are equal
            found.append(posed(image, *draw(parts if rng.random() < 0.8 else 2, 1.0), score))
    for rule in CRITERIA.values():
        assert average_precision(found, true, rule) == pytest.approx(slow_average_precision(found, true, rule))
