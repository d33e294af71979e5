"""Stretched objects to learn from: what is between the edges of two parts becomes wider or narrower.

Families make rows of equal drawers more often than not, and a network that has learnt so cuts a row into equal shares
whatever the points say. Stretching along an axis leaves a sample true where no joint minds it: where hinges turn about
that axis, and slides do not run along it.
"""

from dataclasses import replace

import numpy as np
from scipy.spatial import cKDTree

from artsim.model.kinematics import Array
from artsim.model.stretching import APART, SIDEWAYS, draw_axis_map, stretchable_axes
from artsim.observing.sample import Sample

_NEIGHBOURS = 12
"""Of a point in the image, which tell how much its place has grown."""
_MOST_GROWTH = 4.0
"""Of a place in the image: what comes apart at a depth edge says nothing."""


def stretch(sample: Sample, num_points: int, rng: np.random.Generator) -> Sample:
    """The sample as if its object had been stretched along those axes of the rest frame that its joints do not mind.

    Each range between the edges of parts' boxes gets a factor of its own, and the object stays as long as it is. What
    is the same from its left and its right stays so: where a shut drawer ends is often told by the one at the other
    end. Only what training needs is stretched: points, ``npcs`` and boxes. What the camera would have seen behind the
    stretched object is not looked up anew, nor are images.

    Parameters
    ----------
    sample : Sample
        With at least as many points as are wanted.
    num_points : int
        Points that are kept, the more the more their place has grown in the camera's view: how dense a cloud is must
        not tell how it was stretched.
    rng : numpy.random.Generator
    """
    low, high = sample.box_center - 0.5 * sample.box_size, sample.box_center + 0.5 * sample.box_size
    rest = sample.rest_points
    moved = rest.copy()
    for axis in stretchable(sample):
        edges = np.concatenate([low[:, axis], high[:, axis]])
        along = draw_axis_map(edges, APART * sample.diagonal, axis == SIDEWAYS, rng)
        for values in (low, high, moved):
            values[:, axis] = along(values[:, axis])
    center, whole = 0.5 * (low + high), high - low
    shift = np.einsum("nij,nj->ni", sample.T_camera_part[sample.part, :3, :3], moved - rest)
    points = sample.points + shift
    growth = _spread_of_neighbours(sample.points.astype(np.float64), points)
    kept = rng.choice(len(points), num_points, replace=False, p=growth / growth.sum())
    part = sample.part[kept]
    npcs = (moved[kept] - center[part]) / np.linalg.norm(whole, axis=1)[part, None] + 0.5
    return replace(
        sample, points=points[kept].astype(np.float32), part=part, npcs=npcs.astype(np.float32), box_center=center,
        box_size=whole,
    )  # fmt: skip


def stretchable(sample: Sample) -> list[int]:
    """Axes of the rest frame along which stretching commutes with every joint."""
    return stretchable_axes(sample.joint_axis, sample.joint_type)


def _spread_of_neighbours(before: Array, after: Array) -> Array:
    """(N,) how much more of the image the neighbours of each point cover after it has been moved."""
    near = cKDTree(before[:, :2] / before[:, 2:]).query(before[:, :2] / before[:, 2:], _NEIGHBOURS, workers=1)[1]

    def area(points: Array) -> Array:
        image = (points[:, :2] / points[:, 2:])[near]
        offset = image - image.mean(axis=1, keepdims=True)
        return np.sqrt(np.linalg.det(np.einsum("nki,nkj->nij", offset, offset)).clip(1e-18))

    return np.clip(area(after) / area(before), 1.0 / _MOST_GROWTH, _MOST_GROWTH)
