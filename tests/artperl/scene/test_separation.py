"""Estimates that stand in each other: FCL says how deep, and closed forms how far apart they go."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from artperl.core.estimate import Estimate
from artperl.scene.separation import Boxes, moved, moved_apart, overlap
from tests.conftest import installed


def an_estimate(center: tuple[float, float, float], size: float = 0.1, confidence: float = 0.5) -> Estimate:
    """A cube."""
    T = np.eye(4)[None].copy()
    T[0, :3, 3] = center
    return Estimate(
        rotation=np.eye(3)[None], translation=T[:, :3, 3].copy(), size=np.full((1, 3), size), T_camera_part=T,
        state=np.zeros(1), joint_type=("free",), joint_parent=np.array([-1]), joint_axis=np.zeros((1, 3)),
        joint_origin=np.zeros((1, 3)), part=np.zeros(0, np.int64), visibility=np.ones(1), trajectory=T[None],
        confidence=confidence,
    )  # fmt: skip


@given(st.integers(0, 2**31))
def test_boxes_overlap_where_fcl_finds_them_to_collide(seed: int) -> None:
    fcl, rng = installed("fcl"), np.random.default_rng(seed)
    one, other = (
        Boxes(Rotation.random(random_state=rng).as_matrix()[None], rng.normal(0, 0.3, (1, 3)),
              rng.uniform(0.05, 0.4, (1, 3)))
        for _ in range(2)
    )  # fmt: skip

    def collide(move: np.ndarray) -> bool:
        solids = [
            fcl.CollisionObject(fcl.Box(*(2 * b.half[0])), fcl.Transform(b.rotation[0], b.center[0] + shift))
            for b, shift in ((one, np.zeros(3)), (other, move))
        ]
        return fcl.collide(*solids, fcl.CollisionRequest(), fcl.CollisionResult()) > 0

    depth, direction = overlap(one, other)
    assert collide(np.zeros(3)) == (depth > 0)
    if depth > 1e-3:
        assert not collide((depth + 1e-4) * direction)
        assert collide((depth - 1e-3) * direction)


def test_the_less_sure_one_moves_and_both_end_side_by_side() -> None:
    sure, unsure = an_estimate((0, 0, 1), confidence=1.0), an_estimate((0.09, 0.01, 1), confidence=0.0)
    moves = moved_apart([sure, None, unsure], 0.05)
    assert np.abs(moves[0]).max() < 1e-4
    np.testing.assert_allclose(moves[2], [0.01, 0, 0], atol=2e-4)
    assert not moves[1].any()
    there = moved(unsure, moves[2])
    np.testing.assert_allclose(there.T_camera_part[0, :3, 3], there.translation[0])
    assert overlap(Boxes.of(sure), Boxes.of(there))[0] < 2e-4


def test_three_in_a_row_all_come_free() -> None:
    row = [an_estimate((0.095 * i, 0.0, 1.0)) for i in range(3)]
    free = [moved(estimate, move) for estimate, move in zip(row, moved_apart(row, 0.05), strict=True)]
    for one, other in ((0, 1), (1, 2), (0, 2)):
        assert overlap(Boxes.of(free[one]), Boxes.of(free[other]))[0] < 2e-4


def test_nothing_moves_farther_than_it_may() -> None:
    moves = moved_apart([an_estimate((0, 0, 1)), an_estimate((0.01, 0, 1))], 0.02)
    assert [np.linalg.norm(move) for move in moves] == pytest.approx([0.02, 0.02])
