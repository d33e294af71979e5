"""References for what is perceived of a cloud."""

from __future__ import annotations

import torch

import artsim
from artperl.data.categories import objects_of
from artperl.perception.network import Perceived
from artperl.perception.part_grouping import PerceivedTree
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.composition import motion
from artperl.retrieval.references import retrieve_references
from artperl.retrieval.shape_base import ShapeBase


def _perceived(base: ShapeBase, row: int) -> Perceived:
    """What a network would say that knows an object of the base."""
    shapes = base.shapes[row : row + 1]
    one = torch.zeros(1, 1)
    return Perceived(
        part_logits=one[..., None], canonical=one[..., None].expand(-1, -1, 3), spread=one, own_logits=one,
        valid_logits=2.0 * shapes.trees.valid.float() - 1.0, box_center=shapes.box_center, box_size=shapes.box_size,
        log_diagonal=one[0],
    )  # fmt: skip


def test_references_have_axes_of_every_lean() -> None:
    glasses = [artsim.make("eyeglasses", seed) for seed in range(16)]
    leaning = [obj for obj in glasses if abs(obj.tree.axes[1, 1]) > 0.01]  # the hinges of some are upright
    base = by_boxes(ShapeBase.of(leaning, 32))
    axis = base.shapes.trees.axis[:, 1]
    leans = torch.sign(axis[:, 1])
    assert set(leans.tolist()) == {-1.0, 1.0}
    assert base.embeddings is not None
    for row in range(len(base)):
        found = retrieve_references(base, _perceived(base, row), 3)
        rows, shapes = found.row, found.shapes
        assert int(rows[0]) == row
        assert base.has_other_axes(row).tolist() == (leans != leans[row]).tolist()
        assert torch.sign(shapes.trees.axis[:2, 1, 1]).tolist() == [leans[row], -leans[row]]
        torch.testing.assert_close(shapes.trees.axis[2, 1], torch.nn.functional.normalize(axis.mean(0), dim=0))
    laptops = by_boxes(ShapeBase.of([artsim.make("laptop", seed) for seed in range(6)], 32))
    assert laptops.embeddings is not None
    nearest = laptops.nearest_objects(laptops.embeddings[:1], 3)[0][0]
    found = retrieve_references(laptops, _perceived(laptops, 0), 3)
    rows, shapes = found.row, found.shapes
    assert torch.equal(rows, nearest)
    assert torch.equal(shapes.points, laptops.shapes.points[nearest])


def test_parts_by_votes_are_looked_for_among_objects_with_their_tree() -> None:
    objects = objects_of(["storage_furniture"], 8, 30, "any", 8)
    base, whole = by_boxes(ShapeBase.of(objects[:-1], 16)), ShapeBase.of(objects, 16)
    for row in (2, 7):
        seen = _perceived(whole, row)
        tree = whole.shapes.trees[row : row + 1]
        joint = whole.joints[row : row + 1]
        groups = PerceivedTree(**vars(seen), joint=joint, parent=tree.parent, way_distance=joint.new_zeros(1, 8, 8, 2))
        found = retrieve_references(base, groups, 3)
        rows, shapes = found.row, found.shapes
        K = len(objects[row])
        assert shapes.trees.valid.sum(1).tolist() == [K] * len(rows)
        assert bool((motion(base.joints[rows[:-1], :K]) == motion(groups.joint[0, :K])).all())
        assert (int(rows[0]) == row) == (row < 7)
