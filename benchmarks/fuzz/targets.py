"""What reads files that nobody vouches for: the public entry point of each kind."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from artperl.training.options import TrainOptions
from artsim.errors import ArtsimError
from artsim.model.objects import ArticulatedObject


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
    from artperl.estimator import load_estimator

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


def _depth(folder: Path) -> None:
    from artperl.inputs import read_points

    depth = next(path for path in (folder / "depth.npy", folder / "depth.png") if path.exists())
    mask = next(path for path in (folder / "mask.npy", folder / "mask.png") if path.exists())
    camera = next(path for path in (folder / "camera.yaml", folder / "camera.json") if path.exists())
    _check_points(read_points(depth, mask, camera))


def _check_points(points: np.ndarray) -> None:
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind != "f":
        raise UnsoundError(f"points of shape {points.shape}, {points.dtype}")


@dataclass(frozen=True)
class Target:
    """What reads a kind of file.

    Attributes
    ----------
    read : callable
        Reads the folder.
    weight : int
        Share of inputs.
    """

    read: Callable[[Path], None]
    weight: int


TARGETS = {
    "urdf": Target(_urdf, 20),
    "side": Target(_urdf, 4),
    "joints": Target(_joints, 8),
    "mesh": Target(_urdf, 30),
    "object": Target(_object, 12),
    "cloud": Target(_cloud, 14),
    "depth": Target(_depth, 4),
    "mask": Target(_depth, 5),
    "intrinsics": Target(_depth, 8),
    "dataset": Target(_dataset, 10),
    "motions": Target(_motions, 3),
    "base": Target(_base, 8),
    "estimator": Target(_estimator, 4),
    "state": Target(_state, 4),
}
"""Kinds of files, and what reads them."""


def fails(kind: str, folder: Path) -> BaseException | None:
    """What came out of reading a folder that should not have: None after a success, or after an error of our own."""
    try:
        with contextlib.suppress(ArtsimError):
            TARGETS[kind].read(folder)
    except (KeyboardInterrupt, GeneratorExit):
        raise
    except BaseException as error:  # finding all of them is what this is for
        return error
    return None
