"""Scenes on disk, read back: folders of views, or tar shards, and the description that lists them. All is untrusted."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import orjson
from numpy.typing import NDArray

from artsim.common.array_files import parse_npy
from artsim.common.files import open_image, read_bounded, read_json
from artsim.common.json_records import Pixels, as_type, from_json_values
from artsim.datasets.shards import MAX_PIXELS, ShardReader, sample_from_members
from artsim.errors import DatasetError
from artsim.model.camera import Camera
from artsim.observing.sample import Sample

FORMAT = 1
DESCRIPTION = "scenes.json"
_MAX_VIEWS = 1_000_000
_MAX_FILE = 1 << 28
_MOST_OPEN = 200
"""Shards whose index is kept, each with a file handle: what shuffled reading of some thousand scenes takes."""
_KEY, _FILE = re.compile(r"[0-9]{6,12}_[0-9]{1,6}"), re.compile(r"[0-9]{6,12}_[0-9]{1,6}|scenes-[0-9]{6,12}\.tar")
_Corner = Annotated[int, range(8193)]
_AGAIN = "rerun the artsim scene command: it regenerates damaged files"


@dataclass(frozen=True)
class ViewObject:
    """What the description says of an articulated object in a view."""

    category: str
    object_id: str
    parts: Annotated[int, range(1, 256)]
    visible_fraction: float
    """Of its pixels, 0 where all of it is hidden."""
    box: tuple[_Corner, _Corner, _Corner, _Corner]
    """First column and row, end column and row of its visible pixels."""


@dataclass(frozen=True)
class ViewEntry:
    """A view in the description: its key, its scene's seed, its camera's number, its file or folder, its objects."""

    key: Annotated[str, _KEY]
    scene: Annotated[int, range(2**62 + 1)]
    view: Annotated[int, range(2**31 + 1)]
    file: Annotated[str, _FILE]
    objects: Annotated[tuple[ViewObject, ...], range(256)]


class SceneRecord:
    """One view of a scene, read when asked for.

    Attributes
    ----------
    entry : ViewEntry
    camera : Camera
    rgb : (H, W, 3) uint8 or None
        None where the renderer makes no colour.
    depth : (H, W) float32
        z-depth in metres as the sensor reports it, 0 = no return.
    instance_ids, part_ids : (H, W) uint8
        See :class:`artsim.renderers.scene.SceneFrame`.
    samples : tuple of (Sample or None)
        Ground truth of each articulated object; None where nothing of it is seen.
    """

    def __init__(self, dataset: SceneDataset, entry: ViewEntry):
        self._dataset, self.entry = dataset, entry

    def __repr__(self) -> str:
        seen = ", ".join(f"{o.category} {100 * o.visible_fraction:.0f}%" for o in self.entry.objects)
        return f"<SceneRecord {self.entry.key}: {seen}>"

    @cached_property
    def rgb(self) -> NDArray[np.uint8] | None:
        return self._image("rgb.png") if self._dataset.has_member(self.entry, "rgb.png") else None

    @cached_property
    def depth(self) -> NDArray[np.float32]:
        try:
            depth = parse_npy(self._read("depth.npy"))
        except ValueError as error:
            raise self._damage(f"depth.npy: {error}") from error
        self._check("depth.npy", depth, np.float32)
        return depth

    @cached_property
    def instance_ids(self) -> NDArray[np.uint8]:
        return self._image("instance_ids.png")

    @cached_property
    def part_ids(self) -> NDArray[np.uint8]:
        return self._image("part_ids.png")

    @cached_property
    def camera(self) -> Camera:
        try:
            own = orjson.loads(self._read("scene.json"))["camera"]
            width, height = (as_type(Pixels, own[name], name) for name in ("width", "height"))
            return Camera(np.array(own["K"], np.float64), width, height, np.array(own["T_world_camera"], np.float64))
        except (ValueError, KeyError, TypeError) as error:
            raise self._damage(f"scene.json: {error}") from error

    @cached_property
    def samples(self) -> tuple[Sample | None, ...]:
        return tuple(self._sample(i) for i in range(len(self.entry.objects)))

    def _sample(self, i: int) -> Sample | None:
        names = ("json", "points.npy", "part.npy", "npcs.npy", "part_mask.png")
        if not self._dataset.has_member(self.entry, f"instance_{i}.json"):
            return None
        members = {name: self._read(f"instance_{i}.{name}") for name in names}
        return sample_from_members(members, f"{self._dataset.folder}: {self.entry.key}, object {i}", _AGAIN)

    def _image(self, name: str) -> NDArray[np.uint8]:
        image = np.asarray(open_image(self._read(name), name, DatasetError, MAX_PIXELS))
        self._check(name, image, np.uint8)
        return image

    def _check(self, name: str, image: NDArray[Any], kind: type) -> None:
        shape = (self.camera.height, self.camera.width, *((3,) if name == "rgb.png" else ()))
        if image.shape != shape or image.dtype != kind:
            raise self._damage(f"{name} is {image.dtype} of shape {image.shape}")

    def _read(self, name: str) -> bytes:
        return self._dataset.read_member(self.entry, name)

    def _damage(self, what: str) -> DatasetError:
        return DatasetError(f"view {self.entry.key} is damaged ({what})", self._dataset.folder, _AGAIN)


class SceneDataset:
    """The views of a set of scenes: ``len(ds)``, ``ds[i]``, iteration.

    Parameters
    ----------
    folder : path
        That ``artsim scene`` wrote.

    Raises
    ------
    DatasetError
        When the folder holds no complete set of scenes.
    """

    def __init__(self, folder: str | Path):
        self.folder = Path(folder)
        path = self.folder / DESCRIPTION
        if not path.exists():
            raise DatasetError(
                f"no complete set of scenes is here (no {DESCRIPTION})", self.folder,
                f"run artsim scene --out {self.folder}, or the same command again if it was stopped",
            )  # fmt: skip
        self.description: dict[str, Any] = read_json(path, DESCRIPTION, DatasetError)
        try:
            self.entries = _entries(self.description)
        except (ValueError, KeyError, TypeError) as error:
            raise DatasetError(f"{DESCRIPTION} is damaged ({error})", self.folder, _AGAIN) from error
        self._readers: dict[str, ShardReader] = {}

    def __len__(self) -> int:
        return len(self.entries)

    def __getitem__(self, i: int) -> SceneRecord:
        return SceneRecord(self, self.entries[i])

    def __iter__(self) -> Iterator[SceneRecord]:
        return (self[i] for i in range(len(self)))

    def __repr__(self) -> str:
        return f"<SceneDataset {str(self.folder)!r}: {len(self)} views>"

    @property
    def categories(self) -> tuple[str, ...]:
        """Categories of the articulated objects, in alphabetical order."""
        return tuple(sorted({obj.category for entry in self.entries for obj in entry.objects}))

    def has_member(self, entry: ViewEntry, name: str) -> bool:
        """Whether a view has a file."""
        if entry.file.endswith(".tar"):
            return name in self._reader(entry.file).suffixes(entry.key)
        return (self.folder / entry.file / name).is_file()

    def read_member(self, entry: ViewEntry, name: str) -> bytes:
        """Content of a file of a view."""
        if entry.file.endswith(".tar"):
            return self._reader(entry.file).member(entry.key, name)
        return read_bounded(self.folder / entry.file / name, _MAX_FILE, name, DatasetError, self.folder, _AGAIN)

    def _reader(self, file: str) -> ShardReader:
        if file not in self._readers:
            if len(self._readers) >= _MOST_OPEN:
                self._readers.pop(next(iter(self._readers))).close()
            self._readers[file] = ShardReader(self.folder / file, _AGAIN)
        return self._readers[file]


def open_scenes(folder: str | Path) -> SceneDataset:
    """Open the scenes that ``artsim scene`` wrote; see :class:`SceneDataset`."""
    return SceneDataset(folder)


def _entries(description: Any) -> tuple[ViewEntry, ...]:
    document = as_type(dict, description, "it")
    if document["format"] != FORMAT:
        raise ValueError(f"format {document['format']!r:.20} is not {FORMAT}")
    pieces = as_type(Annotated[list, range(_MAX_VIEWS + 1)], document["pieces"], "pieces")
    views = [view for piece in pieces for view in as_type(Annotated[list, range(_MAX_VIEWS + 1)], piece[2], "views")]
    return tuple(from_json_values(ViewEntry, view) for view in views)
