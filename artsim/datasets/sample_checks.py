"""What must hold of a sample, checked against its object and against itself."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.model.camera import Camera
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import invert_transform
from artsim.observing.sample import Sample
from artsim.renderers.raycast import cast, pose

_TOLERANCE = 1e-4
"""Of the object's diagonal: points are stored in single precision."""
_STRAY_RAYS = 0.005
"""Share of rays that may end elsewhere on another processor: those that graze an edge."""


def sample_problems(sample: Sample, obj: ArticulatedObject) -> Iterator[str]:
    """What does not hold of a sample, in words.

    Parameters
    ----------
    sample : Sample
    obj : ArticulatedObject
        The object it shows, at its scale.
    """
    if sample.object_sha256 != obj.sha256 or len(sample.joint_type) != len(obj):
        yield "shows another object than the plan says"
        return
    malformed = list(_form_problems(sample, len(obj)))
    yield from malformed
    if malformed:
        return
    yield from _copy_problems(sample, obj)
    yield from _pose_problems(sample, obj)
    if (sample.visible_fraction < 0).any() or (sample.visible_fraction > 1).any():
        yield "a visible fraction is not within 0..1"
    if sample.part.max() >= len(obj):
        yield f"a point belongs to part {sample.part.max()} of {len(obj)}"
        return
    true_points = _true_points(sample)
    yield from _cloud_problems(sample, true_points)
    yield from _image_problems(sample, obj, true_points)


def _form_problems(sample: Sample, num_parts: int) -> Iterator[str]:
    """Arrays of another shape or type than they should have, and numbers that are none."""
    points, K, image = sample.part.size, num_parts, (sample.height, sample.width)
    shapes: dict[str, tuple[type, tuple[int, ...]]] = {
        "points": (np.float32, (points, 3)), "part": (np.uint8, (points,)), "npcs": (np.float32, (points, 3)),
        "T_camera_part": (np.float64, (K, 4, 4)), "box_center": (np.float64, (K, 3)), "box_size": (np.float64, (K, 3)),
        "visible_fraction": (np.float64, (K,)), "joint_parent": (np.int64, (K,)),
        "joint_axis": (np.float64, (K, 3)), "joint_origin": (np.float64, (K, 3)),
        "joint_axis_camera": (np.float64, (K, 3)), "joint_origin_camera": (np.float64, (K, 3)),
        "joint_state": (np.float64, (K,)), "joint_rest": (np.float64, (K,)), "joint_limits": (np.float64, (K, 2)),
        "K": (np.float64, (3, 3)), "T_world_camera": (np.float64, (4, 4)),
        "depth": (np.float32, image), "part_mask": (np.uint8, image), "rgb": (np.uint8, (*image, 3)),
        "detail": (np.uint8, (points,)),
    }  # fmt: skip
    if points == 0:
        yield "has no points"
    for name, (dtype, shape) in shapes.items():
        array: Any = getattr(sample, name)
        if array is None:
            continue  # an image that was not asked for
        if array.dtype != dtype or array.shape != shape:
            yield f"{name} is {array.dtype} {array.shape} instead of {np.dtype(dtype)} {shape}"
        elif name != "joint_limits" and not np.isfinite(array).all():
            yield f"{name} is not finite"


def close(one: ArrayLike, two: ArrayLike, tolerance: float) -> bool:
    """Whether two arrays are equal within a tolerance, infinite limits included; a fifth of the time of np.allclose."""
    one, two = np.asarray(one), np.asarray(two)
    same = one == two
    if same.all():
        return True
    with np.errstate(invalid="ignore"):  # infinity less infinity
        return bool(((np.abs(one - two) <= tolerance) | same).all())


def _copy_problems(sample: Sample, obj: ArticulatedObject) -> Iterator[str]:
    """What the sample copies from its object."""
    tree, length = obj.tree, 1e-9 * max(1.0, obj.diagonal)
    if (sample.category, sample.object_id) != (obj.category, obj.object_id):
        yield "category or object_id are not those of the object"
    if sample.part_names != tuple(p.label for p in obj.parts):
        yield "part names are not those of the object"
    if [(d.name, d.label, d.part) for d in sample.details] != [(d.name, d.label, d.part) for d in obj.details] or any(
        not close(one.T_rest_detail, two.T_rest_detail, length)
        for one, two in zip(sample.details, obj.details, strict=True)
    ):
        yield "details are not those of the object"
    if not close(sample.diagonal, obj.diagonal, length):
        yield "the diagonal is not that of the object"
    if not (close(sample.box_center, obj.box_center, length) and close(sample.box_size, obj.box_size, length)):
        yield "boxes are not those of the object"
    if not (
        sample.joint_type == tree.types
        and np.array_equal(sample.joint_parent, tree.parents)
        and close(sample.joint_axis, tree.axes, 1e-9)
        and close(sample.joint_origin, tree.origins, length)
        and close(sample.joint_rest, tree.rest, length)
        and close(sample.joint_limits, tree.limits, length)
    ):
        yield "joints are not those of the object"


def _pose_problems(sample: Sample, obj: ArticulatedObject) -> Iterator[str]:
    tree, T, length = obj.tree, sample.T_camera_part, 1e-9 * max(1.0, obj.diagonal)
    rotation = T[:, :3, :3]
    if (
        not close(rotation @ np.swapaxes(rotation, 1, 2), np.eye(3), 1e-9)
        or (np.linalg.det(rotation) < 0).any()
        or (T[:, 3] != (0, 0, 0, 1)).any()
    ):
        yield "a rotation is not a rotation"
    if not close(T[0] @ tree.forward_kinematics(sample.joint_state), T, length):
        yield "part poses do not follow from the joint states"
    axis, origin = tree.posed_joints(T)
    if not (close(axis, sample.joint_axis_camera, 1e-9) and close(origin, sample.joint_origin_camera, length)):
        yield "posed joint axes do not follow from the part poses"
    if not close(sample.joint_state, tree.complete_state(sample.joint_state), 1e-9):
        yield "mimic joints do not follow their sources"
    low, high = tree.limits.T
    outside = (sample.joint_state < low - 1e-9) | (sample.joint_state > high + 1e-9)
    outside[[joint.mimic is not None for joint in tree.joints]] = False  # it goes where its source takes it
    if outside.any():
        yield f"joint states of parts {np.flatnonzero(outside).tolist()} are outside their limits"


def _part_slices(sample: Sample) -> tuple[NDArray[np.int64], list[tuple[int, slice]]]:
    """An order of the points in which those of a part stand together, and where in it each part that is seen stands."""
    counts = np.bincount(sample.part)
    ends = zip(counts.tolist(), np.cumsum(counts).tolist(), strict=True)
    return np.argsort(sample.part, kind="stable"), [(k, slice(end - n, end)) for k, (n, end) in enumerate(ends) if n]


def _true_points(sample: Sample) -> Array:
    """(3, N) places that the rays truly meet, camera frame: with noise, the points need not lie there."""
    if sample.noise == "none":
        return np.ascontiguousarray(sample.points.T, dtype=np.float64)
    points = np.empty((3, len(sample.points)))
    order, parts = _part_slices(sample)
    for k, mine in parts:
        T, length = sample.T_camera_part[k], np.linalg.norm(sample.box_size[k])
        p_rest = (sample.npcs[order[mine]] - 0.5) * length + sample.box_center[k]
        points[:, order[mine]] = T[:3, :3] @ p_rest.T + T[:3, 3:]
    return points


def _cloud_problems(sample: Sample, true_points: Array) -> Iterator[str]:
    tolerance = _TOLERANCE * sample.diagonal
    T_part_camera = invert_transform(sample.T_camera_part)
    order, parts = _part_slices(sample)
    p_camera, npcs = true_points[:, order], sample.npcs.T[:, order]
    for k, mine in parts:
        size = max(float(np.linalg.norm(sample.box_size[k])), 1e-12)
        p_box = T_part_camera[k, :3, :3] @ p_camera[:, mine] + (T_part_camera[k, :3, 3] - sample.box_center[k])[:, None]
        outside = (np.abs(p_box).max(axis=1) - 0.5 * sample.box_size[k]).max()
        if outside > tolerance:
            yield f"points of part {k} lie {outside:.2g} m outside its box"
        if not close(p_box / size + 0.5, npcs[:, mine], tolerance / size + 1e-6):
            yield f"npcs of part {k} do not follow from its points"
        if sample.visible_fraction[k] == 0:
            yield f"part {k} has points but a visible fraction of 0"


def _image_problems(sample: Sample, obj: ArticulatedObject, true_points: Array) -> Iterator[str]:
    """Points against the camera, the images, and rays cast anew."""
    tolerance = _TOLERANCE * sample.diagonal
    if (sample.points[:, 2] <= 0).any() or (true_points[2] <= 0).any():
        yield "a point lies behind the camera"
        return
    points = true_points if sample.noise == "none" else sample.points.T.astype(np.float64)
    image = _projected(sample.K, points)
    pixel = np.floor(image)
    # Rays start at pixel centres; single precision moves them by far less than this.
    if np.abs(image - pixel - 0.5).max() > 0.05:
        yield "a point does not project onto the centre of a pixel"
    if points is not true_points and not close(_projected(sample.K, true_points), image, 0.1):
        yield "a point does not lie on the ray to the place that its npcs name"
    column, row = pixel.astype(np.int64)
    if min(column.min(), row.min()) < 0 or column.max() >= sample.width or row.max() >= sample.height:
        yield "a point projects outside the image"
        return
    if sample.depth is not None and not close(sample.depth[row, column], sample.points[:, 2], tolerance):
        yield "points do not agree with the depth image"
    if sample.part_mask is not None and (sample.part_mask[row, column] != sample.part).any():
        yield "points do not agree with the part mask"
    if sample.renderer == "raycast":
        T_world_object = sample.T_world_camera @ sample.T_camera_part[0]
        if close(T_world_object, np.eye(4), 1e-9):
            T_world_object = np.eye(4)  # exactly the rays that made the sample
        order = np.argsort(row * sample.width + column)
        camera = Camera(sample.K, sample.width, sample.height, sample.T_world_camera)
        posed = pose(obj, sample.joint_state, camera, T_world_object)
        depth, part, _ = cast(posed, row[order], column[order])
        wrong = (part != sample.part[order]) | (np.abs(depth - true_points[2, order]) > tolerance)
        if wrong.sum() > max(2, _STRAY_RAYS * len(wrong)):
            yield f"{wrong.sum()} points do not lie where a ray through their pixel meets their part"


def _projected(K: Array, points: Array) -> Array:
    """(2, N) column and row of points (3, N) in the camera frame."""
    image: Array = K @ points
    return image[:2] / image[2]
