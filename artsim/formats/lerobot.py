"""LeRobot datasets, version 3.0: recorded motions as episodes, an episode in each Parquet file.

A frame has the states and speeds of the joints, padded with zeros to the most joints of any episode; the cloud in the
camera frame, metres; and as action the joint states of the next frame. Radians, metres, and those per second.
"""

import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from artsim.common.extras import require_extra
from artsim.common.files import write_atomic
from artsim.errors import ConfigError, DatasetError
from artsim.model.kinematics import Array

_CHUNK = 1000
"""Files of a folder: LeRobot's own."""
_DATA = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_EPISODES = "meta/episodes/chunk-000/file-000.parquet"
_COUNTED = {"timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64",
            "task_index": "int64"}  # fmt: skip
"""Columns that every dataset of LeRobot has."""


@dataclass(frozen=True, eq=False)
class Recording:
    """An episode of T frames."""

    task: str
    """What happens, in words."""
    state: Array
    velocity: Array
    """(T, J) float. Of its joints."""
    points: NDArray[np.float32]
    """(T, N, 3). N is the same in all."""


def write_lerobot(out: str | Path, recordings: Iterable[Recording], fps: float, joints: int, points: int) -> Path:
    """Write a dataset; ``meta/info.json`` is written last.

    Parameters
    ----------
    out : path
        Folder; made if missing.
    recordings : iterable of Recording
    fps : float
        Frames a second: a whole number.
    joints : int
        Most joints of any recording.
    points : int
        Of each cloud.

    Raises
    ------
    ConfigError
        When LeRobot has no such frame rate, or pyarrow is missing.
    DatasetError
        When the folder already holds something.
    """
    with require_extra("parquet"):
        import pyarrow  # noqa: F401
    folder, rate = Path(out), round(fps)
    if rate < 1 or abs(rate - fps) > 1e-6 * rate:
        what = f"{fps:g} frames a second is no whole number, which LeRobot wants"
        raise ConfigError(what, "control_step", "record with another control step, such as 0.05")
    if folder.exists() and any(folder.iterdir()):
        raise DatasetError("the folder already holds something", folder, "choose an empty or new folder")
    names = [f"joint_{k}" for k in range(1, joints + 1)]
    features: dict[str, dict[str, Any]] = {
        key: {"dtype": "float32", "shape": [joints], "names": names}
        for key in ("observation.state", "observation.velocity", "action")
    }
    features["observation.points"] = {"dtype": "float32", "shape": [points, 3], "names": ["point", "xyz"]}
    features |= {key: {"dtype": kind, "shape": [1], "names": None} for key, kind in _COUNTED.items()}
    tasks: dict[str, int] = {}
    episodes, total, every = list[dict[str, Any]](), 0, list[dict[str, NDArray[Any]]]()
    for number, recording in enumerate(recordings):
        columns = _columns(recording, joints, number, total, tasks.setdefault(recording.task, len(tasks)), rate)
        place = {"chunk_index": number // _CHUNK, "file_index": number % _CHUNK}
        _write(folder, _DATA.format(**place), columns)
        length, small = len(recording.state), {key: v for key, v in columns.items() if v.ndim < 3}
        every.append(small)
        episodes.append({
            "episode_index": number, "tasks": [recording.task], "length": length,
            **{f"data/{key}": value for key, value in place.items()},
            "dataset_from_index": total, "dataset_to_index": total + length,
            "meta/episodes/chunk_index": 0, "meta/episodes/file_index": 0,
            **{f"stats/{key}/{name}": value for key, own in _stats(small).items() for name, value in own.items()},
        })  # fmt: skip
        total += length
    _write(folder, _EPISODES, {key: [episode[key] for episode in episodes] for key in episodes[0]})
    _write(folder, "meta/tasks.parquet", {"task_index": list(tasks.values()), "task": list(tasks)}, index="task")
    together = _stats({key: np.concatenate([own[key] for own in every]) for key in every[0]})
    _write_json(folder, "meta/stats.json", together)
    _write_json(folder, "meta/info.json", {
        "codebase_version": "v3.0", "robot_type": "artsim", "total_episodes": len(episodes), "total_frames": total,
        "total_tasks": len(tasks), "chunks_size": _CHUNK, "data_files_size_in_mb": 100, "video_files_size_in_mb": 200,
        "fps": rate, "splits": {"train": f"0:{len(episodes)}"}, "data_path": _DATA, "video_path": None,
        "features": features,
    })  # fmt: skip
    return folder


def _columns(recording: Recording, joints: int, number: int, first: int, task: int, rate: int) -> dict[str, Any]:
    """Arrays of an episode, (T, ...) each."""
    frames = np.arange(len(recording.state))
    padded = [(0, 0), (0, joints - recording.state.shape[1])]
    state, velocity = (np.pad(v, padded).astype(np.float32) for v in (recording.state, recording.velocity))
    if joints == 1:  # LeRobot has no vectors of one number
        state, velocity = state[:, 0], velocity[:, 0]
    counted = [frames / rate, frames, np.full_like(frames, number), first + frames, np.full_like(frames, task)]
    return {
        "observation.state": state,
        "observation.velocity": velocity,
        "action": state[np.minimum(frames + 1, frames[-1])],  # nothing follows the last frame: it stays
        "observation.points": recording.points,
        **{key: values.astype(kind) for (key, kind), values in zip(_COUNTED.items(), counted, strict=True)},
    }


def _stats(columns: Mapping[str, NDArray[Any]]) -> dict[str, dict[str, list[float]]]:
    """What LeRobot normalizes by."""
    return {
        key: {
            **{name: np.atleast_1d(getattr(values.astype(np.float64), name)(axis=0)).tolist()
               for name in ("min", "max", "mean", "std")},
            "count": [len(values)],
        }
        for key, values in columns.items()
    }  # fmt: skip


def _write(folder: Path, name: str, columns: Mapping[str, Any], index: str = "") -> None:
    """Write a Parquet file; pandas takes the column ``index`` as the names of the rows."""
    import pyarrow as pa
    from pyarrow import parquet

    table = pa.table({key: v.tolist() if isinstance(v, np.ndarray) and v.ndim > 1 else v for key, v in columns.items()})
    for at, key in enumerate(table.column_names):
        if isinstance(columns[key], np.ndarray) and columns[key].dtype == np.float32:
            kind: Any = pa.float32()
            for _ in range(columns[key].ndim - 1):
                kind = pa.list_(kind)
            table = table.set_column(at, key, table[key].cast(kind))
    if index:
        told = {"index_columns": [index], "column_indexes": [], "pandas_version": "2.0.0", "columns": [
            {"name": key, "field_name": key, "pandas_type": kind, "numpy_type": of, "metadata": None}
            for key, kind, of in (("task_index", "int64", "int64"), (index, "unicode", "object"))]}  # fmt: skip
        table = table.replace_schema_metadata({"pandas": orjson.dumps(told)})
    buffer = io.BytesIO()
    parquet.write_table(table, buffer, compression="zstd")
    write_atomic(folder / name, buffer.getvalue())


def _write_json(folder: Path, name: str, content: Any) -> None:
    write_atomic(folder / name, orjson.dumps(content, option=orjson.OPT_INDENT_2))
