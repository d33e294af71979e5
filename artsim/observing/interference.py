"""What comes between a camera and a whole, clean cloud: occluders, the border of the image, and masks that are wrong.

A detector's mask misses what something else hides, ends at the border of the image, has bites missing, and takes in
pixels of the table, a wall or a neighbour. :func:`interfere` makes such a cloud of a clean one. Every point is still
measured along a ray of the same camera: foreign points lie on rays that pass beside the object.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from artsim.errors import ConfigError
from artsim.model.kinematics import Array
from artsim.observing.sample import Sample

FOREIGN = 255
"""Part of a point that is not of the object; no object has so many parts."""

_BITE = (0.15, 0.85)
"""Quantiles of the object's points in the image between which the middle of a covered spot lies."""
_RING = (0.01, 0.12)
"""How far beside the object foreign points lie in the image, over the object's extent there."""
_BESIDE = 2.0
"""A ray nearer to a point of the object than that, over the distance of its neighbours in the image, may meet it."""
_NEIGHBOURS = 4
_PROBED = 512
"""Points that tell how far apart neighbours are."""
_REACH = 3.0
"""Farthest that a foreign point lies from the object's middle, in diagonals: detectors do not take in the horizon."""
_TRIES = 6
"""Rays drawn for every foreign point."""


def interfere(
    sample: Sample, rng: np.random.Generator, hidden: float = 0.0, outlier_share: float = 0.0, spot: bool = False
) -> Sample:
    """The sample with points hidden, and with points of other things in its mask.

    Only the cloud changes: ``points``, ``part`` and ``npcs``. Images and ``visible_fraction`` stay those of the view.

    Parameters
    ----------
    sample : Sample
        Of N points.
    rng : numpy.random.Generator
    hidden : float
        Share of the points that are hidden, 0 to 1. Three stay at least.
    outlier_share : float
        Share of the cloud's points, afterwards, that are of the table under the object, a wall behind it, or a
        neighbour beside it, 0 to less than 1.
    spot : bool
        Hide a spot within the object's outline rather than one side of it.

    Returns
    -------
    Sample
        Of ``(1 - hidden) N / (1 - outlier_share)`` points. Foreign ones have part :data:`FOREIGN` and ``npcs`` NaN.

    Raises
    ------
    ConfigError
        When a share is impossible.
    """
    if not 0.0 <= hidden <= 1.0:
        raise ConfigError(f"{hidden} is no share", "hidden", "use 0 to 1")
    if not 0.0 <= outlier_share < 1.0:
        raise ConfigError(f"{outlier_share} is no share", "outlier_share", "use 0 to less than 1")
    image = _in_image(sample.points)
    kept = _visible(image, hidden, spot, rng)
    points, part, npcs = sample.points[kept], sample.part[kept], sample.npcs[kept]
    count = round(len(points) * outlier_share / (1.0 - outlier_share))
    if count:
        other = _foreign_points(sample, image, image[kept], count, rng)
        points = np.concatenate([points, other])
        part = np.concatenate([part, np.full(count, FOREIGN, dtype=part.dtype)])
        npcs = np.concatenate([npcs, np.full((count, 3), np.nan, dtype=npcs.dtype)])
        order = rng.permutation(len(points))
        points, part, npcs = points[order], part[order], npcs[order]
    return replace(sample, points=points, part=part, npcs=npcs)


def _in_image(points: NDArray[np.float32]) -> Array:
    """(N, 2) where points appear in an image of focal length 1."""
    image: Array = points[:, :2].astype(np.float64) / points[:, 2:]
    return image


def _visible(image: Array, hidden: float, spot: bool, rng: np.random.Generator) -> NDArray[np.int64]:
    """Indices of the points that an edge, or a spot, leaves."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    direction = np.array([np.cos(angle), np.sin(angle)])
    if spot:
        middle = np.quantile(image, rng.uniform(*_BITE, 2), axis=0).diagonal()
        across = image - middle
        along = across @ direction
        # An ellipse up to three times as long as it is wide.
        depth = np.hypot(along / rng.uniform(1.0, 3.0), across @ np.array([-direction[1], direction[0]]))
    else:
        depth = image @ direction
    order = np.argsort(depth, kind="stable")
    few = min(3, len(order))
    return np.sort(order[min(round(hidden * len(order)), len(order) - few) :])


def _foreign_points(
    sample: Sample, image: Array, visible: Array, count: int, rng: np.random.Generator
) -> NDArray[np.float32]:
    """(count, 3) points of the surfaces around, on rays beside what is visible (M, 2) of the object, camera frame.

    Where the object is hidden there are none, so that they do not tell how it goes on.
    """
    extent = float(np.ptp(image, axis=0).max())
    from scipy.spatial import cKDTree  # help waits for no scipy

    middle, tree = sample.points.mean(axis=0, dtype=np.float64), cKDTree(image)
    some = image[:: max(1, len(image) // _PROBED)]
    beside = _BESIDE * float(np.quantile(tree.query(some, [_NEIGHBOURS + 1], workers=1)[0], 0.9))
    planes = _surfaces(sample, rng)
    rng.shuffle(planes)
    # Detectors take in one side's surroundings more than others'.
    side = rng.normal(size=2)
    found = np.empty((0, 3))
    near = _REACH * sample.diagonal
    for _ in range(_TRIES):
        start = visible[rng.integers(len(visible), size=8 * count)]
        outward = rng.normal(size=(len(start), 2)) + side
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        ray = start + outward * (extent * rng.uniform(*_RING, len(start)))[:, None]
        ray = ray[tree.query(ray, workers=1)[0] > beside]
        ray = np.concatenate([ray, np.ones((len(ray), 1))], axis=1)
        depth = np.full(len(ray), np.inf)
        for normal, offset in planes:
            with np.errstate(divide="ignore", invalid="ignore"):
                along = offset / (ray @ normal)
            depth = np.where((along > 0.0) & (along < depth), along, depth)
        hit = ray[np.isfinite(depth)] * depth[np.isfinite(depth), None]
        found = np.concatenate([found, hit[np.linalg.norm(hit - middle, axis=1) < near]])
        if len(found) >= count:
            break
    if not len(found):  # the camera sees the object alone, from all too near: what is beside it lies as deep as it does
        found = sample.points[rng.integers(len(image), size=count)] * rng.uniform(1.05, 1.3, (count, 1))
    return found[np.arange(count) % len(found)].astype(np.float32)


def _surfaces(sample: Sample, rng: np.random.Generator) -> list[tuple[Array, float]]:
    """Planes ``normal . p = offset`` in the camera frame that the surroundings lie on; the nearest is seen."""
    corners = np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, 8).T
    boxes = sample.box_center[:, None] + corners * sample.box_size[:, None]
    posed = np.einsum("kij,kcj->kci", sample.T_camera_part[:, :3, :3], boxes) + sample.T_camera_part[:, None, :3, 3]
    posed = posed.reshape(-1, 3)
    up = sample.T_world_camera[2, :3]
    planes = []
    kind = rng.choice(3, p=[0.5, 0.25, 0.25])
    if kind == 0:  # a table: what is beside the object in the image is mostly what it stands on
        planes.append((up, float((posed @ up).min())))
    elif kind == 1:  # a wall behind
        planes.append((np.array([0.0, 0.0, 1.0]), float(posed[:, 2].max() + rng.uniform(0.0, 1.0) * sample.diagonal)))
    else:  # a neighbour: a face at the object's own depth, turned any way that can be seen
        normal = rng.normal(size=3)
        normal[2] = -abs(normal[2]) - 1.0
        normal /= np.linalg.norm(normal)
        place = sample.points[rng.integers(len(sample.points))] + rng.normal(size=3) * 0.1 * sample.diagonal
        planes.append((normal, float(place @ normal)))
        planes.append((up, float((posed @ up).min())))
    return planes
