"""References for what is perceived of one cloud: the nearest objects of the base, or one composed of their parts."""

from dataclasses import replace

import torch
from torch import Tensor

from artperl.core.batch import concatenate
from artperl.core.references import References
from artperl.core.shapes import Shapes
from artperl.perception.network import Perceived
from artperl.perception.part_grouping import PerceivedTree
from artperl.retrieval.box_embedding import box_embedding
from artperl.retrieval.composition import compose, joint_features, motion, same_axes
from artperl.retrieval.shape_base import ShapeBase


def retrieve_references(base: ShapeBase, perceived: Perceived, count: int) -> References:
    """As many of the objects nearest to what is perceived of one cloud, or all if the base has fewer.

    Boxes do not tell how axes lean, and no hinge turns a part to where another one's would: where axes differ, there is
    an object whose axes lean otherwise than those of the nearest, and one with the mean axes. Where parts are found by
    votes, only objects with the same tree will do, and one is composed of the parts of several; its row is that of
    the object that has its root.
    """
    query, count = box_embedding(perceived.valid, perceived.box_center, perceived.box_size), min(count, len(base))
    if isinstance(perceived, PerceivedTree):
        rows, shapes = _references_of_tree(base, perceived, query, count)
    else:
        rows, shapes = _vary_axes(base, query, base.nearest_objects(query, count)[0][0])
    return References(shapes, rows, {row: base.axis_prior(row) for row in rows.tolist()})


def _vary_axes(base: ShapeBase, query: Tensor, rows: Tensor) -> tuple[Tensor, Shapes]:
    """References whose axes differ, if those of their kind do: the last but the first are for those that lean."""
    otherwise, shapes = base.has_other_axes(int(rows[0])), base.shapes[rows]
    if len(rows) < 3 or not bool(otherwise.any()):
        return rows, shapes
    rows = torch.cat([rows[:1], base.nearest_objects(query, 1, otherwise)[0][0], rows[1:-1]])
    shapes = base.shapes[rows]
    axis = torch.cat([shapes.trees.axis[:-1], base.mean_axis[rows[-1:]]])
    return rows, replace(shapes, trees=replace(shapes.trees, axis=axis))


def _references_of_tree(base: ShapeBase, perceived: PerceivedTree, query: Tensor, count: int) -> tuple[Tensor, Shapes]:
    """Up to so many objects with the perceived tree, and one that is composed."""
    trees, K = base.shapes.trees, int(perceived.valid[0].sum())
    tree = (trees.valid == perceived.valid[0]) & (trees.parent == perceived.parent[0])
    joint = (motion(base.joints) == motion(perceived.joint[0])) & same_axes(base.joints, perceived.joint)
    alike = (tree & joint).all(1)
    further = torch.linalg.vector_norm(joint_features(base.joints) - joint_features(perceived.joint), dim=(1, 2))
    part = perceived.box_center[0, :K], perceived.box_size[0, :K], perceived.joint[0, :K], perceived.parent[0, :K]
    row, own = compose(base, *part)
    rows = torch.tensor([row], device=query.device)
    if not bool(alike.any()):
        return rows, own
    near = base.nearest_objects(query, min(count, int(alike.sum())), alike, further[None])[0][0]
    found, shapes = _vary_axes(base, query, near)
    return torch.cat([found, rows]), concatenate([shapes, own])
