"""Checks of a dataset on disk: files, checksums and what must hold of every sample's ground truth."""

from collections import defaultdict
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from artsim.common.progress import track
from artsim.datasets.dataset import Dataset
from artsim.datasets.description import DESCRIPTION, read_description, read_started
from artsim.datasets.inventory import examine, leftover_problems, strangers
from artsim.datasets.plan import Plan, ShardRecord
from artsim.datasets.problems import Problem, repair_command
from artsim.datasets.sample_checks import close, sample_problems
from artsim.datasets.shards import ShardReader, sample_key
from artsim.errors import ArtsimError, DatasetError
from artsim.model.object_file import load_object
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.runs.each import each

_FIX = "generate the dataset again, into another folder: its checksums are right, its content is not"
_WORTH_A_PROCESS = 500
"""Samples that take as long to check as a process takes to start."""


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
        *leftover_problems(folder),
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
        for shard, own in each(partial(_shard_checker, folder, unusable), shards, max(1, workers)):
            problems += own
            bar.update(len(shard))
    return problems


def _shard_checker(folder: Path, unusable: set[str]) -> Callable[[ShardRecord], tuple[ShardRecord, list[Problem]]]:
    """What checks a shard, once in each process."""
    dataset = Dataset(folder)
    return lambda shard: (shard, list(_shard_problems(dataset, shard, unusable)))


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
    elif not close(np.linalg.norm(tree.axes[1:], axis=1), 1.0, 1e-6):
        yield "an axis is not of unit length"
    if (low > high).any():
        yield "a joint's lower limit is above its upper one"
    if not close(tree.forward_kinematics(tree.rest), np.eye(4), 1e-9):
        yield "its parts are not at rest in its rest state"


def _shard_problems(dataset: Dataset, shard: ShardRecord, unusable: set[str]) -> Iterator[Problem]:
    path, plan = dataset.folder / shard.name, dataset.plan
    try:
        reader = ShardReader(path)
    except DatasetError as error:
        yield Problem(shard.name, error.what, _FIX)
        return
    indices = plan.indices(shard)
    wanted, have = [sample_key(index) for index in indices], reader.keys()
    if have != wanted:
        lost, foreign = sorted({*wanted} - {*have}), sorted({*have} - {*wanted})
        what = f"lacks samples {lost[:5]}, has unexpected ones {foreign[:5]}, or holds them out of order"
        yield Problem(shard.name, what, _FIX)
    there = set(have)
    for index, key in zip(indices, wanted, strict=True):
        planned = plan.object_of(index)
        if key not in there or planned.file in unusable:
            continue
        where = f"{shard.name}: sample {index}"
        try:
            sample = reader.read(key)
            obj = dataset.objects[planned.file].scaled(sample.scale)
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
    low, high = (1.0, 1.0) if isinstance(options.scale, str) else options.scale
    size = sample.scale if options.scale == "native" else sample.diagonal
    if not low * (1 - 1e-9) <= size <= high * (1 + 1e-9):
        yield f"its scale of {sample.scale:.4g} (diagonal {sample.diagonal:.4g} m) is not as asked for"
    if not close(sample.T_world_camera @ sample.T_camera_part[0], np.eye(4), 1e-9):
        yield "the root part does not stand on the world's origin"
