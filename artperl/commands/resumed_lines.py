"""A file of JSON lines, one for each file that was worked on, that the same command resumes."""

from __future__ import annotations

import hashlib
import io
import json
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from artsim.common.files import atomic_file, write_error
from artsim.common.outputs import check_output
from artsim.errors import ConfigError
from artsim.runs.lock import file_lock


class Lines:
    """Lines to be written, to standard output or to a file.

    Parameters
    ----------
    path : Path or None
        None for standard output.
    setup : dict
        Everything that the lines depend on, but for the files. Lines of another setup are refused.

    Raises
    ------
    ConfigError
        When the file is of another setup, of something else, written by another process, or cannot be written.
    """

    def __init__(self, path: Path | None, setup: dict[str, Any]):
        self.path = path
        self._setup = hashlib.sha256(json.dumps(setup, sort_keys=True, default=str).encode()).hexdigest()[:12]
        self._done: dict[str, tuple[str, float | None]] = {}
        self._failed: dict[str, str] = {}
        self._outdated = False
        self._file: IO[bytes] = io.BytesIO()
        self._lock = ExitStack()

    def __enter__(self) -> Lines:
        if self.path is None:
            return self
        check_output(self.path)
        with self._lock:
            try:
                self.path.parent.mkdir(parents=True, exist_ok=True)
                self._file = self._lock.enter_context(self.path.open("a+b"))
                self._lock.enter_context(file_lock(self._file, self.path))
                self._file.truncate(self._whole_lines())  # a line that a stop has cut off
            except OSError as error:
                raise write_error(error, self.path) from error
            self._lock = self._lock.pop_all()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        with self._lock:
            if self._outdated:
                self._keep_last()

    def done(self) -> frozenset[str]:
        """Names (:func:`line_name`) that have a line, without an error, and whose file has not changed since."""
        now = {file: _modification_time(Path(file)) for file, _ in self._done.values()}
        return frozenset(name for name, (file, changed) in self._done.items() if now[file] == changed)

    def write(self, file: Path, record: dict[str, Any], sample: str | None = None) -> None:
        """Add the line of a file, or of a sample in it; it is on the disk, or sent on, when this returns.

        What failed before, and fails again in the same way, has its line already.
        """
        own = {} if sample is None else {"sample": sample}
        line = {"file": str(file), **own, **record, "setup": self._setup, "changed": _modification_time(file)}
        text, name = json.dumps(line), line_name(file, sample)
        if self._failed.get(name) == text:
            return
        self._outdated |= name in self._failed or name in self._done
        try:
            if self.path is None:
                print(text, flush=True)
                return
            self._file.write(f"{text}\n".encode())
            self._file.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise write_error(error, self.path or Path("-")) from error

    def _whole_lines(self) -> int:
        """Bytes of the whole lines that there are."""
        assert self.path is not None
        size = 0
        self._file.seek(0)
        for raw in self._file:
            if not raw.endswith(b"\n"):
                break
            line, name = self._parsed(raw)
            if line["setup"] != self._setup:
                raise ConfigError(
                    "it was written with other options", self.path, "name another file for --out, or remove it"
                )
            size += len(raw)
            self._outdated |= name in self._done or name in self._failed
            self._done.pop(name, None)
            self._failed.pop(name, None)
            if "error" in line:
                self._failed[name] = raw.decode().removesuffix("\n")
            else:
                self._done[name] = line["file"], line["changed"]
        return size

    def _parsed(self, raw: bytes) -> tuple[dict[str, Any], str]:
        """A line, and what it is the line of."""
        try:
            line = json.loads(raw)
            name = line_name(Path(line["file"]), line.get("sample"))
            return {"setup": line["setup"], "changed": line["changed"], **line}, name
        except (ValueError, KeyError, TypeError, RecursionError):
            raise ConfigError("it holds something else", self.path, "name another file for --out") from None

    def _keep_last(self) -> None:
        """Leave out lines that have a later one of the same name."""
        assert self.path is not None
        self._file.seek(0)
        last = {self._parsed(raw)[1]: number for number, raw in enumerate(self._file)}
        self._file.seek(0)
        with atomic_file(self.path) as file:
            for number, raw in enumerate(self._file):
                if last[self._parsed(raw)[1]] == number:
                    file.write(raw)


def line_name(file: Path, sample: str | None) -> str:
    """What tells the line of a file, or of a sample in it, from others."""
    return str(file) if sample is None else f"{file}#{sample}"


def _modification_time(file: Path) -> float | None:
    try:
        return file.stat().st_mtime
    except OSError:
        return None
