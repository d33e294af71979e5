"""A file of JSON lines, one for each file that was worked on, that the same command goes on with."""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from artsim.common.files import write_error
from artsim.errors import ConfigError


class Lines:
    """Lines to be written, to standard output or to a file.

    Parameters
    ----------
    path : Path or None
        None for standard output.
    setup : dict
        Everything that the lines depend on, but for the files. Lines of another setup are not gone on with.

    Raises
    ------
    ConfigError
        When the file is of another setup, of something else, or cannot be written.
    """

    def __init__(self, path: Path | None, setup: dict[str, Any]):
        self.path = path
        self._setup = hashlib.sha256(json.dumps(setup, sort_keys=True, default=str).encode()).hexdigest()[:12]
        self._done: dict[str, tuple[str, float | None]] = {}
        self._file: TextIO = sys.stdout

    def __enter__(self) -> Lines:
        if self.path is None:
            return self
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            kept = self._whole_lines() if self.path.exists() else 0
            self._file = self.path.open("a", encoding="utf-8")
            self._file.truncate(kept)  # a line that a stop has cut off
        except OSError as error:
            raise write_error(error, self.path) from error
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self.path is not None:
            self._file.close()

    def done(self) -> frozenset[str]:
        """Names (:func:`line_name`) that have a line, without an error, and whose file has not changed since."""
        now = {file: _modification_time(Path(file)) for file, _ in self._done.values()}
        return frozenset(name for name, (file, changed) in self._done.items() if now[file] == changed)

    def write(self, file: Path, record: dict[str, Any], sample: str | None = None) -> None:
        """Add the line of a file, or of a sample in it; it is on the disk, or sent on, when this returns."""
        own = {} if sample is None else {"sample": sample}
        line = {"file": str(file), **own, **record, "setup": self._setup, "changed": _modification_time(file)}
        try:
            self._file.write(json.dumps(line) + "\n")
            self._file.flush()
        except BrokenPipeError:
            raise
        except OSError as error:
            raise write_error(error, self.path or Path("-")) from error

    def _whole_lines(self) -> int:
        """Bytes of the whole lines that there are."""
        assert self.path is not None
        size = 0
        with self.path.open("rb") as file:
            for raw in file:
                if not raw.endswith(b"\n"):
                    break
                try:
                    line = json.loads(raw)
                    file_name, setup, changed = line["file"], line["setup"], line["changed"]
                    name = line_name(Path(file_name), line.get("sample"))
                except (ValueError, KeyError, TypeError, RecursionError):
                    raise ConfigError("it holds something else", self.path, "name another file for --out") from None
                if setup != self._setup:
                    raise ConfigError(
                        "it was written with other options", self.path, "name another file for --out, or remove it"
                    )
                size += len(raw)
                self._done.pop(name, None)
                if "error" not in line:
                    self._done[name] = file_name, changed
        return size


def line_name(file: Path, sample: str | None) -> str:
    """What tells the line of a file, or of a sample in it, from others."""
    return str(file) if sample is None else f"{file}#{sample}"


def _modification_time(file: Path) -> float | None:
    try:
        return file.stat().st_mtime
    except OSError:
        return None
