"""Kinematic trees of any shape as one batch, padded to as many rows for parts as the largest one has."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from artperl.core.batch import Batch
from artsim.errors import KinematicsError
from artsim.model.joints import JOINT_TYPES, ROTATING
from artsim.model.kinematics import KinematicTree

KINDS = (*JOINT_TYPES, "fixed")
"""Kinds of joints by number. Rows that pad a tree are fixed to the root."""


@dataclass(frozen=True, eq=False)
class Trees(Batch):
    """B kinematic trees of at most P parts. Axes and origins are in the rest frame, at rest, in the objects' units."""

    valid: Tensor
    """(B, P) bool. Rows that are parts."""
    kind: Tensor
    """(B, P) int64. Index into ``KINDS``."""
    parent: Tensor
    """(B, P) int64. The root, and rows that pad, name the root."""
    axis: Tensor
    origin: Tensor
    """(B, P, 3) float."""
    lower: Tensor
    upper: Tensor
    rest: Tensor
    """(B, P) float. Radians, or lengths; infinite limits where a joint turns freely."""
    turn: Tensor
    slide: Tensor
    """(B, P) float. Radians about the axis and lengths along it, per unit of state."""
    source: Tensor
    """(B, P) int64."""
    multiplier: Tensor
    offset: Tensor
    """(B, P) float. ``state[k] = multiplier[k] * state[source[k]] + offset[k]``: joints that follow another; others
    name themselves."""
    free: Tensor
    """(B, P) bool. Joints whose state is to be found: not the root, no follower, not fixed."""
    carries: Tensor
    """(B, P, P) bool. ``carries[j, k]``: joint j moves part k. The root's joint is left out, since it moves every
    part."""
    depth: Tensor
    """(B, P) int64. Joints between each part and the root."""

    @property
    def num_rows(self) -> int:
        """P, the number of rows for parts."""
        return self.valid.shape[1]

    @staticmethod
    def stack(trees: Sequence[KinematicTree], num_rows: int | None = None, dtype: torch.dtype = torch.float64) -> Trees:
        """One batch of several trees.

        Parameters
        ----------
        trees : sequence of KinematicTree
        num_rows : int, optional
            Rows for parts; by default as many as the largest tree has parts.
        dtype : torch.dtype
            Of the floating-point fields.

        Raises
        ------
        KinematicsError
            When there is no tree, or one has more parts than rows.
        """
        if not trees:
            raise KinematicsError("a batch of no tree has no shape", fix="pass at least one tree")
        largest = max(len(tree) for tree in trees)
        num_rows = num_rows or largest
        if num_rows < largest:
            raise KinematicsError(f"{largest} parts do not fit {num_rows} rows", "num_rows", f"use at least {largest}")
        rows = [_tree_rows(tree, num_rows) for tree in trees]
        arrays = {name: torch.from_numpy(np.stack([row[name] for row in rows])) for name in rows[0]}
        return Trees(**arrays).to(dtype)


def _tree_rows(tree: KinematicTree, num_rows: int) -> dict[str, np.ndarray]:
    """Fields of :class:`Trees` for one tree, as padded arrays."""
    K = len(tree)
    carries = np.zeros((num_rows, num_rows), dtype=bool)
    for k in range(1, K):
        carries[:, k] = carries[:, tree.parents[k]]
        carries[k, k] = True
    source, multiplier, offset = np.arange(num_rows), np.zeros(num_rows), np.zeros(num_rows)
    multiplier[1:K] = 1.0
    for k in range(1, K):  # a chain of followers becomes one linear function of its last source
        mimic, joint = tree.joints[k].mimic, k
        while mimic is not None:
            offset[k] += multiplier[k] * mimic.offset
            multiplier[k] *= mimic.multiplier
            joint, mimic = mimic.source, tree.joints[mimic.source].mimic
        source[k] = joint
    slide = [{"prismatic": 1.0, "screw": joint.pitch}.get(joint.type, 0.0) for joint in tree.joints]

    def pad(values: object, fill: float = 0.0) -> np.ndarray:
        array = np.asarray(values)
        padded = np.full((num_rows, *array.shape[1:]), fill, dtype=array.dtype)
        padded[:K] = array
        return padded

    axis = pad(tree.axes)
    axis[K:, 2] = 1.0
    return {
        "valid": np.arange(num_rows) < K,
        "kind": pad(np.array([KINDS.index(t) for t in tree.types]), KINDS.index("fixed")),
        "parent": np.maximum(pad(tree.parents), 0),
        "axis": axis,
        "origin": pad(tree.origins),
        "lower": pad(tree.limits[:, 0]),
        "upper": pad(tree.limits[:, 1]),
        "rest": pad(np.where(tree.parents < 0, 0.0, tree.rest)),
        "turn": pad([float(t in ROTATING) for t in tree.types]),
        "slide": pad(slide),
        "source": source,
        "multiplier": multiplier,
        "offset": offset,
        "free": pad(np.isin(np.arange(K), tree.free_joints), False),
        "carries": carries,
        "depth": pad(tree.depths),
    }
