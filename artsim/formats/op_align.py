"""OP-Align: one ``.npz`` for each cloud, with the pose of every part and the line of every joint.

Its loader finds them as ``<category>_output/<split>/<object>/<view>/input_2/<view>.npz``. The layout wants one pickled
dictionary in each. :func:`read_op_align` reads it with functions of its own, and runs nothing that a file names.
"""

import io
import pickle
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.array_files import MAX_ARRAY_BYTES
from artsim.common.files import read_bounded
from artsim.datasets.dataset import Dataset
from artsim.datasets.shards import sample_key
from artsim.errors import AssetError
from artsim.formats.base import Format, Piece
from artsim.observing.interference import FOREIGN
from artsim.observing.sample import Sample
from artsim.runs.tasks import Output

_KEYS = {"pc": 3, "color": 3, "detection": 0, "segmentation": 0, "part": 15, "joint": 6}
"""Width of each array; 0 of one number a point."""
_GREY = 0.5
_NDARRAY = "an array"
"""Stands for NumPy's class: nothing makes an array of a size that a file names."""


class OpAlignFormat(Format):
    """``<category>_output/<split>/<object>/<view>/input_2/<view>.npz``."""

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write one file for each sample."""
        for sample in samples:
            key, view = dataset.planned(sample.index).key, sample_key(sample.index)
            folder = f"{sample.category}_output/{piece.split}/{key}/{view}/input_2"
            output.write(f"{folder}/{view}.npz", op_align_npz(sample))


def op_align_npz(sample: Sample) -> bytes:
    """A sample of K parts and N points as OP-Align has it.

    Notes
    -----
    Camera frame, metres. ``pc``, ``color`` (N, 3); ``detection`` (N,) 1 for points of the object; ``segmentation`` (N,)
    0 or part + 1; ``part`` (K, 15) rotation row by row, box centre and box size; ``joint`` (K - 1, 6) a point of the
    axis and its direction, in the order in which its loader takes them.
    """
    known = sample.part != FOREIGN
    rotation = sample.T_camera_part[:, :3, :3]
    center = np.einsum("kij,kj->ki", rotation, sample.box_center) + sample.T_camera_part[:, :3, 3]
    record = {
        "pc": sample.points.astype(np.float32),
        "color": np.full((len(sample.points), 3), _GREY, np.float32),
        "detection": known.astype(np.uint8),
        "segmentation": np.where(known, sample.part.astype(np.int64) + 1, 0).astype(np.uint8),
        "part": np.concatenate([rotation.reshape(-1, 9), center, sample.box_size], axis=1),
        "joint": np.concatenate([sample.joint_origin_camera, sample.joint_axis_camera], axis=1)[1:],
    }
    buffer = io.BytesIO()
    np.savez(buffer, np.array(record, dtype=object))
    return buffer.getvalue()


def read_op_align(path: str | Path) -> dict[str, NDArray[Any]]:
    """The arrays of a file in OP-Align's layout; see :func:`op_align_npz`.

    Raises
    ------
    AssetError
        When it is damaged, holds something else, or would run code.
    """
    data = read_bounded(Path(path), MAX_ARRAY_BYTES, "OP-Align file", fix="restore it")
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entry = archive.getinfo("arr_0.npy")
            if entry.file_size > MAX_ARRAY_BYTES:
                raise ValueError(f"{entry.file_size} bytes are too many")
            stream = io.BytesIO(archive.read(entry))
        version = np.lib.format.read_magic(stream)
        header = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}[version]
        header(stream)
        record = _Arrays(stream).load()
        record = record.item() if isinstance(record, np.ndarray) else record
        return {name: _checked(record[name], width, name) for name, width in _KEYS.items()}
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, EOFError, MemoryError, pickle.UnpicklingError,
            zipfile.BadZipFile, NotImplementedError) as error:  # fmt: skip
        raise AssetError(f"not a file of OP-Align ({error})", path, "name a .npz file of its dataset") from error


class _Arrays(pickle.Unpickler):
    """Reads dictionaries of arrays. All that a file names of Python is one of the functions here, or refused."""

    def find_class(self, module: str, name: str) -> Any:
        """What a name stands for, of those that arrays need."""
        known = {
            "numpy.ndarray": _NDARRAY, "numpy.dtype": np.dtype, "_codecs.encode": _latin1,
            "numpy.core.multiarray._reconstruct": _empty, "numpy._core.multiarray._reconstruct": _empty,
        }  # fmt: skip
        if f"{module}.{name}" not in known:
            raise pickle.UnpicklingError(f"it names {module}.{name:.60}")
        return known[f"{module}.{name}"]


def _empty(kind: object, shape: object, code: object) -> NDArray[Any]:
    """The empty array that NumPy's pickles begin with: what fills it is in the file."""
    if kind is not _NDARRAY or shape != (0,):
        raise pickle.UnpicklingError(f"its array begins as {shape}")
    return np.empty(0)


def _latin1(text: str, encoding: str) -> bytes:
    if encoding != "latin1":
        raise pickle.UnpicklingError(f"it names the encoding {encoding:.20}")
    return text.encode("latin1")


def _checked(array: Any, width: int, name: str) -> NDArray[Any]:
    shape = (-1, width) if width else (-1,)
    if not isinstance(array, np.ndarray) or array.dtype.kind not in "biuf" or not np.isfinite(array).all():
        raise ValueError(f"{name} is no array of finite numbers")
    if array.ndim != len(shape) or (width and array.shape[1] != width):
        raise ValueError(f"{name} has shape {array.shape}")
    return array
