"""Metrics against closed forms, independent solvers and Monte Carlo."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial import ConvexHull, HalfspaceIntersection
from scipy.spatial.transform import Rotation

from artperl.evaluation import metrics
from artperl.evaluation.box_overlap import intersection_volume, iou_exact, iou_omad_legacy, iou_rest_exact

FRAMES = {
    "as in our tables: x back, z up": np.eye(3),
    "y up, x to the right, z to the front": np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [-1.0, 0.0, 0.0]]),
    "y up, x to the left, z to the back": np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]),
    "y up, x to the back, z to the right": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]]),
}
"""Rotations of the rest frame into the frame that boxes are compared in; ArtImage's have y up."""

Box = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]


def random_box(rng: np.random.Generator, spread: float = 0.5) -> Box:
    rotation = Rotation.random(random_state=int(rng.integers(2**31))).as_matrix()
    return rotation, spread * rng.normal(size=3), rng.uniform(0.05, 1.5, size=3)


def halfspaces(box: Box) -> NDArray[np.float64]:
    rotation, center, size = box
    normals = np.concatenate([rotation.T, -rotation.T])
    return np.column_stack([normals, -(normals @ center) - 0.5 * np.tile(size, 2)])


def volume_by_duality(a: Box, b: Box) -> float:
    """Volume of the intersection by Qhull, around a point well inside both boxes (found by a linear programme)."""
    planes = np.concatenate([halfspaces(a), halfspaces(b)])
    inner = linprog(
        [0, 0, 0, -1], A_ub=np.column_stack([planes[:, :3], np.ones(12)]), b_ub=-planes[:, 3], bounds=[(None, None)] * 4
    )
    if inner.status != 0 or inner.x[3] < 1e-9:
        return 0.0
    return float(ConvexHull(HalfspaceIntersection(planes, inner.x[:3]).intersections).volume)


def test_overlap_equals_that_of_an_independent_solver() -> None:
    rng = np.random.default_rng(0)
    pairs = [(random_box(rng), random_box(rng)) for _ in range(300)]
    stacked = [np.stack([pair[i][j] for pair in pairs]) for i in range(2) for j in range(3)]
    found = intersection_volume(*stacked)
    expected = np.array([volume_by_duality(a, b) for a, b in pairs])
    assert (expected > 0).mean() > 0.3
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_overlap_equals_that_of_random_points() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        a, b = random_box(rng, 0.2), random_box(rng, 0.2)
        local = (rng.random((400_000, 3)) - 0.5) * a[2]
        in_b = (np.abs((local @ a[0].T + a[1] - b[1]) @ b[0]) <= 0.5 * b[2]).all(axis=1)
        volume_a = a[2].prod()
        share = in_b.mean()
        error = 5 * volume_a * np.sqrt(max(share * (1 - share), 1e-6) / len(local))
        assert abs(float(intersection_volume(*a, *b)) - share * volume_a) < error


@pytest.mark.slow
def test_a_box_overlaps_itself_wholly_however_it_is_turned() -> None:
    rng = np.random.default_rng(2)
    turns = Rotation.create_group("O").as_matrix()
    for _ in range(50):
        rotation, center, size = random_box(rng)
        assert iou_exact(rotation, center, size, rotation, center, size) == pytest.approx(1.0, abs=1e-9)
        for turn in turns:  # the same body, described with its axes exchanged
            other = np.abs(turn.T @ np.diag(size) @ turn).diagonal()
            same = iou_exact(rotation, center, size, rotation @ turn, center, other)
            assert same == pytest.approx(1.0, abs=1e-9)


def test_shared_faces_are_counted_once() -> None:
    eye, size = np.eye(3), np.ones(3)
    shift = np.array([0.25, 0.0, 0.0])  # four faces lie in one plane with their counterparts
    assert iou_exact(eye, 0 * shift, size, eye, shift, size) == pytest.approx(0.75 / 1.25, abs=1e-12)
    touching = iou_exact(eye, 0 * shift, size, eye, 4 * shift, size)
    assert touching == pytest.approx(0.0, abs=1e-9)
    for nudge in 10.0 ** np.arange(-18, -3):
        almost = iou_exact(eye, np.zeros(3), size, eye, np.full(3, nudge), size)
        assert almost == pytest.approx((1 - nudge) ** 3 / (2 - (1 - nudge) ** 3), abs=1e-9)


def test_closed_forms_of_boxes() -> None:
    eye, zero, one = np.eye(3), np.zeros(3), np.ones(3)
    eighth = Rotation.from_euler("z", 45, degrees=True).as_matrix()
    # Two unit squares turned by 45 degrees share a regular octagon of area 2 (sqrt(2) - 1).
    assert intersection_volume(eye, zero, one, eighth, zero, one) == pytest.approx(2 * (np.sqrt(2) - 1), abs=1e-12)
    assert iou_exact(eye, zero, one, eighth, zero, 0.3 * one) == pytest.approx(0.027, abs=1e-12)
    assert iou_exact(eye, zero, one, eighth, 3 * one, one) == 0.0
    # A lid of 1 cm that is 5 mm off its plane keeps a third.
    lid = np.array([0.3, 0.2, 0.01])
    assert iou_exact(eye, zero, lid, eye, [0, 0, 0.005], lid) == pytest.approx(1 / 3, abs=1e-12)


def test_overlap_is_symmetric_and_never_above_one() -> None:
    rng = np.random.default_rng(3)
    for _ in range(100):
        a, b = random_box(rng), random_box(rng)
        forward, backward = float(iou_exact(*a, *b)), float(iou_exact(*b, *a))
        assert forward == pytest.approx(backward, abs=1e-10)
        assert 0.0 <= forward <= 1.0


def test_rest_frame_overlap_is_the_exact_one_of_aligned_boxes() -> None:
    rng = np.random.default_rng(4)
    ca, cb = 0.3 * rng.normal(size=(2, 40, 3))
    sa, sb = rng.uniform(0.2, 1.0, size=(2, 40, 3))
    eye = np.broadcast_to(np.eye(3), (40, 3, 3))
    np.testing.assert_allclose(iou_rest_exact(ca, sa, cb, sb), iou_exact(eye, ca, sa, eye, cb, sb), atol=1e-10)


def test_published_sampler_equals_the_exact_overlap_where_its_slip_does_no_harm() -> None:
    # Where the least x equals the least z its corner is right, and only the grid's error is left.
    rng = np.random.default_rng(5)
    low = rng.uniform(-0.2, 0.2, size=(20, 2, 1)) * [1.0, 0.0, 1.0] + rng.uniform(-0.2, 0.2, size=(20, 2, 1)) * [
        0,
        1.0,
        0,
    ]
    size = rng.uniform(0.5, 1.0, size=(20, 2, 3))
    center = low + 0.5 * size
    legacy = iou_omad_legacy(center[:, 0], size[:, 0], center[:, 1], size[:, 1])
    exact = iou_rest_exact(center[:, 0], size[:, 0], center[:, 1], size[:, 1])
    assert np.abs(legacy - exact).max() < 0.05


def test_published_sampler_is_off_elsewhere_by_as_much_as_reported() -> None:
    rng = np.random.default_rng(6)
    center, size = 0.2 * rng.normal(size=(120, 2, 3)), rng.uniform(0.3, 1.0, size=(120, 2, 3))
    legacy = iou_omad_legacy(center[:, 0], size[:, 0], center[:, 1], size[:, 1])
    exact = iou_rest_exact(center[:, 0], size[:, 0], center[:, 1], size[:, 1])
    assert 0.02 < np.abs(legacy - exact).mean() < 0.3


def test_published_sampler_depends_on_the_frame_and_the_exact_overlap_does_not() -> None:
    # A temple, a fiftieth as wide as it is long, that is a quarter of its width off.
    center, size, off = np.array([0.0, 0.33, 0.0]), np.array([0.6, 0.02, 0.07]), np.array([0.0, 0.005, 0.0])
    legacy = []
    for R in FRAMES.values():
        boxes = R @ center, np.abs(R) @ size, R @ (center + off), np.abs(R) @ size
        assert iou_rest_exact(*boxes) == pytest.approx(0.6, abs=1e-12)
        legacy.append(float(iou_omad_legacy(*boxes)))
    assert max(legacy) == 1.0
    assert min(legacy) == 0.0


@pytest.mark.parametrize("degrees", [0.0, 1e-6, 1e-3, 5.0, 90.0, 179.9, 180.0])
def test_rotation_error_is_the_angle_turned_by(degrees: float) -> None:
    rng = np.random.default_rng(7)
    axis = rng.normal(size=(30, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    truth = Rotation.random(30, random_state=1).as_matrix()
    estimate = truth @ Rotation.from_rotvec(np.deg2rad(degrees) * axis).as_matrix()
    np.testing.assert_allclose(metrics.rotation_error(estimate, truth), degrees, atol=1e-6, rtol=1e-6)


def test_translation_is_measured_in_diagonals() -> None:
    assert metrics.translation_error([0.0, 0.03, 0.04], [0.0, 0.0, 0.0], 2.0) == pytest.approx(0.025)


def test_opposite_directions_are_one_axis() -> None:
    x, y = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    assert metrics.axis_error(x, -x) == pytest.approx(0.0)
    assert metrics.axis_error(x, y) == pytest.approx(90.0)


@given(st.lists(st.tuples(st.integers(0, 5), st.booleans()), max_size=30))
def test_area_under_the_curve_is_the_share_of_pairs_in_order(scored: list[tuple[int, bool]]) -> None:
    own, others = ([score for score, kind in scored if kind is positive] for positive in (True, False))
    pairs = [1.0 if a > b else 0.5 if a == b else 0.0 for a in own for b in others]
    area = metrics.auroc([score for score, _ in scored], [kind for _, kind in scored])
    assert area == (pytest.approx(np.mean(pairs)) if pairs else None)


def test_states_of_joints() -> None:
    kinds = ("free", "revolute", "prismatic", "continuous")
    error = metrics.state_error([9.0, 0.1, 0.1, 3.1], [0.0, 0.0, 0.0, -3.1], kinds)
    np.testing.assert_allclose(error, [0.0, np.rad2deg(0.1), 0.1, np.rad2deg(2 * np.pi - 6.2)])
