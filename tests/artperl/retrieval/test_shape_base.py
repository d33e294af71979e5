"""The shape base keeps objects as they are, and finds the nearest."""

from __future__ import annotations

import time

import numpy as np
import pytest
import torch

import artsim
from artperl.retrieval.shape_base import ShapeBase, widen_limits
from artsim.errors import ConfigError
from tests.artperl.worlds import small_base


@pytest.fixture(scope="module")
def base() -> ShapeBase:
    objects = [artsim.make(category, seed) for category in ("laptop", "drawer") for seed in range(3)]
    made = ShapeBase.of(objects, points_per_part=64)
    return made.with_embeddings(torch.randn(len(made), 16, generator=torch.Generator().manual_seed(0)))


def test_clouds_lie_on_the_objects_they_stand_for(base: ShapeBase) -> None:
    obj = artsim.make("drawer", 1).with_diagonal(1.0)
    row = 4
    for k in range(len(obj)):
        _, distance, _ = obj.part_mesh(k).nearest.on_surface(base.shapes.points[row, k].numpy())
        assert distance.max() < 1e-5
    np.testing.assert_allclose(base.shapes.box_size[row, : len(obj)], obj.box_size, atol=1e-6)
    assert base.shapes.diagonal.allclose(torch.ones(len(base)))


def test_the_nearest_object_is_found_in_well_under_a_millisecond(base: ShapeBase) -> None:
    assert base.embeddings is not None
    rows, distance = base.nearest_objects(base.embeddings + 1e-3)
    assert rows[:, 0].tolist() == list(range(len(base)))
    assert distance.max() < 0.01
    laptops, _ = base.nearest_objects(base.embeddings, 3, base.of_category("laptop"))
    assert sorted(laptops[5].tolist()) == [0, 1, 2]
    times = []
    for _ in range(50):
        start = time.perf_counter()
        base.nearest_objects(base.embeddings[:1])
        times.append(time.perf_counter() - start)
    assert min(times) < 1e-3


def test_what_cannot_be_searched_is_refused(base: ShapeBase) -> None:
    with pytest.raises(ConfigError, match="no embeddings"):
        ShapeBase.of([artsim.make("laptop", 0)], 8).nearest_objects(torch.zeros(1, 4))
    assert base.embeddings is not None
    with pytest.raises(ConfigError, match="fewer than 4"):
        base.nearest_objects(base.embeddings, 4, base.of_category("laptop"))
    with pytest.raises(ConfigError, match="needs objects"):
        ShapeBase.of([])


def test_references_go_as_far_as_any_of_their_kind() -> None:
    objects = [artsim.make("laptop", seed) for seed in range(4)] + [artsim.make("drawer", seed) for seed in range(6)]
    wide = widen_limits([obj.with_diagonal(1.0) for obj in objects])
    for obj, other in zip(objects, wide, strict=True):
        own = obj.with_diagonal(1.0).tree
        assert other.tree.types == own.types
        np.testing.assert_allclose(other.tree.axes, own.axes)
        np.testing.assert_allclose(other.tree.origins, own.origins, atol=1e-9)
        assert (other.tree.limits[:, 0] <= own.limits[:, 0] + 1e-9).all()
        assert (other.tree.limits[:, 1] >= own.limits[:, 1] - 1e-9).all()
    laptops = np.stack([obj.tree.limits for obj in wide[:4]])
    np.testing.assert_allclose(laptops, laptops[:1].repeat(4, axis=0))
    farthest = max(obj.tree.limits[1, 1] for obj in objects[:4])
    assert laptops[0, 1, 1] == pytest.approx(farthest)


def test_only_axes_of_one_sort_lean() -> None:
    """Hinges of eyeglasses lean, both by the same angle; those of laptops do not; doors and flaps are of two sorts."""
    prior = small_base("eyeglasses", "laptop").axis_prior(0)
    assert prior is not None
    assert prior.leans[0].tolist() == [False, True, True]
    spread = torch.linalg.eigvalsh(prior.covariance[0]).clamp(min=0).sqrt()
    assert 0.05 < float(spread[-1]) < 0.7
    assert float(spread[:-1].max()) < 0.01
    assert small_base("eyeglasses", "laptop").axis_prior(6) is None
    doors = ShapeBase.of([artsim.make("storage_furniture", seed) for seed in range(30)], 16)
    same = [row for row in range(len(doors)) if int((doors.kind == doors.kind[row]).sum()) > 1]
    assert same
    assert all(doors.axis_prior(row) is None for row in same)
