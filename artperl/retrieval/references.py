"""References for what is perceived of one cloud: the nearest objects of the base, or one composed of their parts."""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from artperl.core.batch import concatenate
from artperl.core.shapes import Shapes
from artperl.perception.network import Perceived
from artperl.perception.part_grouping import Grouped
from artperl.retrieval.box_embedding import box_embedding
from artperl.retrieval.shape_base import ShapeBase, moves, same_axes, weighed


def references(base: ShapeBase, perceived: Perceived, count: int) -> tuple[Tensor, Shapes]:
    """(count,) rows of the objects nearest to what is perceived of one cloud, and their shapes.

    Boxes do not tell how axes lean, and no hinge turns a part to where another one's would: where axes differ, there is
    an object whose axes lean otherwise than those of the nearest, and one with the mean axes. Where parts are found by
    votes, only objects with the same tree will do, and one is composed of the parts of several; its row is that of
    the object that has its root.
    """
    query = box_embedding(perceived.valid, perceived.box_center, perceived.box_size)
    if isinstance(perceived, Grouped):
        return _references_of_groups(base, perceived, query, count)
    return _leaning(base, query, base.nearest(query, count)[0][0])


def _leaning(base: ShapeBase, query: Tensor, rows: Tensor) -> tuple[Tensor, Shapes]:
    """References whose axes differ, if those of their kind do: the last but the first are for those that lean."""
    otherwise, shapes = base.leaning_otherwise(int(rows[0])), base.shapes[rows]
    if len(rows) < 3 or not bool(otherwise.any()):
        return rows, shapes
    rows = torch.cat([rows[:1], base.nearest(query, 1, otherwise)[0][0], rows[1:-1]])
    shapes = base.shapes[rows]
    axis = torch.cat([shapes.trees.axis[:-1], base.mean_axis[rows[-1:]]])
    return rows, replace(shapes, trees=replace(shapes.trees, axis=axis))


def _references_of_groups(base: ShapeBase, perceived: Grouped, query: Tensor, count: int) -> tuple[Tensor, Shapes]:
    """Up to so many objects with the perceived tree, and one that is composed."""
    trees, K = base.shapes.trees, int(perceived.valid[0].sum())
    tree = (trees.valid == perceived.valid[0]) & (trees.parent == perceived.parent[0])
    joint = (moves(base.joints) == moves(perceived.joint[0])) & same_axes(base.joints, perceived.joint)
    alike = (tree & joint).all(1)
    further = torch.linalg.vector_norm(weighed(base.joints) - weighed(perceived.joint), dim=(1, 2))
    part = perceived.box_center[0, :K], perceived.box_size[0, :K], perceived.joint[0, :K], perceived.parent[0, :K]
    row, own = base.composed(*part)
    rows = torch.tensor([row], device=query.device)
    if not bool(alike.any()):
        return rows, own
    found, shapes = _leaning(base, query, base.nearest(query, min(count, int(alike.sum())), alike, further[None])[0][0])
    return torch.cat([found, rows]), concatenate([shapes, own])
