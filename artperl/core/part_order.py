"""The order of an object's parts, which is what a network learns to name them by.

Families and files number drawers and doors in whatever order they were made in. An estimator for any parts cannot
guess that; where a part is can be seen.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from artsim.model.details import numbered
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample


def in_reading_order(parts: Sequence[int], center: Array, size: Array) -> list[int]:
    """Parts row by row, from the top (+z) down, each row from -y to +y.

    Parameters
    ----------
    parts : sequence of int
    center, size : (K, 3) float
        Boxes in the rest frame. What is lower than the first of a row by half a height is in the next one.
    """
    rows: list[list[int]] = []
    for k in sorted(parts, key=lambda part: -float(center[part, 2])):
        if rows and center[rows[-1][0], 2] - center[k, 2] <= 0.5 * min(size[k, 2], size[rows[-1][0], 2]):
            rows[-1].append(k)
        else:
            rows.append([k])
    return [k for row in rows for k in sorted(row, key=lambda part: float(center[part, 1]))]


def visible_order(parents: NDArray[np.int64], center: Array, size: Array) -> list[int]:
    """All parts, level by level from the root down, those of one parent in reading order."""
    order = [0]
    for parent in order:  # grows as it goes
        order += in_reading_order([k for k, own in enumerate(parents) if own == parent], center, size)
    return order


def reorder_parts(obj: ArticulatedObject, order: Sequence[int]) -> ArticulatedObject:
    """The same object with its parts, parents before children, in another order."""
    number = {k: n for n, k in enumerate(order)}
    joints = []
    for k in order:
        joint = obj.native_tree.joints[k]
        mimic = None if joint.mimic is None else replace(joint.mimic, source=number[joint.mimic.source])
        joints.append(replace(joint, parent=number.get(joint.parent, -1), mimic=mimic))
    return replace(
        obj, parts=tuple(obj.parts[k] for k in order), native_tree=KinematicTree(joints),
        source_joints={name: (number[k], factor) for name, (k, factor) in obj.source_joints.items()},
    )  # fmt: skip


def reorder_sample(sample: Sample, order: Sequence[int]) -> Sample:
    """The same sample with its parts in another order."""
    rows, number = np.asarray(order), np.argsort(order)
    per_part = (
        "T_camera_part", "box_center", "box_size", "visible_fraction", "joint_axis", "joint_origin",
        "joint_axis_camera", "joint_origin_camera", "joint_state", "joint_rest", "joint_limits",
    )  # fmt: skip
    parents = sample.joint_parent[rows]
    mask = sample.part_mask
    if mask is not None:
        mask = np.append(number, np.full(256 - len(number), 255))[mask].astype(np.uint8)
    turn = sorted(range(len(sample.details)), key=lambda d: number[sample.details[d].part])
    details = numbered(replace(sample.details[d], part=int(number[sample.details[d].part])) for d in turn)
    on = sample.detail
    if on is not None:
        on = np.append(np.argsort(turn), np.full(256 - len(turn), 255))[on].astype(np.uint8)
    return replace(
        sample, part=number[sample.part].astype(np.uint8), part_mask=mask, details=details, detail=on,
        joint_parent=np.where(parents < 0, -1, number[parents]),
        joint_type=tuple(sample.joint_type[k] for k in order), part_names=tuple(sample.part_names[k] for k in order),
        **{name: getattr(sample, name)[rows] for name in per_part},
    )  # fmt: skip


def sort_parts(obj: ArticulatedObject) -> ArticulatedObject:
    """The object with its parts in :func:`visible_order`."""
    return reorder_parts(obj, visible_order(obj.tree.parents, obj.box_center, obj.box_size))
