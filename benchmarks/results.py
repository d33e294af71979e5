"""Figures of the docs: ``python -m benchmarks.results`` (``make results``).

``results/NAME.json`` holds a command, the weights and families that its figures depend on with the digests that they
were measured with, the date, the machine, and the JSON object that the command printed; ``results/NAME.md`` what else
it printed. Commands run whose digests are not today's, or that have never run: the program says which, and how long
each took. Each result is written when it is there: stop it at any moment, the same command goes on. A new figure begins
with a JSON file with ``command``, ``weights`` and ``families``, whose digests are empty: ``{"laptop": ""}``.
"""

from __future__ import annotations

import json
import os
import platform
import subprocess
import sys
import sysconfig
import time
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import tyro

from artsim.common.files import read_json, write_atomic
from artsim.common.progress import say, track
from artsim.errors import ConfigError
from tests.digests import family_digest, weights_digest

ROOT = Path(__file__).resolve().parents[1]
FOLDER = ROOT / "results"
INDEX = FOLDER / "README.md"


@dataclass(frozen=True)
class Options:
    """Run the commands whose figures are missing or of older weights or families."""

    only: tuple[str, ...] = ()
    """Names of results to run, whatever their state."""
    list: bool = False
    """Run nothing; write the index, and print what would run."""
    folder: Path = FOLDER


@dataclass(frozen=True)
class Result:
    """One file of figures."""

    command: str
    """Line of a shell, run in the root of the repository."""
    weights: dict[str, str] = field(default_factory=dict)
    families: dict[str, str] = field(default_factory=dict)
    """Digests by name; "all" stands for all families."""
    date: str = ""
    machine: str = ""
    """Empty where it has never run. Of some only the docs that they come from are known."""
    figures: Any = None
    """The last line that the command printed."""

    def today(self) -> Result:
        """The same with the digests of today."""
        weights = {name: weights_digest(name) for name in self.weights}
        return replace(self, weights=weights, families={name: family_digest(name) for name in self.families})

    @property
    def older(self) -> list[str]:
        """Weights and families that are not those of today."""
        now = self.today()
        return [name for name in self.weights if self.weights[name] != now.weights[name]] + [
            f"family {name}" for name in self.families if self.families[name] != now.families[name]
        ]

    @property
    def state(self) -> str:
        """What the index says of it."""
        if not self.date:
            return "to be run"
        return f"older: {', '.join(self.older)}" if self.older else "of today's weights and families"


def read_results(folder: Path) -> dict[str, Result]:
    """All results, by name."""
    return {path.stem: Result(**read_json(path, "result")) for path in sorted(folder.glob("*.json"))}


def index(results: dict[str, Result]) -> str:
    """The page that lists them."""
    lines = [
        "# Results", "", "`make results` writes this folder: `make results ONLY=name` runs one command. The docs show",
        "the head of these tables. What is older was measured before the named weights or families changed.", "",
        "| result | date | state | command |", "|---|---|---|---|",
    ]  # fmt: skip
    for name, result in results.items():
        command = ", ".join(f"`{line}`" for line in result.command.replace("|", "\\|").splitlines())
        lines.append(f"| [{name}]({name}.md) | {result.date} | {result.state} | {command} |")
    return "\n".join(lines) + "\n"


def run(result: Result) -> tuple[Result, str]:
    """The result of a command as of now, and the page of what it printed.

    Raises
    ------
    ConfigError
        When the command fails.
    """
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    done = subprocess.run(
        ["bash", "-ec", result.command], cwd=ROOT, env={**os.environ, "PATH": path}, stdout=subprocess.PIPE, text=True
    )
    lines = done.stdout.rstrip().splitlines()
    if done.returncode or not lines:
        raise ConfigError(f"it ends with exit code {done.returncode}", result.command, "see what it prints above")
    try:
        figures = json.loads(lines[-1])
        lines.pop()
    except ValueError:
        figures = None
    now = datetime.now(timezone.utc).strftime("%Y-%m-%d")
    machine = (
        f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, Python {platform.python_version()}"
    )
    result = replace(result.today(), date=now, machine=machine, figures=figures)
    text = _without_places("\n".join(lines))
    return result, f"\n```\n{text}\n```\n" if "\n|" not in text else f"\n{text}\n"


def _without_places(text: str) -> str:
    """A text in which folders of this machine have the names that they have on any."""
    places = {
        sysconfig.get_path("purelib"): "site-packages",
        os.environ.get("ARTSIM_PARTNET_DIR", ""): "$ARTSIM_PARTNET_DIR",
    }
    for place, name in (places | {str(ROOT): "."}).items():
        text = text.replace(place, name) if place else text
    return text


def page(name: str, result: Result, text: str) -> str:
    """The Markdown file of a result."""
    command = "".join(f"    {line}\n" for line in result.command.splitlines())
    digests = ", ".join(f"{key} `{value}`" for key, value in result.weights.items())
    families = ", ".join(f"{key} `{value}`" for key, value in result.families.items())
    told = [f"{result.date}; {result.machine}."]
    told += [f"Weights: {digests}."] if digests else []
    told += [f"Families: {families}."] if families else []
    return f"# {name}\n\n{command}\n" + "\n\n".join(told) + "\n" + text


def store(folder: Path, name: str, result: Result, text: str) -> None:
    """Write both files of a result, the page first: what has no date is run again."""
    write_atomic(folder / f"{name}.md", page(name, result, text).encode())
    write_atomic(folder / f"{name}.json", (json.dumps(asdict(result), indent=1) + "\n").encode())


def main(options: Options) -> None:
    """Run, and write the index."""
    results = read_results(options.folder)
    if unknown := sorted(set(options.only) - results.keys()):
        raise ConfigError(f"there is no result {unknown[0]!r}", "--only", f"use some of {', '.join(results)}")
    chosen = options.only or tuple(name for name, one in results.items() if not one.date or one.older)
    failed = []
    for name in track("results", () if options.list else chosen, unit="result"):
        say(f"{name}: {results[name].command}")
        start = time.perf_counter()
        try:
            results[name], text = run(results[name])
        except ConfigError as error:  # one that needs what this machine lacks stops no other
            say(f"{name}: {error}")
            failed.append(name)
            continue
        store(options.folder, name, results[name], text)
        say(f"{name}: {time.perf_counter() - start:.0f} s")
    write_atomic(options.folder / INDEX.name, index(results).encode())
    print(json.dumps({"chosen": list(chosen), "failed": failed}))
    sys.exit(int(bool(failed)))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
