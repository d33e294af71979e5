"""Maps of objects leave closed surfaces closed, convex pieces convex, and volumes as they must be."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

import artsim
from artsim.model.convex_bodies import is_convex
from artsim.model.stretching import AxisMap
from artsim.variation.geometry import cut_at, fitted, stretched
from tests.conftest import rigid


def mesh_of(vertices: np.ndarray, faces: np.ndarray) -> trimesh.Trimesh:
    return trimesh.Trimesh(vertices, faces, process=False)


@given(axis=st.integers(0, 2), value=st.floats(-1.2, 1.2), turn=st.floats(0, 3), levels=st.integers(0, 2))
def test_a_cut_changes_neither_volume_nor_area_and_no_triangle_crosses_it(
    axis: int, value: float, turn: float, levels: int
) -> None:
    ball = trimesh.creation.icosphere(levels)
    ball.apply_transform(trimesh.transformations.rotation_matrix(turn, [1, 2, 3]))
    vertices, faces = cut_at((np.array(ball.vertices), np.array(ball.faces, np.int32)), axis, value)
    cut = mesh_of(vertices, faces)
    assert cut.is_watertight
    assert cut.is_winding_consistent
    assert cut.volume == pytest.approx(ball.volume, rel=1e-9)
    assert cut.area == pytest.approx(ball.area, rel=1e-9)
    beside = vertices[faces][..., axis] - value
    assert not ((beside.min(axis=1) < -1e-6) & (beside.max(axis=1) > 1e-6)).any()


def test_the_volume_of_a_stretched_box_is_that_of_its_slabs() -> None:
    obj = rigid(trimesh.creation.box((2.0, 1.0, 1.0)))
    new = stretched(obj, 0, AxisMap(np.array([-1.0, 0.0, 1.0]), np.array([-1.0, 0.5, 3.0])))
    assert mesh_of(new.parts[0].vertices, new.parts[0].faces).volume == pytest.approx(4.0)


@pytest.mark.slow
@given(seed=st.integers(0, 9), knots=st.lists(st.integers(-400, 400), min_size=1, max_size=4, unique=True))
def test_bodies_of_a_stretched_object_are_convex_and_their_union_is_its_surface(seed: int, knots: list[int]) -> None:
    """Knots are a millimetre apart at least: edges of parts that are nearer to each other count as one."""
    from manifold3d import Manifold, Mesh64, OpType

    obj = artsim.make("globe", seed)
    ends = np.array([-1.0, *(0.001 * knot for knot in sorted(knots)), 1.0])
    goals = np.concatenate([[0.0], np.cumsum(np.diff(ends) * np.resize([1.5, 0.6], len(ends) - 1))])
    new = stretched(obj, 2, AxisMap(ends, goals))
    for part in new.parts:
        assert part.body is not None
        assert all(is_convex(*piece) for piece in part.body.pieces)
        solids = [Manifold(Mesh64(v, f.astype(np.uint64))) for v, f in part.body.pieces]
        union = Manifold.batch_boolean(solids, OpType.Add).volume()
        assert mesh_of(part.vertices, part.faces).volume == pytest.approx(union, rel=1e-4)


@pytest.mark.parametrize("mirrored", [(False, False, False), (True, False, False), (True, True, True)])
def test_a_fitted_part_fills_the_box_and_stays_right_side_out(mirrored: tuple[bool, ...]) -> None:
    part = artsim.make("laptop", 3).parts[1]
    low, high = np.array([-1.0, 2.0, 0.0]), np.array([1.0, 3.0, 0.1])
    new = fitted(part, np.stack([low, high]), np.array(mirrored))
    np.testing.assert_allclose(new.bounds, [low, high], atol=1e-12)
    before, after = mesh_of(part.vertices, part.faces), mesh_of(new.vertices, new.faces)
    share = np.prod(high - low) / np.prod(part.bounds[1] - part.bounds[0])
    assert after.volume == pytest.approx(before.volume * share)
    assert after.volume > 0
