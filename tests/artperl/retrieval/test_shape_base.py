"""The shape base keeps objects as they are, and finds the nearest."""

from __future__ import annotations

import time
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import torch

import artsim
from artperl.core.shapes import Shapes
from artperl.data.categories import objects_of
from artperl.retrieval.shape_base import ShapeBase, widen_limits
from artsim.errors import ConfigError, DatasetError
from tests.artperl.worlds import small_base


@pytest.fixture(scope="module")
def base() -> ShapeBase:
    objects = [artsim.make(category, seed) for category in ("laptop", "drawer") for seed in range(3)]
    made = ShapeBase.of(objects, points_per_part=64)
    return made.with_embeddings(torch.randn(len(made), 16, generator=torch.Generator().manual_seed(0)))


def test_a_base_comes_back_from_its_file(base: ShapeBase, tmp_path: Path) -> None:
    base.save(tmp_path / "base.npz")
    back = ShapeBase.load(tmp_path / "base.npz")
    assert (back.object_ids, back.categories, back.trees) == (base.object_ids, base.categories, base.trees)
    assert base.embeddings is not None
    assert back.embeddings is not None
    torch.testing.assert_close(back.embeddings, base.embeddings)
    torch.testing.assert_close(back.shapes.points, base.shapes.points, atol=2.5e-4, rtol=0.0)
    torch.testing.assert_close(back.shapes.normals, base.shapes.normals, atol=8e-3, rtol=0.0)
    for field in fields(base.shapes.trees):
        torch.testing.assert_close(getattr(back.shapes.trees, field.name), getattr(base.shapes.trees, field.name))


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


def test_references_have_no_more_rows_than_they_need(base: ShapeBase) -> None:
    laptops = base.references(torch.tensor([0, 2]))
    assert laptops.trees.valid.shape == (2, 2)
    assert laptops.trees.carries.shape == (2, 2, 2)
    assert laptops.points.eq(base.shapes.points[[0, 2], :2]).all()


def test_what_cannot_be_searched_or_read_is_refused(base: ShapeBase, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no embeddings"):
        ShapeBase.of([artsim.make("laptop", 0)], 8).nearest_objects(torch.zeros(1, 4))
    assert base.embeddings is not None
    with pytest.raises(ConfigError, match="fewer than 4"):
        base.nearest_objects(base.embeddings, 4, base.of_category("laptop"))
    with pytest.raises(ConfigError, match="needs objects"):
        ShapeBase.of([])
    (tmp_path / "broken.npz").write_bytes(b"not a base")
    for name in ("broken.npz", "missing.npz"):
        with pytest.raises(DatasetError, match="shape base"):
            ShapeBase.load(tmp_path / name)


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


def _composed(base: ShapeBase, like: ShapeBase, row: int) -> Shapes:
    """Of a base, what is most like an object of another one."""
    K, shapes = len(like.trees[row]), like.shapes
    asked = shapes.box_center[row, :K], shapes.box_size[row, :K], like.joints[row, :K], shapes.trees.parent[row, :K]
    return base.compose(*asked)[1]


def test_an_object_is_composed_of_its_own_parts() -> None:
    base = ShapeBase.of(objects_of(["storage_furniture"], 4, 30, "any", 8), 16)
    for row in range(len(base)):
        own = base.shapes[row : row + 1]
        made = _composed(base, base, row)
        for name in ("box_center", "box_size", "points", "normals", "spacing", "diagonal"):
            assert torch.equal(getattr(made, name), getattr(own, name)), name
        for name in ("valid", "kind", "parent", "axis", "carries", "free"):
            assert torch.equal(getattr(made.trees, name), getattr(own.trees, name)), name
        assert (made.trees.lower <= own.trees.lower).all()
        assert (made.trees.upper >= own.trees.upper).all()
        away = own.trees.origin - made.trees.origin  # along the axis it does not matter where its origin is
        turns = own.trees.turn != 0
        across = torch.linalg.cross(away, own.trees.axis)[turns]
        torch.testing.assert_close(across, torch.zeros_like(across), atol=1e-5, rtol=0)


@pytest.mark.slow
@pytest.mark.parametrize("category", ["storage_furniture", "robot_arm"])
def test_what_no_object_is_like_is_composed_of_several(category: str) -> None:
    """Doors, flaps, drawers and links at other places: the tree is right, and so are the axes."""
    base = ShapeBase.of(objects_of([category], 12, 30, "any", 10), 16)
    other = ShapeBase.of(objects_of([category], 12, 60, "any", 10), 16)
    for row in range(len(other)):
        made, own, K = _composed(base, other, row).trees, other.shapes.trees, len(other.trees[row])
        assert made.valid[0].sum() == K
        assert torch.equal(made.parent[0, :K], own.parent[row, :K])
        assert torch.equal(made.slide[0, :K] != 0, own.slide[row, :K] != 0)
        assert torch.equal(made.turn[0, :K] != 0, own.turn[row, :K] != 0)
        along = (made.axis[0, :K] * own.axis[row, :K]).sum(-1)[1:]
        assert (along >= 0.9 - 1e-6).all()


def test_a_joint_that_no_object_has_is_as_it_is_perceived() -> None:
    base = ShapeBase.of(objects_of(["drawer"], 3, 30), 16)
    hinge = torch.tensor([0.0, 0.0, 0.0, 0.0, 0.6, 0.8, 0.1, 0.0, 0.0])
    joint = torch.stack([torch.zeros(9), hinge])
    center, size = torch.tensor([[0.0, 0.0, 0.0], [-0.2, 0.0, 0.1]]), torch.tensor([[0.5, 0.5, 0.6], [0.02, 0.4, 0.3]])
    made = base.compose(center, size, joint, torch.tensor([0, 0]))[1]
    assert float(made.trees.turn[0, 1]) == 1.0
    torch.testing.assert_close(made.trees.axis[0, 1], hinge[3:6])
    torch.testing.assert_close(made.trees.origin[0, 1], made.box_center[0, 1] + hinge[6:])


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
