"""``artperl estimate`` of many clouds: which there are, and the record of each, in one process or several."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from artsim.datasets.dataset import open_dataset
from artsim.datasets.description import DESCRIPTION
from artsim.datasets.shards import ShardReader
from artsim.errors import ArtsimError, ConfigError, DatasetError

if TYPE_CHECKING:
    from artperl.core.estimate import Estimate as Result
    from artperl.inputs import Cloud, InputOptions
    from artperl.methods.protocol import Method

log = logging.getLogger(__name__)

_NAMED = 8
"""Files that are named where some are left out."""


@dataclass(frozen=True)
class Entry:
    """One cloud."""

    file: Path
    sample: str | None = None
    """Key of a sample, where the file is a shard; None of one that cannot be read."""


@dataclass(frozen=True)
class Clouds:
    """Clouds in files, and in shards of datasets."""

    files: tuple[Path, ...]
    shards: tuple[Path, ...]
    """The first hold one cloud each."""

    @staticmethod
    def of(paths: Sequence[Path], options: InputOptions, apart: Iterable[Path | None]) -> Clouds:
        """What there is to estimate in files and folders.

        Parameters
        ----------
        paths : sequence of Path
            Clouds, shards (.tar), datasets, and folders of clouds and shards. What else is in folders is said.
        options : InputOptions
        apart : iterable of Path or None
            Files that serve something else.

        Raises
        ------
        ConfigError
            When there is nothing.
        DatasetError
            When a dataset is not complete.
        """
        from artperl.inputs.reading import is_readable

        # Unlike Path.resolve(), this follows links in a circle no further.
        other = {os.path.realpath(path) for path in apart if path is not None}
        files, shards, skipped = list[Path](), list[Path](), list[Path]()
        for path in paths:
            if (path / DESCRIPTION).is_file():
                shards += [path / shard.name for shard in open_dataset(path).shards]
                continue
            inside = sorted(path.iterdir()) if path.is_dir() else [path]
            for file in inside:
                if path.is_dir() and (os.path.realpath(file) in other or file.name.startswith(".")):
                    continue
                if file.suffix == ".tar":
                    shards.append(file)
                elif not path.is_dir() or (file.is_file() and is_readable(file, options)):
                    files.append(file)
                else:
                    skipped.append(file)
        if skipped:
            names = ", ".join(path.name for path in skipped[:_NAMED]) + (", ..." if len(skipped) > _NAMED else "")
            kind = "clouds" if options.intrinsics is None else "depth images"
            log.info(f"note: left out, since they are no {kind}: {names}")
        if not files and not shards:
            hint = "" if options.intrinsics else "; depth images need --intrinsics camera.json"
            raise ConfigError(
                "there is no file to estimate", paths[0] if paths else None, f"name clouds, or a folder of them{hint}"
            )
        return Clouds(tuple(files), tuple(shards))

    def __len__(self) -> int:
        return len(self.files) + sum(len(_samples(shard)) for shard in self.shards)

    def __iter__(self) -> Iterator[Entry]:
        yield from map(Entry, self.files)
        for shard in self.shards:
            yield from (Entry(shard, key) for key in _samples(shard))


def _samples(shard: Path) -> list[str] | list[None]:
    """Keys of a shard; one that cannot be read counts as one cloud, whose record says why."""
    try:
        reader = _reader(shard)
    except DatasetError:
        return [None]
    reader.close()
    return reader.keys()


def _reader(shard: Path) -> ShardReader:
    """The reader of a shard as it is now."""
    return _reader_since(shard, shard.stat().st_mtime_ns if shard.is_file() else 0)


@lru_cache(maxsize=4)
def _reader_since(shard: Path, changed: int) -> ShardReader:
    return ShardReader(shard, "generate or download it again; artsim verify names what else is damaged")


def with_warnings(result: Result, cloud: Cloud) -> Result:
    """An estimate with what looks wrong with its file, too."""
    return replace(result, warnings=(*cloud.warnings, *result.warnings))


@dataclass(frozen=True)
class Estimating:
    """Makes, in each process, the function that gives the record of an entry."""

    load: Callable[[], Method]
    """Gives the estimator."""
    options: InputOptions
    """Of files; samples of shards are in metres in the camera frame."""

    def __call__(self) -> Callable[[Entry], dict[str, Any]]:
        return _Recorder(self.load(), self.options)


@dataclass(frozen=True)
class _Recorder:
    method: Method
    options: InputOptions

    def __call__(self, entry: Entry) -> dict[str, Any]:
        """The record; one with an ``error`` where there is no estimate."""
        from artperl.inputs import Cloud, read_cloud
        from artperl.methods.many import UNEXPECTED

        try:
            if entry.file.suffix != ".tar":
                cloud = read_cloud(entry.file, self.options)
            else:
                cloud = Cloud(_reader(entry.file).read(entry.sample or "").points.astype(np.float64))
            return with_warnings(self.method(cloud.points), cloud).to_dict() | {"notes": list(cloud.notes)}
        except (ArtsimError, OSError) as error:
            return {"error": str(error)}
        except UNEXPECTED as error:
            return {"error": f"{entry.file}: no estimate ({type(error).__name__}: {error})"}
