"""Figures of the docs, and the weights and families that they were measured with: ``docs/figures.json``.

A figure is what a command prints and a page shows: in tables below the command, or in its own row of a table. After it
was measured anew, ``python -m tests.figures --record PAGE COMMAND`` writes today's digests into its record. Nothing
writes all of them. A new figure begins with a line of the file whose digests are empty: ``{"laptop": ""}``.
"""

from __future__ import annotations

import hashlib
import json
import re
import shlex
import sys
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import cache
from pathlib import Path

from artperl.methods.estimator_files import WEIGHTS
from tests.conftest import ROOT
from tests.reproduce import RECORD as REPRODUCED
from tests.reproduce import sha256

RECORD = ROOT / "docs" / "figures.json"
OLDER = re.compile(r"\bolder (?:weights|families)\b")
"""What a page says of a figure that is not of today's."""
LOADERS = re.compile(r"\b(?:load_estimator|find_estimator|run_comparison)\b")
MODULES = sorted(path.stem for path in (ROOT / "benchmarks").glob("*.py") if LOADERS.search(path.read_text()))
LOADS = re.compile(rf"artperl (?:evaluate|report|detections) |python -m benchmarks\.(?:{'|'.join(MODULES)})\b")
"""Commands that load weights that come with the package."""


@dataclass(frozen=True)
class Figure:
    """Command, page, and digests of what the figure depends on, by name."""

    page: str
    command: str
    weights: dict[str, str]
    families: dict[str, str]

    def today(self) -> Figure:
        """The same figure as it would be recorded now."""
        return replace(
            self,
            weights={name: weights_digest(WEIGHTS / name) for name in self.weights},
            families={name: family_digest(name) for name in self.families},
        )

    def changed(self) -> list[str]:
        """Weights and families that are not those that it was measured with."""
        now = self.today()
        return [
            f"{what} {name}"
            for what, then, new in (("weights", self.weights, now.weights), ("family", self.families, now.families))
            for name in then
            if then[name] != new[name]
        ]

    def complaint(self, page: str) -> str:
        """What is wrong with it on a page of this text; empty where nothing is."""
        places = [(heading, text) for heading, command, text in commands(page) if command == self.command]
        if not places:
            return f"{self.page} has no command {self.command!r}. Fix: mend or remove its line in {RECORD.name}"
        (heading, text), changed = places[0], self.changed()
        if bool(changed) == bool(OLDER.search(text)):
            return ""
        where = f"{self.page}, {heading!r}: {self.command}"
        if not changed:
            return f"{where}\nis of today's weights and families. Fix: remove 'older weights' or 'older families'"
        return (
            f"{where}\nwas measured before these changed: {', '.join(changed)}. Fix: run it and mend the page, then\n"
            f"python -m tests.figures --record {self.page} {shlex.quote(self.command)}\n"
            "or say that it is of 'older weights' or 'older families'"
        )


@cache
def weights_digest(folder: Path) -> str:
    """Of networks, references and settings; not of what the settings tell about their training."""
    digest = hashlib.sha256()
    for path in sorted(folder.iterdir()):
        content = path.read_bytes()
        if path.suffix == ".json":
            settings = {name: value for name, value in json.loads(content).items() if name not in ("about", "format")}
            content = json.dumps(settings, sort_keys=True).encode()
        digest.update(hashlib.sha256(content).digest())
    return digest.hexdigest()[:12]


@cache
def family_digest(name: str) -> str:
    """Of trees and boxes of a family's objects, or of "all" families, as every processor makes them."""
    digests = json.loads(REPRODUCED.read_text(encoding="utf-8"))["families"]
    return sha256(json.dumps(digests).encode())[:12] if name == "all" else digests[name]


def commands(page: str) -> Iterator[tuple[str, str, str]]:
    """Heading, command and what belongs to it: its row of a table, or all until the next heading or commands."""
    page = re.sub(r"^```.*?^```$", "", re.sub(r"\s*\\\n\s+", " ", page), flags=re.M | re.S)
    heading = ""
    for block in re.split(r"^(?=#)|\n\n(?=    \S)", page, flags=re.M):
        if block.startswith("#"):
            heading = block.splitlines()[0].strip("# ")
        for line in block.splitlines():
            if line.startswith("    "):
                yield heading, re.sub(r"\s+# .*", "", line.strip()), block
            for quoted in re.findall(r"`([^`]+)`", line):
                yield heading, quoted, line if line.startswith("|") else block


def without_record(page: str, recorded: Iterable[str]) -> list[str]:
    """Commands of a page that load weights and print a table or a row of one, but have none of the records."""
    return [
        f"{heading!r}: {command}"
        for heading, command, text in commands(page)
        if LOADS.match(command + " ")
        and command not in recorded
        and (text.endswith(f"`{command}` |") or (f"    {command}" in text and "\n|" in text))
    ]


def read_figures() -> list[Figure]:
    return [Figure(**record) for record in json.loads(RECORD.read_text(encoding="utf-8"))]


def lines_of(figures: Iterable[Figure]) -> str:
    """The file: one line a figure."""
    return "[\n" + ",\n".join(json.dumps(asdict(figure)) for figure in figures) + "\n]\n"


def recorded_anew(figures: Iterable[Figure], page: str, command: str) -> list[Figure]:
    """All figures, one of them with today's digests."""
    return [figure.today() if (figure.page, figure.command) == (page, command) else figure for figure in figures]


def main() -> None:
    """Write today's digests for one figure."""
    figures = read_figures()
    match sys.argv[1:]:
        case "--record", page, command if any((f.page, f.command) == (page, command) for f in figures):
            RECORD.write_text(lines_of(recorded_anew(figures, page, command)), encoding="utf-8")
        case _:
            sys.exit("use: python -m tests.figures --record PAGE COMMAND, as docs/figures.json has them")


if __name__ == "__main__":
    main()
