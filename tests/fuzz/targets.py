"""What reads files that nobody vouches for: the public entry point of each kind."""

from __future__ import annotations

import contextlib
import json
import time
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from artperl.training.options import TrainOptions
from artsim.errors import ArtsimError
from artsim.model.objects import ArticulatedObject
from tests.fuzz.seeds import Input


class UnsoundError(Exception):
    """What was read without an error is not what it must be."""


def _check_object(obj: ArticulatedObject) -> None:
    from artsim.drawing.inspect import describe

    describe(obj).encode()
    if not np.isfinite(obj.bounds).all() or not obj.diagonal > 0.0:
        raise UnsoundError(f"bounds {obj.bounds.tolist()}")
    poses = obj.tree.forward_kinematics(obj.tree.rest)
    if not np.allclose(poses, np.eye(4), atol=1e-6):
        raise UnsoundError("parts are not at rest in the rest state")


def _urdf(folder: Path) -> None:
    import artsim

    _check_object(artsim.load(min(folder.glob("mobility.*"))))


def _joints(folder: Path) -> None:
    import artsim

    _check_object(artsim.load(folder))


def _object(folder: Path) -> None:
    import artsim

    _check_object(artsim.load(folder / "o.npz"))


def _base(folder: Path) -> None:
    from artperl.retrieval.shape_base_file import read_shape_base

    read_shape_base(folder / "base.npz").axis_prior(0)


def _estimator(folder: Path) -> None:
    from artperl.methods.estimator_files import load_estimator

    load_estimator(folder)


def _state(folder: Path) -> None:
    from artperl.training.run_folder import RunFolder, differences

    state, _, _ = RunFolder(folder).read()
    differences(state["options"], json.loads(json.dumps(asdict(TrainOptions()))))


def _dataset(folder: Path) -> None:
    import artsim

    dataset = artsim.open_dataset(folder)
    for i in range(min(len(dataset), 2)):
        sample = dataset[i]
        if not np.isfinite(sample.points).all():
            raise UnsoundError("a point is not finite")
        _check_object(dataset.object_of(sample))


def _motions(folder: Path) -> None:
    from artsim.physics.episode_file import open_motions

    for motion in open_motions(folder):
        motion[0]


def _cloud(folder: Path) -> None:
    from artperl.inputs import read_points

    (path,) = folder.iterdir()
    _check_points(read_points(path))


def _image(folder: Path) -> None:
    from artperl.inputs import read_points

    depth = next(path for path in (folder / "depth.npy", folder / "depth.png") if path.exists())
    mask = next(path for path in (folder / "mask.npy", folder / "mask.png") if path.exists())
    camera = next(path for path in (folder / "camera.yaml", folder / "camera.json") if path.exists())
    _check_points(read_points(depth, mask, camera))


def _check_points(points: np.ndarray) -> None:
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind != "f":
        raise UnsoundError(f"points of shape {points.shape}, {points.dtype}")


TARGETS: dict[str, Callable[[Path], None]] = {
    "urdf": _urdf,
    "joints": _joints,
    "object": _object,
    "cloud": _cloud,
    "image": _image,
    "dataset": _dataset,
    "motions": _motions,
    "base": _base,
    "estimator": _estimator,
    "state": _state,
}
"""What reads a folder of each kind."""

SLOW_S, LARGE_MB = 2.0, 500.0
"""Processor time and memory from which on an input is a finding."""


@dataclass(frozen=True)
class Finding:
    """An input that ends in anything but success or an error of our own.

    Attributes
    ----------
    sort : str
        ``raw``, ``slow``, ``large`` or ``crash``.
    cause : str
        What findings of one cause share.
    text : str
        Traceback, or figures.
    """

    sort: str
    cause: str
    text: str


def examine(given: Input, root: Path) -> tuple[float, float, Finding | None]:
    """Processor time and memory of reading an input, seconds and MB; and what is wrong with it."""
    folder, name = given.lay_out(root), given.file_name(0)
    Path("/proc/self/clear_refs").write_text("5")  # the most memory of this process is what it has now
    before, start, error = _memory_mb("VmRSS"), time.process_time(), None
    try:
        with contextlib.suppress(ArtsimError):
            TARGETS[given.seed.kind](folder)
    except (KeyboardInterrupt, GeneratorExit):
        raise
    except BaseException as raised:  # finding all of them is what this is for
        error = raised
    spent, taken = time.process_time() - start, _memory_mb("VmHWM") - before
    found = None
    if error is not None:
        frames = [f for f in traceback.extract_tb(error.__traceback__) if "/artsim/" in f.filename.split("tests")[0]
                  or "/artperl/" in f.filename]  # fmt: skip
        where = f" {Path(frames[-1].filename).name}:{frames[-1].lineno}" if frames else ""
        found = Finding("raw", type(error).__name__ + where, "".join(traceback.format_exception(error)))
    elif spent > SLOW_S:
        found = Finding("slow", f"slow {name}", f"{spent:.1f} s of processor time")
    elif taken > LARGE_MB:
        found = Finding("large", f"large {name}", f"{taken:.0f} MB")
    return spent, taken, found


def _memory_mb(name: str) -> float:
    lines = Path("/proc/self/status").read_text().splitlines()
    return float(next(line.split()[1] for line in lines if line.startswith(name))) / 1024
