"""What a run has finished, line by line: the journal of a folder that is not complete yet."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import orjson

from artsim.common.files import append, read_bounded, write_atomic
from artsim.errors import DatasetError

JOURNAL = "progress.jsonl"
_MAX_BYTES = 4_000_000_000


class Journal:
    """A file of JSON lines.

    Parameters
    ----------
    path : Path
    """

    def __init__(self, path: Path):
        self.path = path

    def lines(self) -> list[Any]:
        """Values of the lines. The last line of a killed run may be cut short: it is left out, as other damaged ones.

        Raises
        ------
        DatasetError
            When the file cannot be read.
        """
        if not self.path.exists():
            return []
        values = []
        for line in read_bounded(self.path, _MAX_BYTES, self.path.name, DatasetError, fix="remove it").splitlines():
            try:
                values.append(orjson.loads(line))
            except ValueError:
                continue
        return values

    def start(self, values: Iterable[Any]) -> None:
        """Write the whole journal anew."""
        write_atomic(self.path, b"".join(map(_line, values)))

    def add(self, value: Any) -> None:
        """Add a line."""
        append(self.path, _line(value))

    def remove(self) -> None:
        """Remove the journal, if there is one."""
        self.path.unlink(missing_ok=True)


def _line(value: Any) -> bytes:
    try:
        return orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY) + b"\n"
    except TypeError:  # a file's name that is no text
        return json.dumps(value).encode() + b"\n"
