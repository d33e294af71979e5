"""Samples as members of WebDataset tar shards, byte for byte reproducible."""

from __future__ import annotations

import hashlib
import io
import os
import tarfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import orjson
from numpy.typing import NDArray
from PIL import Image

from artsim.common.array_files import parse_npy
from artsim.common.files import atomic_file, open_image
from artsim.datasets.tar_index import read_index
from artsim.errors import DatasetError
from artsim.model.details import DetailFrame
from artsim.observing.sample import Sample
from artsim.runs.storage import FolderStorage, Storage

_CLOUD = ("points", "part", "npcs")
_PNG = ("part_mask", "rgb")
_ON_REQUEST = ("depth", "detail")
_STRINGS = ("joint_type", "part_names")
_INTEGERS = ("joint_parent",)
_SCALARS = ("width", "height", "category", "object_id", "object_sha256", "scale", "diagonal", "seed", "index",
            "renderer", "artsim_version")  # fmt: skip
_OTHER = (*_CLOUD, *_PNG, "depth", "noise", "details", "detail", *_STRINGS, *_SCALARS)
_ARRAYS = tuple(f.name for f in fields(Sample) if f.name not in _OTHER)

MAX_PIXELS = 8192 * 8192
"""Of the largest images that are made."""
_AGAIN = "make it again"


def sample_members(sample: Sample) -> dict[str, bytes]:
    """Member suffix -> content: ``points.npy``, ``part.npy``, ``npcs.npy``, ``json``, and the images there are."""
    members = {f"{name}.npy": npy_bytes(getattr(sample, name)) for name in _CLOUD}
    record: dict[str, Any] = {name: getattr(sample, name) for name in _SCALARS}
    record |= {name: getattr(sample, name) for name in _STRINGS}
    record |= {name: np.ascontiguousarray(getattr(sample, name)) for name in _ARRAYS}
    if sample.noise != "none":  # so that samples without noise are what they were before there was any
        record["noise"] = sample.noise
    if sample.details:
        record["details"] = [detail.to_dict() for detail in sample.details]
    members["json"] = orjson.dumps(record, option=orjson.OPT_SERIALIZE_NUMPY)  # infinite limits become null
    for name in _ON_REQUEST:
        if getattr(sample, name) is not None:
            members[f"{name}.npy"] = npy_bytes(getattr(sample, name))
    for name in _PNG:
        image = getattr(sample, name)
        if image is not None:
            members[f"{name}.png"] = png_bytes(image)
    return members


def sample_from_members(members: Mapping[str, bytes], where: str, fix: str = _AGAIN) -> Sample:
    """Inverse of :func:`sample_members`.

    Raises
    ------
    DatasetError
        When a member is missing or damaged.
    """
    try:
        record = orjson.loads(members["json"])
        limits = np.array(
            [
                [-np.inf if lower is None else lower, np.inf if upper is None else upper]
                for lower, upper in record["joint_limits"]
            ]
        )
        values: dict[str, Any] = {name: record[name] for name in _SCALARS}
        values["noise"] = record.get("noise", "none")
        values |= {name: tuple(record[name]) for name in _STRINGS}
        values |= {
            name: np.array(record[name], dtype=np.int64 if name in _INTEGERS else np.float64)
            for name in _ARRAYS
            if name != "joint_limits"
        }
        values["joint_limits"] = limits.reshape(-1, 2)
        values |= {name: parse_npy(members[f"{name}.npy"]) for name in _CLOUD}
        values |= {name: parse_npy(members[f"{name}.npy"]) for name in _ON_REQUEST if f"{name}.npy" in members}
        values["details"] = tuple(DetailFrame.from_dict(detail) for detail in record.get("details", ()))
        for name in _PNG:
            if f"{name}.png" in members:
                values[name] = np.asarray(open_image(members[f"{name}.png"], name, DatasetError, MAX_PIXELS))
        _check(values)
        return Sample(**values)
    except Exception as error:  # NumPy, Pillow and json fail in many ways on bytes that are not theirs
        raise DatasetError(f"damaged sample ({type(error).__name__}: {error})", where, fix) from error


_NUMBERS = {"width": int, "height": int, "seed": int, "index": int, "scale": float, "diagonal": float}
"""Scalars that are no text."""


def _check(values: Mapping[str, Any]) -> None:
    """Refuse values of other types and shapes than a sample has: a ValueError names the first of them."""
    for name in _SCALARS:
        value, wanted = values[name], _NUMBERS.get(name, str)
        fits = isinstance(value, (int, float) if wanted is float else wanted) and not isinstance(value, bool)
        if not fits or (wanted is float and not np.isfinite(value)):
            raise ValueError(f"{name} is {value!r:.40}")
    points, part, K = values["points"], values["part"], len(values["joint_type"])
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind != "f" or not np.isfinite(points).all():
        raise ValueError("its points are not finite coordinates")
    if values["npcs"].shape != points.shape or part.shape != points.shape[:1] or part.dtype != np.uint8:
        raise ValueError("its points have labels that do not fit")
    if any(detail.part >= K for detail in values["details"]):
        raise ValueError("a detail is of a part that it does not have")
    if "detail" in values and values["detail"].shape != part.shape:
        raise ValueError("its points have labels that do not fit")
    if K == 0 or len(values["part_names"]) != K or (len(part) and int(part.max()) >= K):
        raise ValueError("its points are of parts that it does not have")
    wrong = [name for name in _ARRAYS if name not in ("K", "T_world_camera") and len(values[name]) != K]
    if wrong:
        raise ValueError(f"{wrong[0]} is not of {K} parts")


def png_bytes(image: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """(H, W) or (H, W, 3) image as PNG."""
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, "PNG")
    return buffer.getvalue()


def npy_bytes(array: NDArray[Any]) -> bytes:
    """An array of numbers in NumPy's ``.npy`` format."""
    return _npy_header(array.dtype, array.shape) + array.tobytes()


@lru_cache(maxsize=64)
def _npy_header(dtype: np.dtype[Any], shape: tuple[int, ...]) -> bytes:
    """What stands before the numbers; to make it anew for each array takes longer than to copy them."""
    buffer = io.BytesIO()
    description = {"descr": np.lib.format.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(buffer, description)
    return buffer.getvalue()


def sample_key(index: int) -> str:
    """Name that all members of a sample share."""
    return f"{index:09d}"


class OtherBytesError(Exception):
    """A shard came out with another digest than it was to have."""


def write_shard(storage: Storage, name: str, samples: Iterable[Sample], wanted: str | None = None) -> tuple[int, str]:
    """Write a whole shard, each sample as it comes: plain tar, no times, no owners.

    A storage that is no folder gets the shard at once, so it is in memory before.

    Parameters
    ----------
    storage : Storage
    name : str
    samples : iterable of Sample
    wanted : str, optional
        Digest that the shard has to have to take the place of what is there.

    Returns
    -------
    size : int
        In bytes.
    sha256 : str

    Raises
    ------
    OtherBytesError
        When its digest is not ``wanted``: the file is as before.
    """
    entries = ((sample_key(sample.index), sample_members(sample)) for sample in samples)
    if isinstance(storage, FolderStorage):
        return write_tar(storage.folder / name, entries, wanted)
    file = io.BytesIO()  # a request that fails is made again with the same bytes
    written = _write_entries(file, entries, wanted)
    storage.write(name, file.getvalue())
    return written


def write_tar(
    path: Path, entries: Iterable[tuple[str, Mapping[str, bytes]]], wanted: str | None = None
) -> tuple[int, str]:
    """Write a tar file of entries, each a key and its members by suffix; otherwise as :func:`write_shard`."""
    with atomic_file(path) as file:
        return _write_entries(file, entries, wanted)


def _write_entries(
    file: BinaryIO, entries: Iterable[tuple[str, Mapping[str, bytes]]], wanted: str | None
) -> tuple[int, str]:
    size, digest = 0, hashlib.sha256()
    for key, members in entries:
        block = b"".join(_tar_member(f"{key}.{name}", data) for name, data in members.items())
        file.write(block)
        digest.update(block)
        size += len(block)
    # Two empty blocks end an archive, which fills whole records.
    end = bytes(-(size + 2 * tarfile.BLOCKSIZE) % tarfile.RECORDSIZE + 2 * tarfile.BLOCKSIZE)
    file.write(end)
    digest.update(end)
    if wanted not in (None, digest.hexdigest()):
        raise OtherBytesError
    return size + len(end), digest.hexdigest()


_EMPTY_HEADER = tarfile.TarInfo().tobuf(tarfile.USTAR_FORMAT)


def _tar_member(name: str, content: bytes) -> bytes:
    """Header and padded content; ``TarFile.addfile`` takes four times as long."""
    header = bytearray(_EMPTY_HEADER)
    header[: len(name)] = name.encode()
    header[124:135] = b"%011o" % len(content)
    header[148:156] = b" " * 8  # the checksum counts itself as blanks
    header[148:156] = b"%06o\0 " % sum(header)
    return b"".join((header, content, bytes(-len(content) % tarfile.BLOCKSIZE)))


def _open_file(path: Path, fix: str) -> tuple[BinaryIO, int]:
    if not path.is_file():  # to open a pipe would wait for somebody who writes to it
        raise DatasetError("is missing, or no file", path, fix)
    file = path.open("rb", buffering=0)
    return file, os.fstat(file.fileno()).st_size


class ShardReader:
    """Random access to the samples of one shard file. Once the file has been indexed, closing it loses nothing.

    Parameters
    ----------
    path : Path or str
        A str is a name for messages.
    fix : str
        What its errors advise.
    opener : callable, optional
        Opens the file, and says how large it is; by default that at ``path``.

    Raises
    ------
    DatasetError
        When the file is missing or is not a whole tar file.
    """

    def __init__(self, path: Path | str, fix: str = _AGAIN, opener: Callable[[], tuple[BinaryIO, int]] | None = None):
        self.path, self.fix = path, fix
        self._opener = opener or partial(_open_file, Path(path), fix)
        self._file: BinaryIO | None = None
        try:
            self._file, size = self._opener()
            self._index = read_index(self._file, size)
        except (tarfile.TarError, OSError, EOFError, ValueError) as error:
            self.close()
            raise DatasetError(f"cannot read the shard ({error})", path, fix) from error

    def __len__(self) -> int:
        return len(self._index)

    def keys(self) -> list[str]:
        """Sample keys in the order of the file."""
        return self._index.in_file_order()

    def read(self, key: str) -> Sample:
        """One sample by its key."""
        members = self._index.members(key)
        if not members:
            raise DatasetError(f"holds no sample {key}", self.path, self.fix)
        # Members of a sample stand side by side, each behind its header: one read takes them all.
        start = min(offset for _, offset, _ in members)
        end = max(offset + size for _, offset, size in members)
        if end - start <= sum(size + 2 * tarfile.BLOCKSIZE for _, _, size in members):
            block = self._bytes(start, end - start)
            contents = {suffix: block[offset - start : offset - start + size] for suffix, offset, size in members}
        else:
            contents = {suffix: self._bytes(offset, size) for suffix, offset, size in members}
        return sample_from_members(contents, f"{self.path}: sample {key}", self.fix)

    def _bytes(self, offset: int, size: int) -> bytes:
        try:
            self._file = self._file or self._opener()[0]
            self._file.seek(offset)
            content = self._file.read(size)
        except OSError as error:
            raise DatasetError(f"cannot read the shard ({error})", self.path, self.fix) from error
        if len(content) != size:
            raise DatasetError("the shard is cut short", self.path, self.fix)
        return content

    def suffixes(self, key: str) -> list[str]:
        """Members that a key has."""
        return [suffix for suffix, _, _ in self._index.members(key)]

    def member(self, key: str, suffix: str) -> bytes:
        """Content of one member.

        Raises
        ------
        DatasetError
            When there is none, or the file is cut short.
        """
        place = next((place for name, *place in self._index.members(key) if name == suffix), None)
        if place is None:
            raise DatasetError(f"holds no {key}.{suffix}", self.path, self.fix)
        return self._bytes(*place)

    @staticmethod
    def at(
        storage: Storage, name: str, size: int, sha256: str, fix: str = _AGAIN, in_memory: bool = False
    ) -> ShardReader:
        """A shard in a storage. One that is no folder is read as a whole once, and its checksum is compared.

        Parameters
        ----------
        storage : Storage
        name : str
        size : int
            That it has to have, bytes.
        sha256 : str
            That it has to have.
        fix : str
        in_memory : bool
            Keep it there until it is closed; else each sample is a request of just its bytes.
        """
        if isinstance(storage, FolderStorage):
            return ShardReader(storage.folder / name, fix)
        where, data = f"{storage.place}/{name}", storage.read(name, size)
        if len(data) != size or hashlib.sha256(data).hexdigest() != sha256:
            raise DatasetError("has another checksum than when it was written", where, fix)
        reader = ShardReader(where, fix, lambda: (io.BytesIO(data), size))
        if not in_memory:
            reader.close()
            reader._opener = partial(storage.open, name)
        return reader

    def close(self) -> None:
        """Close the file until it is next read."""
        if self._file is not None:
            self._file.close()
            self._file = None
