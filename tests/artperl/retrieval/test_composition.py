"""An object composed of the parts of many."""

from __future__ import annotations

import pytest
import torch

from artperl.core.shapes import Shapes
from artperl.data.categories import objects_of
from artperl.retrieval.composition import compose
from artperl.retrieval.shape_base import ShapeBase


def _composed(base: ShapeBase, like: ShapeBase, row: int) -> Shapes:
    """Of a base, what is most like an object of another one."""
    K, shapes = len(like.trees[row]), like.shapes
    asked = shapes.box_center[row, :K], shapes.box_size[row, :K], like.joints[row, :K], shapes.trees.parent[row, :K]
    return compose(base, *asked)[1]


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
    made = compose(base, center, size, joint, torch.tensor([0, 0]))[1]
    assert float(made.trees.turn[0, 1]) == 1.0
    torch.testing.assert_close(made.trees.axis[0, 1], hinge[3:6])
    torch.testing.assert_close(made.trees.origin[0, 1], made.box_center[0, 1] + hinge[6:])
