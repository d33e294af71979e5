"""Where a dataset lies: a folder, or a place that fsspec knows by its URL, such as ``s3://bucket/first``.

Names in a storage are relative and have ``/`` between their parts. A file is absent or whole. Object storage has no
locks, no links and cannot append: nothing here asks for them.
"""

import functools
import io
import logging
import os
import random
import re
import secrets
import shutil
import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, BinaryIO, Protocol, TypeAlias, TypeVar, cast

from artsim.common.extras import install_command, require_extra
from artsim.common.files import read_bounded, write_atomic, write_error
from artsim.errors import ArtsimError, ConfigError, DatasetError

log = logging.getLogger(__name__)

T = TypeVar("T")

_ATTEMPTS = 8
"""Of one request: a storage that fails every tenth one then fails once in a hundred million."""
_FIRST_PAUSE, _LONGEST_PAUSE = 0.1, 10.0
"""Seconds before the second attempt, doubled from then on; half of it is random: workers do not come together."""
_LONG = 2.0
"""Seconds after which somebody who waits for an answer is told what for."""
_OF_BUCKETS = ("s3", "s3a", "gs", "gcs", "az", "abfs", "oss")
"""Protocols whose first name is that of a bucket, or container."""
_MISSING = "restore it, or make the dataset again"
_WRITE = "be written", ConfigError


@functools.cache
def _say_waiting(place: str) -> None:
    """Say once in a process that a storage lets it wait."""
    log.info(f"waiting for {place}: a storage that does not answer is given up after {_ATTEMPTS} attempts")


class Storage(Protocol):
    """Files of a dataset, by name."""

    place: str
    """Folder or URL."""

    def __str__(self) -> str:
        return self.place

    def read(self, name: str, most: int) -> bytes:
        """Content of a file; a DatasetError where it is missing, unreadable or larger than ``most`` bytes."""

    def open(self, name: str) -> tuple[BinaryIO, int]:
        """A file to read from any place on, and its size in bytes; errors as of :meth:`read`."""

    def write(self, name: str, data: bytes) -> None:
        """Write a whole file; a ConfigError where that fails for good."""

    def write_new(self, name: str, data: bytes) -> None:
        """Write a whole file unless there is one: of several writers the first one wins, where the storage can tell."""

    def sizes(self, below: str = "") -> dict[str, int]:
        """Name and size in bytes of every file directly in a folder; a folder that is missing has none."""

    def copy(self, source: str, target: str) -> None:
        """Let a file be there under another name, too."""

    def remove(self, names: Iterable[str]) -> None:
        """Remove files; some may be gone already."""


Place: TypeAlias = "str | Path | Storage"


def is_url(place: object) -> bool:
    """Whether a place is for fsspec, which knows ``s3://``, ``gs://``, ``simplecache::s3://`` and others."""
    return isinstance(place, str) and "://" in place


def storage_of(place: Place) -> Storage:
    """The storage at a folder or URL; ``file://`` is a folder, too, such as one on a disk that several nodes share.

    Raises
    ------
    ConfigError
        When fsspec does not know the protocol, or a module for it is not installed.
    """
    if isinstance(place, str):
        if place.startswith("file://"):
            return FolderStorage(Path(place.removeprefix("file://")))
        return UrlStorage(place) if is_url(place) else FolderStorage(Path(place))
    if isinstance(place, Path):
        if re.match(r"[a-z0-9]{2,}:/[^/]", str(place)):  # of two slashes, a path keeps one
            raise ConfigError("this wants a folder, not a URL", place, "copy the dataset to a disk")
        return FolderStorage(place)
    return place


class FolderStorage(Storage):
    """Files of a folder."""

    def __init__(self, folder: Path):
        self.folder, self.place = folder, str(folder)

    def read(self, name: str, most: int) -> bytes:
        return read_bounded(self.folder / name, most, Path(name).name, DatasetError, fix=_MISSING)

    def open(self, name: str) -> tuple[BinaryIO, int]:
        path = self.folder / name
        if not path.is_file():  # to open a pipe would wait for somebody who writes to it
            raise DatasetError("is missing, or no file", path, _MISSING)
        try:
            file = path.open("rb")
        except OSError as error:
            raise DatasetError(f"cannot be read ({error.strerror})", path, "correct its permissions") from error
        return file, os.fstat(file.fileno()).st_size

    def write(self, name: str, data: bytes) -> None:
        write_atomic(self.folder / name, data)

    def write_new(self, name: str, data: bytes) -> None:
        path = self.folder / name
        part = path.with_name(f".{path.name}.{secrets.token_hex(6)}.part")  # processes of several nodes share numbers
        try:
            write_atomic(part, data)
            os.link(part, path)  # fails where there is one
        except FileExistsError:
            pass
        except OSError as error:
            if path.exists():
                return
            try:  # a disk without links
                part.replace(path)
            except OSError:
                raise write_error(error, path) from error
        finally:
            part.unlink(missing_ok=True)

    def sizes(self, below: str = "") -> dict[str, int]:
        found = {}
        try:
            with os.scandir(self.folder / below) as entries:
                for entry in entries:
                    if entry.is_file(follow_symlinks=False):
                        found[entry.name] = entry.stat().st_size
        except (FileNotFoundError, NotADirectoryError):
            return {}
        except OSError as error:
            raise DatasetError(
                f"cannot be listed ({error.strerror})", self.folder / below, "correct its permissions"
            ) from error
        return found

    def copy(self, source: str, target: str) -> None:
        path = self.folder / target
        part = path.with_name(f".{path.name}.{secrets.token_hex(6)}.part")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            try:
                os.link(self.folder / source, part)
            except OSError:  # a disk without links
                shutil.copyfile(self.folder / source, part)
            part.replace(path)
            part.unlink(missing_ok=True)  # of two links to one file, POSIX keeps both
        except OSError as error:
            part.unlink(missing_ok=True)
            raise write_error(error, path) from error

    def remove(self, names: Iterable[str]) -> None:
        """Folders that are empty then go, too."""
        folders = set()
        for name in names:
            (self.folder / name).unlink(missing_ok=True)
            folders.add((self.folder / name).parent)
        for folder in sorted(folders - {self.folder}, key=lambda path: -len(path.parts)):
            for empty in (folder, *folder.parents):
                if empty == self.folder or not empty.is_dir() or any(empty.iterdir()):
                    break
                empty.rmdir()


class UrlStorage(Storage):
    """Files below a URL of fsspec. Requests that fail are made again, with longer and longer pauses.

    Parameters
    ----------
    url : str
        Options, such as an endpoint or credentials, come from the environment, as fsspec and its file systems take
        them: ``AWS_ENDPOINT_URL``, ``AWS_ACCESS_KEY_ID``, ``FSSPEC_S3_ANON`` and others.
    """

    def __init__(self, url: str):
        protocol, _, rest = url.rpartition("://")
        if not rest.strip("/") or (rest.startswith("/") and protocol.rpartition("::")[2] in _OF_BUCKETS):
            raise ConfigError("it names no bucket", url, f"write {protocol}://BUCKET/NAME")
        self.place = url.rstrip("/")
        self._opened: tuple[int, Any, str] | None = None
        self._system()  # what is missing is said at once

    def __getstate__(self) -> dict[str, Any]:
        return {"place": self.place, "_opened": None}

    def _system(self) -> tuple[Any, str]:
        """The file system, and the path in it; anew in each process, for connections do not outlive a fork."""
        if self._opened is None or self._opened[0] != os.getpid():
            with require_extra(f"datasets at {self.place}", extra="storage"):
                import fsspec
            try:
                system, path = fsspec.core.url_to_fs(self.place)
            except ImportError as error:  # of the file system itself
                raise ConfigError(str(error), self.place, install_command("storage")) from error
            except ValueError as error:
                raise ConfigError(f"fsspec cannot open it ({error})", self.place, "use s3://BUCKET/NAME") from error
            self._opened = os.getpid(), system, path.rstrip("/")
        return self._opened[1], self._opened[2]

    def _path(self, name: str) -> str:
        path = self._system()[1]
        return f"{path}/{name}" if name else path

    def _try(
        self, name: str, work: Callable[[], T], doing: str = "be read", kind: type[ArtsimError] = DatasetError
    ) -> T:
        """Do something with a file, again after a while where it fails; one word of it where that takes long."""
        waiting = threading.Timer(_LONG, _say_waiting, [self.place])
        waiting.daemon = True
        waiting.start()
        try:
            return self._attempts(name, work, doing, kind)
        finally:
            waiting.cancel()

    def _attempts(self, name: str, work: Callable[[], T], doing: str, kind: type[ArtsimError]) -> T:
        for attempt in range(_ATTEMPTS):
            try:
                return work()
            except ConfigError:
                raise
            except FileNotFoundError as error:
                if kind is DatasetError:
                    raise DatasetError("is missing", f"{self.place}/{name}", _MISSING) from error
                reason: Exception = error  # a bucket that is not there
                break
            except PermissionError as error:
                reason = error
                break
            except OSError as error:
                reason = error
            except Exception as error:  # what botocore and other clients raise is of no common family
                reason = error
                if "Credentials" in type(error).__name__:  # botocore's; no later attempt finds any
                    break
            if attempt + 1 < _ATTEMPTS:
                why = f"cannot {doing} ({type(reason).__name__})"
                log.info(f"{self.place}/{name}: {why}; attempt {attempt + 2} of {_ATTEMPTS}")
                pause = min(_LONGEST_PAUSE, _FIRST_PAUSE * 2.0**attempt)
                time.sleep(pause * random.uniform(0.5, 1.0))
        text = f"{type(reason).__name__}: {reason}"
        again = "try again" if kind is DatasetError else "rerun the command to resume"
        fix = f"restore the access to the storage, and {again}"
        raise kind(f"cannot {doing} ({text:.300})", f"{self.place}/{name}", fix) from reason

    def read(self, name: str, most: int) -> bytes:
        data = self.range(name, 0, most + 1)  # to ask for the size before would be another request
        if len(data) > most:
            raise DatasetError(f"is over the limit of {most / 1e6:.0f} MB", f"{self.place}/{name}", _MISSING)
        return data

    def open(self, name: str) -> tuple[BinaryIO, int]:
        """Each read is a request of just these bytes."""
        size = int(self._try(name, lambda: self._system()[0].info(self._path(name))["size"]))
        return cast(BinaryIO, _Ranges(self, name, size)), size

    def range(self, name: str, start: int, end: int) -> bytes:
        """Bytes ``start`` to ``end`` (exclusive) of a file."""
        data: bytes = self._try(name, lambda: self._system()[0].cat_file(self._path(name), start=start, end=end))
        return data

    def write(self, name: str, data: bytes) -> None:
        self._try(name, lambda: self._system()[0].pipe_file(self._path(name), data), *_WRITE)

    def write_new(self, name: str, data: bytes) -> None:

        def work() -> None:
            try:
                self._system()[0].pipe_file(self._path(name), data, mode="create")
            except FileExistsError:
                pass
            except (TypeError, NotImplementedError):  # a file system that cannot tell
                self._system()[0].pipe_file(self._path(name), data)

        self._try(name, work, *_WRITE)

    def sizes(self, below: str = "") -> dict[str, int]:

        def work() -> dict[str, int]:
            try:
                self._system()[0].invalidate_cache()  # others write, too
                entries = self._system()[0].ls(self._path(below), detail=True)
            except FileNotFoundError:  # a bucket that is not there is said before anything is made: no write makes one
                system, path = self._system()
                bucket = path.partition("/")[0]
                if self.place.rpartition("://")[0].rpartition("::")[2] in _OF_BUCKETS and not system.exists(bucket):
                    raise ConfigError(
                        f"there is no bucket {bucket}", self.place, "make it, or correct its name"
                    ) from None
                return {}
            return {e["name"].rstrip("/").rpartition("/")[2]: int(e["size"]) for e in entries if e["type"] == "file"}

        return self._try(below, work, "be listed")

    def copy(self, source: str, target: str) -> None:
        self._try(target, lambda: self._system()[0].copy(self._path(source), self._path(target)), *_WRITE)

    def remove(self, names: Iterable[str]) -> None:
        system, paths = self._system()[0], [self._path(name) for name in names]
        for first in range(0, len(paths), 1000):  # so many are one request to S3
            piece = paths[first : first + 1000]

            def work(piece: list[str] = piece) -> None:
                try:
                    system.rm(piece)
                except FileNotFoundError:
                    for path in piece:
                        if system.exists(path):
                            system.rm_file(path)

            self._try("", work, *_WRITE)


class _Ranges(io.RawIOBase):
    """A file at a URL of which only what is read is requested."""

    def __init__(self, storage: UrlStorage, name: str, size: int):
        self._storage, self._name, self._size, self._at = storage, name, size, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def tell(self) -> int:
        return self._at

    def seek(self, offset: int, whence: int = io.SEEK_SET) -> int:
        self._at = max(0, offset + (0, self._at, self._size)[whence])
        return self._at

    def read(self, size: int = -1) -> bytes:
        end = self._size if size < 0 else min(self._at + size, self._size)
        if end <= self._at:
            return b""
        data = self._storage.range(self._name, self._at, end)
        self._at += len(data)
        return data
