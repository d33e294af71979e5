"""Checks of a dataset on disk: files, checksums and what must hold of every sample's ground truth."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.progress import track
from artsim.datasets.dataset import Dataset
from artsim.datasets.description import DESCRIPTION, read_description, read_started
from artsim.datasets.inventory import examine, leftover_problems, strangers
from artsim.datasets.plan import Plan, ShardRecord
from artsim.datasets.problems import Problem, repair_command
from artsim.datasets.shards import ShardReader, sample_key
from artsim.errors import ArtsimError, DatasetError
from artsim.model.camera import Camera
from artsim.model.draws import Scale
from artsim.model.kinematics import Array, invert_transform
from artsim.model.object_file import load_object
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.renderers.raycast import cast, pose
from artsim.runs.pool import WorkerLost, WorkerPool
from artsim.runs.worker import report

_TOLERANCE = 1e-4
"""Of the object's diagonal: points are stored in single precision."""
_FIX = "generate the dataset again, into another folder: its checksums are right, its content is not"
_WORTH_A_PROCESS = 500
"""Samples that take as long to check as a process takes to start."""
_STRAY_RAYS = 0.005
"""Share of rays that may end elsewhere on another processor: those that graze an edge."""


def verify(folder: str | Path, progress: bool = True, workers: int = 1) -> list[Problem]:
    """Check every file and sample of a dataset. Nothing is written.

    Parameters
    ----------
    folder : path
    progress : bool
        Show progress bars.
    workers : int
        Processes that check samples. A script that asks for several calls this below ``if __name__ == "__main__":``.

    Returns
    -------
    list of Problem
        Empty for a sound dataset.

    Raises
    ------
    DatasetError
        When the folder holds no dataset, or one that is not complete yet.
    """
    folder = Path(folder)
    begun = read_started(folder)
    if begun is None or not (begun.complete or (folder / DESCRIPTION).exists()):
        read_description(folder)  # raises
    assert begun is not None
    inventory = examine(folder, begun, progress=progress)
    problems = [
        *begun.problems,
        *_share_problems(begun.plan),
        *inventory.problems(folder),
        *strangers(folder, begun),
        *leftover_problems(folder, begun),
    ]
    if not begun.complete:
        return problems
    dataset = Dataset(folder)
    unusable = {planned.file for planned in inventory.objects}
    found = list(_object_problems(dataset, unusable))
    problems += found
    unusable |= {problem.where for problem in found}
    with track("verify", total=len(dataset), unit="sample", shown=progress) as bar:
        # Of another shard, nothing more needs to be known: it is to be made again.
        shards = [shard for shard in dataset.shards if shard.name in inventory.kept]
        bar.update(len(dataset) - sum(map(len, shards)))
        workers = min(workers, len(shards), 1 + sum(map(len, shards)) // _WORTH_A_PROCESS)
        if workers > 1:
            return problems + _by_several(folder, shards, unusable, workers, bar.update)
        for shard in shards:
            problems += _shard_problems(dataset, shard, unusable, bar.update)
    return problems


def _by_several(
    folder: Path, shards: Sequence[ShardRecord], unusable: set[str], workers: int, progress: Callable[[int], object]
) -> list[Problem]:
    """What is wrong with shards, in their order, found by several processes."""
    found: dict[str, list[Problem] | WorkerLost] = {}
    with WorkerPool(workers) as team:
        found.update(team.run(_check_shard, ((s.name, (folder, s, unusable)) for s in shards), progress=progress))
    problems = []
    for shard in shards:
        answer = found[shard.name]
        problems += [Problem(shard.name, answer.why, _FIX)] if isinstance(answer, WorkerLost) else answer
    return problems


def _check_shard(folder: Path, shard: ShardRecord, unusable: set[str]) -> list[Problem]:
    """The task of a worker process."""
    return list(_shard_problems(_worker_dataset(folder), shard, unusable, report))


@lru_cache(maxsize=1)
def _worker_dataset(folder: Path) -> Dataset:
    """Read once for all tasks of a process."""
    return Dataset(folder)


def _share_problems(plan: Plan) -> Iterator[Problem]:
    """Files of one content in several splits: what is trained with would be tested with."""
    splits: dict[tuple[str, str], set[str]] = defaultdict(set)
    for planned in plan.objects:
        splits[planned.sha256, planned.source_sha256].add(planned.split)
    for planned in plan.objects:
        if len(splits[planned.sha256, planned.source_sha256]) > 1:
            yield Problem(planned.file, "is in several splits, under different names", _FIX)


def _object_problems(dataset: Dataset, unusable: set[str]) -> Iterator[Problem]:
    """Whether objects are what the plan says, and can be posed."""
    fix = repair_command(dataset.folder)
    for planned in dataset.plan.objects:
        if planned.file in unusable:
            continue
        try:
            obj = load_object(dataset.folder / planned.file)
            named = planned.category, planned.object_id, planned.sha256, planned.num_parts
            if (obj.category, obj.object_id, obj.sha256, len(obj)) != named:
                yield Problem(planned.file, "is another object than the plan says", fix)
            elif obj.is_rigid != planned.rigid:
                yield Problem(planned.file, "moves, or does not, other than the plan says", fix)
            else:
                yield from (Problem(planned.file, what, fix) for what in _object_flaws(obj))
        except ArtsimError as error:
            yield Problem(planned.file, error.what, fix)
        except Exception as error:  # a forged object may hold anything
            yield Problem(planned.file, f"cannot be checked ({type(error).__name__}: {error})", fix)


def _object_flaws(obj: ArticulatedObject) -> Iterator[str]:
    """What no object may be like."""
    tree = obj.tree
    low, high = tree.limits.T
    if not all(np.isfinite(part.vertices).all() for part in obj.parts):
        yield "a vertex is not finite"
    if any(len(p.faces) and not 0 <= p.faces.min() <= p.faces.max() < len(p.vertices) for p in obj.parts):
        yield "a triangle has a corner that does not exist"
    if not np.isfinite([*tree.axes.ravel(), *tree.origins.ravel(), *tree.rest]).all():
        yield "an axis, an origin or a rest state is not finite"
    elif not _close(np.linalg.norm(tree.axes[1:], axis=1), 1.0, 1e-6):
        yield "an axis is not of unit length"
    if (low > high).any():
        yield "a joint's lower limit is above its upper one"
    if not _close(tree.forward_kinematics(tree.rest), np.eye(4), 1e-9):
        yield "its parts are not at rest in its rest state"


def _shard_problems(
    dataset: Dataset, shard: ShardRecord, unusable: set[str], progress: Callable[[int], object]
) -> Iterator[Problem]:
    path, plan = dataset.folder / shard.name, dataset.plan
    try:
        reader = ShardReader(path)
    except DatasetError as error:
        yield Problem(shard.name, error.what, _FIX)
        progress(len(shard))
        return
    indices = plan.indices(shard)
    wanted, have = [sample_key(index) for index in indices], reader.keys()
    if have != wanted:
        lost, foreign = sorted({*wanted} - {*have}), sorted({*have} - {*wanted})
        what = f"lacks samples {lost[:5]}, has unexpected ones {foreign[:5]}, or holds them out of order"
        yield Problem(shard.name, what, _FIX)
    there = set(have)
    for index, key in zip(indices, wanted, strict=True):
        progress(1)
        planned = plan.object_of(index)
        if key not in there or planned.file in unusable:
            continue
        where = f"{shard.name}: sample {index}"
        try:
            sample = reader.read(key)
            obj = dataset.objects[planned.key].scaled(sample.scale)
            yield from (Problem(where, what, _FIX) for what in _plan_problems(sample, plan, index))
            yield from (Problem(where, what, _FIX) for what in sample_problems(sample, obj))
        except ArtsimError as error:
            yield Problem(where, error.what, _FIX)
        except Exception as error:  # a forged record may hold anything
            yield Problem(where, f"cannot be checked ({type(error).__name__}: {error})", _FIX)
    reader.close()


def _plan_problems(sample: Sample, plan: Plan, index: int) -> Iterator[str]:
    options = plan.sample
    if (sample.seed, sample.index) != (plan.seed, index):
        yield f"calls itself sample {sample.index} of seed {sample.seed}"
    if len(sample.points) != options.num_points:
        yield f"has {len(sample.points)} points instead of {options.num_points}"
    if sample.renderer != options.renderer:
        yield f"was drawn by {sample.renderer} instead of {options.renderer}"
    if sample.noise != options.noise:
        yield f"has the noise of sensor {sample.noise} instead of {options.noise}"
    images = {name for name in ("depth", "part_mask", "rgb") if getattr(sample, name) is not None}
    if images != set(options.images):
        yield f"has images {sorted(images)} instead of {sorted(options.images)}"
    if not _is_asked_size(sample, options.scale):
        yield f"its scale of {sample.scale:.4g} (diagonal {sample.diagonal:.4g} m) is not as asked for"
    if not _close(sample.T_world_camera @ sample.T_camera_part[0], np.eye(4), 1e-9):
        yield "the root part does not stand on the world's origin"


def _is_asked_size(sample: Sample, scale: Scale) -> bool:
    if scale == "native":
        return sample.scale == 1.0
    low, high = (1.0, 1.0) if scale == "unit" else scale
    return low * (1 - 1e-9) <= sample.diagonal <= high * (1 + 1e-9)


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


def _close(one: ArrayLike, two: ArrayLike, tolerance: float) -> bool:
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
    if not _close(sample.diagonal, obj.diagonal, length):
        yield "the diagonal is not that of the object"
    if not (_close(sample.box_center, obj.box_center, length) and _close(sample.box_size, obj.box_size, length)):
        yield "boxes are not those of the object"
    if not (
        sample.joint_type == tree.types
        and np.array_equal(sample.joint_parent, tree.parents)
        and _close(sample.joint_axis, tree.axes, 1e-9)
        and _close(sample.joint_origin, tree.origins, length)
        and _close(sample.joint_rest, tree.rest, length)
        and _close(sample.joint_limits, tree.limits, length)
    ):
        yield "joints are not those of the object"


def _pose_problems(sample: Sample, obj: ArticulatedObject) -> Iterator[str]:
    tree, T, length = obj.tree, sample.T_camera_part, 1e-9 * max(1.0, obj.diagonal)
    rotation = T[:, :3, :3]
    if (
        not _close(rotation @ np.swapaxes(rotation, 1, 2), np.eye(3), 1e-9)
        or (np.linalg.det(rotation) < 0).any()
        or (T[:, 3] != (0, 0, 0, 1)).any()
    ):
        yield "a rotation is not a rotation"
    if not _close(T[0] @ tree.forward_kinematics(sample.joint_state), T, length):
        yield "part poses do not follow from the joint states"
    axis, origin = tree.posed_joints(T)
    if not (_close(axis, sample.joint_axis_camera, 1e-9) and _close(origin, sample.joint_origin_camera, length)):
        yield "posed joint axes do not follow from the part poses"
    if not _close(sample.joint_state, tree.complete_state(sample.joint_state), 1e-9):
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
        if not _close(p_box / size + 0.5, npcs[:, mine], tolerance / size + 1e-6):
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
    if points is not true_points and not _close(_projected(sample.K, true_points), image, 0.1):
        yield "a point does not lie on the ray to the place that its npcs name"
    column, row = pixel.astype(np.int64)
    if min(column.min(), row.min()) < 0 or column.max() >= sample.width or row.max() >= sample.height:
        yield "a point projects outside the image"
        return
    if sample.depth is not None and not _close(sample.depth[row, column], sample.points[:, 2], tolerance):
        yield "points do not agree with the depth image"
    if sample.part_mask is not None and (sample.part_mask[row, column] != sample.part).any():
        yield "points do not agree with the part mask"
    if sample.renderer == "raycast":
        T_world_object = sample.T_world_camera @ sample.T_camera_part[0]
        if _close(T_world_object, np.eye(4), 1e-9):
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
