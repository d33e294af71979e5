"""An object composed of parts of many: no base holds every mix of doors and drawers."""

from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from artperl.core.shapes import Shapes
from artperl.core.trees import Trees
from artperl.retrieval.shape_base import ShapeBase
from artsim.model.joints import Joint
from artsim.model.kinematics import KinematicTree

_PIVOT = 2.0
"""What a difference of one diagonal in the place of an axis counts for against one of 1 in its direction."""
_ALONG = 0.9
"""Cosine from which an axis is taken for another one, at least as it is perceived."""
_LIKE = 0.3
"""Differences of directions, and of places over the part's sides, up to which joints are of one sort."""
_SURE = 0.3
"""Length of a mean of votes for unit vectors, below which they do not agree."""


def compose(base: ShapeBase, center: Tensor, size: Tensor, joint: Tensor, parent: Tensor) -> tuple[int, Shapes]:
    """An object whose parts and joints are those of any objects that are most like the ones asked for.

    No base holds every mix of doors and drawers, but a few objects have a door and a drawer of every kind. A part
    is that with the box most like the one asked for, and moves as that part does whose joint is most like it.

    Parameters
    ----------
    base : ShapeBase
    center, size : (K, 3) float
        Boxes of the parts, in diagonals, the root's first.
    joint : (K, 9) float
        Their joints, as :attr:`ShapeBase.joints` has them.
    parent : (K,) int64

    Returns
    -------
    int, Shapes
        The object that the root is of; and one row, of K parts.
    """
    trees, P = base.shapes.trees, base.shapes.trees.num_rows
    unit = base.shapes.diagonal[:, None, None]
    boxes = torch.cat([base.shapes.box_center / unit, base.shapes.box_size / unit], dim=-1).flatten(0, 1)
    known = joint_features(base.joints).flatten(0, 1)
    # Roots for the root; for other parts those that move alike, and any where there is none.
    likely = 1 + (motion(base.joints).flatten()[:, None] == motion(joint))
    likely[::P] = 0
    likely[:, 0] = torch.arange(len(likely), device=likely.device) % P == 0
    likely = likely * trees.valid.flatten()[:, None]
    possible = likely == likely.amax(0)
    shape = torch.cdist(boxes, torch.cat([center, size], dim=-1)).masked_fill(~possible, torch.inf).argmin(0)
    mover = torch.cdist(known, joint_features(joint)).masked_fill(~possible, torch.inf).argmin(0)
    rows, parts = shape // P, shape % P
    root = int(rows[0])
    joints = [base.trees[root].joints[0]]
    for n in range(1, len(center)):
        b, k = divmod(int(mover[n]), P)
        place, side = base.shapes.box_center[rows[n], parts[n]], base.shapes.box_size[rows[n], parts[n]]
        joints.append(_joint_like(base, b, k, place, side, joint[n], int(parent[n]), f"{n}"))
    chosen = base.shapes[root : root + 1]
    fields = {}
    for name in ("box_center", "box_size", "points", "normals", "spacing"):
        values = getattr(base.shapes, name)
        fields[name] = torch.full_like(values[:1], torch.inf if name == "spacing" else 0.0)
        fields[name][0, : len(joints)] = values[rows, parts]
    tree = Trees.stack([KinematicTree(joints)], P, size.dtype).to(size.device)
    return root, replace(chosen, trees=tree, **fields)


def _joint_like(
    base: ShapeBase, row: int, part: int, center: Tensor, side: Tensor, perceived: Tensor, parent: int, name: str
) -> Joint:
    """A joint like that of a part, at the same place of another box; as it is perceived if that differs."""
    own, trees = base.joints[row, part], base.shapes.trees
    pattern = replace(base.trees[row].joints[part], parent=parent, name=name, mimic=None)
    if not bool(same_axes(own, perceived)):
        slides = int(motion(perceived)) == 1
        axis = torch.nn.functional.normalize(perceived[:3] if slides else perceived[3:6], dim=0)
        far = 1.0 if slides else np.pi
        return replace(
            pattern, type="prismatic" if slides else "revolute", axis=_tuple(axis),
            origin=_tuple(center + perceived[6:]), lower=-far, upper=far, rest=0.0,
        )  # fmt: skip
    place = base.joints[..., 6:] / base.shapes.box_size.clamp(min=1e-6)
    like = trees.kind == trees.kind[row, part]
    like &= torch.linalg.vector_norm(base.joints[..., :6] - own[:6], dim=-1) < _LIKE
    like &= torch.linalg.vector_norm(place - place[row, part], dim=-1) < _LIKE
    return replace(
        pattern, origin=_tuple(center + place[row, part] * side), lower=float(trees.lower[like].amin()),
        upper=float(trees.upper[like].amax()),
    )  # fmt: skip


def motion(joint: Tensor) -> Tensor:
    """(...) int64 of joints (..., 9): 0 where nothing moves, 1 for slides, 2 where a part turns."""
    slides, turns = (torch.linalg.vector_norm(axis, dim=-1) for axis in (joint[..., :3], joint[..., 3:6]))
    return torch.where(turns > slides, 2, torch.where(slides > 0.0, 1, 0))


def same_axes(joint: Tensor, perceived: Tensor) -> Tensor:
    """(...) bool: whether joints (..., 9) of objects have the perceived axes, as far as these are sure."""
    along = (joint[..., :6] * perceived[..., :6]).sum(-1)
    length = torch.linalg.vector_norm(perceived[..., :6], dim=-1)
    return (along >= _ALONG * length) | (length < _SURE)


def joint_features(joint: Tensor) -> Tensor:
    """Joints (..., 9) whose Euclidean distance counts against that of boxes."""
    return torch.cat([joint[..., :6], _PIVOT * joint[..., 6:]], dim=-1)


def _tuple(values: Tensor) -> tuple[float, float, float]:
    x, y, z = values.double().tolist()
    return x, y, z
