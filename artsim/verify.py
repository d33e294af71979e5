"""Checks of a dataset on disk: files, checksums and what must hold of every sample's ground truth."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from tqdm import tqdm

from artsim.camera import Camera
from artsim.dataset import Dataset, file_sha256
from artsim.errors import ArtsimError
from artsim.kinematics import invert_transform, transform_points
from artsim.objects import ArticulatedObject
from artsim.sample import Sample

_TOLERANCE = 1e-4
"""Of the object's diagonal: points are stored in single precision."""


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong, and where."""

    where: str
    what: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}"


def verify(folder: str | Path, progress: bool = True) -> list[Problem]:
    """Check every shard and sample of a dataset.

    Parameters
    ----------
    folder : path
    progress : bool
        Show a progress bar.

    Returns
    -------
    list of Problem
        Empty for a sound dataset.

    Raises
    ------
    DatasetError
        When the folder holds no complete dataset.
    """
    dataset = Dataset(folder)
    problems = []
    ranges = {shard.name: range(shard.first, shard.end) for shard in dataset.shards}
    planned = [(s.name, s.split, s.first, s.end) for s in dataset.plan.shards()]
    if [(s.name, s.split, s.first, s.end) for s in dataset.shards] != planned:
        problems.append(Problem("dataset.json", "its shards are not those of its plan"))
    position = 0
    with tqdm(total=len(dataset), desc="verify", unit="sample", disable=not progress) as bar:
        for shard in dataset.shards:
            path = dataset.folder / shard.name
            if not path.is_file():
                problems.append(Problem(shard.name, "is missing"))
            elif file_sha256(path) != shard.sha256:
                problems.append(Problem(shard.name, "has another checksum than when it was written"))
            for i, index in enumerate(ranges[shard.name]):
                where = f"{shard.name}: sample {index}"
                try:
                    sample = dataset[position + i]
                    problems += [Problem(where, what) for what in sample_problems(sample, dataset.object_of(sample))]
                    if sample.index != index:
                        problems.append(Problem(where, f"calls itself {sample.index}"))
                except ArtsimError as error:
                    problems.append(Problem(where, str(error)))
                bar.update()
            position += len(ranges[shard.name])
    return problems


def sample_problems(sample: Sample, obj: ArticulatedObject) -> Iterator[str]:
    """What does not hold of a sample, in words.

    Parameters
    ----------
    sample : Sample
    obj : ArticulatedObject
        The object it shows, at its scale.
    """
    tolerance = _TOLERANCE * sample.diagonal
    num_parts = len(obj)
    if sample.object_sha256 != obj.sha256 or len(sample.joint_type) != num_parts:
        yield "shows another object than the plan says"
        return
    if not len(sample.points) == len(sample.part) == len(sample.npcs):
        yield "points, part and npcs differ in length"
        return
    if not (np.isfinite(sample.points).all() and np.isfinite(sample.npcs).all()):
        yield "a point is not finite"
    if sample.part.max(initial=0) >= num_parts:
        yield f"a point belongs to part {sample.part.max()} of {num_parts}"
        return
    rotations = sample.T_camera_part[:, :3, :3]
    if (
        np.abs(rotations @ np.swapaxes(rotations, 1, 2) - np.eye(3)).max() > 1e-9
        or (np.linalg.det(rotations) < 0).any()
    ):
        yield "a rotation is not a rotation"
    T_camera_rest = sample.T_camera_part[0]
    posed = T_camera_rest @ obj.tree.forward_kinematics(sample.joint_state)
    if np.abs(posed - sample.T_camera_part).max() > max(1e-9, 1e-9 * sample.diagonal):
        yield "part poses do not follow from the joint states"
    axis, origin = obj.tree.posed_joints(sample.T_camera_part)
    if np.abs(axis - sample.joint_axis_camera).max() > 1e-9 or np.abs(origin - sample.joint_origin_camera).max() > 1e-9:
        yield "posed joint axes do not follow from the part poses"
    low, high = sample.joint_limits.T
    if (sample.joint_state < low - 1e-9).any() or (sample.joint_state > high + 1e-9).any():
        driven = [k for k, joint in enumerate(obj.tree.joints) if joint.mimic is not None]
        outside = (sample.joint_state < low - 1e-9) | (sample.joint_state > high + 1e-9)
        outside[driven] = False  # a mimic joint goes where its source takes it
        if outside.any():
            yield f"joint states of parts {np.flatnonzero(outside).tolist()} are outside their limits"
    if not np.allclose(sample.box_center, obj.box_center) or not np.allclose(sample.box_size, obj.box_size):
        yield "boxes are not those of the object"
    if (sample.visible_fraction < 0).any() or (sample.visible_fraction > 1).any():
        yield "a visible fraction is not within 0..1"
    yield from _cloud_problems(sample, tolerance)


def _cloud_problems(sample: Sample, tolerance: float) -> Iterator[str]:
    T_part_camera = invert_transform(sample.T_camera_part)
    for k in np.unique(sample.part):
        mine = sample.part == k
        p_rest = transform_points(T_part_camera[k], sample.points[mine].astype(np.float64))
        offset = np.abs(p_rest - sample.box_center[k]) - 0.5 * sample.box_size[k]
        if offset.max() > tolerance:
            yield f"points of part {k} lie {offset.max():.2g} m outside its box"
        size = np.linalg.norm(sample.box_size[k])
        if (
            np.abs((p_rest - sample.box_center[k]) / size + 0.5 - sample.npcs[mine]).max()
            > _TOLERANCE * sample.diagonal / size + 1e-6
        ):
            yield f"npcs of part {k} do not follow from its points"
        if sample.visible_fraction[k] == 0:
            yield f"part {k} has points but a visible fraction of 0"
    camera = Camera(sample.K, sample.width, sample.height, sample.T_world_camera)
    image = camera.project(sample.points)
    # Rays start at pixel centres; single precision moves them by far less than this.
    if np.abs(image - np.floor(image) - 0.5).max() > 0.05:
        yield "a point does not project onto the centre of a pixel"
    pixel = np.floor(image).astype(int)
    if (pixel < 0).any() or (pixel >= (sample.width, sample.height)).any():
        yield "a point projects outside the image"
        return
    if sample.depth is not None:
        seen = sample.depth[pixel[:, 1], pixel[:, 0]]
        if np.abs(seen - sample.points[:, 2]).max() > tolerance:
            yield "points do not agree with the depth image"
    if sample.part_mask is not None and (sample.part_mask[pixel[:, 1], pixel[:, 0]] != sample.part).any():
        yield "points do not agree with the part mask"
