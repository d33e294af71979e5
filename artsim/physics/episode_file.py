"""Motions recorded frame by frame, for tracking: each frame a sample of the same object, a moment later.

A folder holds ``motions.json``, one shard ``motion-000000.tar`` for each motion (samples as in any dataset, ``index`` =
number of the frame) and its object ``objects/motion-000000.npz``. What is the same thing in two frames is told by ids:
parts keep their number, and points of equal ``part`` and ``npcs`` are the same place of the object, wherever it moved.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.files import read_json, write_atomic, write_error
from artsim.common.names import safe_name
from artsim.common.progress import track
from artsim.datasets.shards import ShardReader, sample_key, write_shard
from artsim.errors import DatasetError
from artsim.model.draws import joint_intervals
from artsim.model.kinematics import Array
from artsim.model.object_file import load_object, save_object
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import invert_transform, transform_points
from artsim.observing.sample import Sample
from artsim.physics.episode import Episode, EpisodeOptions
from artsim.physics.world import engine_of
from artsim.runs.recipe import check_counts, check_seed
from artsim.runs.storage import FolderStorage

FORMAT = 1
_GOAL_SECONDS = 2.0  # a joint heads for a goal for so long, then for another
_REACH_SECONDS = 0.5  # in which it covers most (1 - 1/e) of the way


@dataclass(frozen=True, eq=False)
class Motion:
    """One recorded motion: ``len(motion)`` frames, ``motion[i]`` is a :class:`Sample`.

    Attributes
    ----------
    name : str
    obj : ArticulatedObject
    time : (T,) float
        Seconds since the motion began.
    joint_state, joint_velocity : (T, K) float
        Radians or metres, and those per second.
    """

    name: str
    obj: ArticulatedObject
    time: Array
    joint_state: Array
    joint_velocity: Array
    _shard: ShardReader

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, i: int) -> Sample:
        if not -len(self) <= i < len(self):
            raise IndexError(f"frame {i} of {len(self)}")
        return self._shard.read(sample_key(i % len(self)))

    def __iter__(self) -> Iterator[Sample]:
        return (self[i] for i in range(len(self)))


def follow_points(points: NDArray[Any], part: NDArray[np.uint8], before: Sample, after: Sample) -> Array:
    """Where the same places of the object are in another frame of its motion.

    Parameters
    ----------
    points : (N, 3) float
        In the camera frame of ``before``.
    part : (N,) uint8
        Part that each is on.
    before, after : Sample

    Returns
    -------
    (N, 3) float
        In the camera frame of ``after``.
    """
    T_after_before = after.T_camera_part @ invert_transform(before.T_camera_part)
    return transform_points(T_after_before[part], np.asarray(points, dtype=np.float64)[:, None])[:, 0]


def record(
    out: str | Path,
    options: EpisodeOptions | None = None,
    motions: int = 10,
    frames: int = 60,
    seed: int = 0,
    progress: bool = True,
) -> Path:
    """Record motions under physics: every joint is driven by a motor from one random goal to the next.

    Parameters
    ----------
    out : path
        Folder to write to; made if missing.
    options : EpisodeOptions, optional
    motions, frames : int
        Motions, and frames of each: one for each control step.
    seed : int
        Motion m depends on (seed, m) and the options alone.
    progress : bool
        Show a progress bar.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    ConfigError
        When a number makes no sense.
    DatasetError
        When the folder already holds something.
    """
    options, folder = options or EpisodeOptions(), Path(out)
    check_counts(motions=motions, frames=frames)
    check_seed(seed)
    episode = Episode(options)
    try:
        if folder.exists() and any(folder.iterdir()):
            raise DatasetError("the folder already holds something", folder, "choose an empty or new folder")
        (folder / "objects").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise write_error(error, folder) from error
    described = [
        _record_one(folder, episode, frames, seed, number)
        for number in track("motions", range(motions), unit="motion", shown=progress)
    ]
    episode.close()
    description = {
        "format": FORMAT,
        "artsim_version": version("artsim"),
        "seed": seed,
        "frames": frames,
        "control_step": options.physics.control_step,
        "engine": engine_of(options.physics),
        "options": asdict(replace(options, obj=None)),
        "motions": described,
    }
    write_atomic(folder / "motions.json", json.dumps(description, indent=1, default=str).encode())
    return folder


def _record_one(folder: Path, episode: Episode, frames: int, seed: int, number: int) -> dict[str, Any]:
    """Write a motion's shard and object; returns its entry in ``motions.json``."""
    rng, name = np.random.default_rng([seed, number]), f"motion-{number:06d}"
    obj = episode.draw_object(rng)
    episode.begin(obj, rng)
    states: list[list[float]] = []
    velocities: list[list[float]] = []

    def samples() -> Iterator[Sample]:
        free = obj.tree.free_joints
        low, high = joint_intervals(obj)[free].T
        frames_of_a_goal = max(1, round(_GOAL_SECONDS / episode.options.physics.control_step))
        for frame in range(frames):
            if frame % frames_of_a_goal == 0:
                goal = rng.uniform(low, high)
            states.append(episode.simulation.state.tolist())
            velocities.append(episode.simulation.velocity.tolist())
            yield episode.look(rng, seed)
            episode.step((goal - episode.simulation.state[free]) / _REACH_SECONDS, "velocity")

    size, digest = write_shard(FolderStorage(folder), f"{name}.tar", samples())
    save_object(obj, folder / "objects" / f"{name}.npz")
    return {
        "name": name,
        "category": obj.category,
        "object_id": obj.object_id,
        "object_sha256": obj.sha256,
        "bytes": size,
        "sha256": digest,
        "joint_state": states,
        "joint_velocity": velocities,
    }


def open_motions(folder: str | Path) -> list[Motion]:
    """Every motion that :func:`record` wrote into a folder.

    Raises
    ------
    DatasetError
        When the folder holds no complete recording, or a damaged one.
    """
    folder = Path(folder)
    path = folder / "motions.json"
    if not path.exists():
        raise DatasetError("no recorded motions here (no motions.json)", folder, "record some: artsim record")
    try:
        description = read_json(path, "motions.json", DatasetError)
        if description["format"] != FORMAT:
            raise DatasetError(f"format {description['format']!r:.20} is not {FORMAT}", folder, "record it again")
        step = float(description["control_step"])
        if not 0.0 < step <= 1e6:
            raise ValueError(f"its control step is {step}")
        return [_open_one(folder, entry, step) for entry in description["motions"]]
    except (ValueError, KeyError, TypeError) as error:
        raise DatasetError(f"motions.json is damaged ({error})", folder, "record it again") from error


def _open_one(folder: Path, entry: dict[str, Any], control_step: float) -> Motion:
    name = entry["name"]
    if not isinstance(name, str) or name != safe_name(name):
        raise DatasetError(f"motions.json names a motion {name!r:.60}", folder, "record it again")
    shard, obj = ShardReader(folder / f"{name}.tar"), load_object(folder / "objects" / f"{name}.npz")
    state, velocity = (np.array(entry[key], dtype=np.float64) for key in ("joint_state", "joint_velocity"))
    if not (np.isfinite(state).all() and np.isfinite(velocity).all()):
        raise DatasetError(f"motions.json holds states of {name} that are not finite", folder, "record it again")
    if not state.shape == velocity.shape == (len(shard), len(obj)):
        raise DatasetError(f"holds {len(shard)} frames instead of {len(velocity)}", shard.path, "record it again")
    return Motion(name, obj, np.asarray(np.arange(len(shard)) * control_step, np.float64), state, velocity, shard)
