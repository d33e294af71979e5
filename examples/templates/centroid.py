"""A baseline: the mean reference at the centroid of the cloud."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

import artsim
from artperl.core.estimate import Estimate


class Centroid:
    """An object of the category at rest, where the cloud is."""

    name: ClassVar[str] = "centroid"

    def __init__(self, category: str):
        self.categories = (category,)
        self.reference = artsim.make(category, 2_000_000)

    @classmethod
    def of_category(cls, category: str) -> Centroid:
        """The baseline for a category."""
        return cls(category)

    def __call__(self, points: ArrayLike) -> Estimate:
        """Estimate the pose of every part; see :class:`artperl.methods.protocol.Method`."""
        cloud, reference = np.asarray(points, dtype=np.float64), self.reference
        K, tree = len(reference), reference.tree
        boxes = np.stack([[part.vertices.min(axis=0), part.vertices.max(axis=0)] for part in reference.parts])
        T = np.tile(np.eye(4), (K, 1, 1))
        T[:, :3, 3] = cloud.mean(axis=0)
        return Estimate(
            rotation=T[:, :3, :3], translation=T[:, :3, 3] + boxes.mean(axis=1), size=boxes[:, 1] - boxes[:, 0],
            T_camera_part=T, state=np.zeros(K), joint_type=tree.types, joint_parent=np.array(tree.parents),
            joint_axis=tree.axes, joint_origin=tree.origins + T[0, :3, 3], part=np.zeros(len(cloud), dtype=np.int64),
            visibility=np.ones(K), trajectory=T[None], joint_limits=np.zeros((K, 2)),
        )  # fmt: skip
