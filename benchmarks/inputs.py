"""Load rate over other people's files: ``python -m benchmarks.inputs FOLDER...``.

Every ``*.urdf`` below the folders is loaded as given, with no package root declared, each in a worker process under a
time limit. One line for each failure says why, then failures are counted by kind. The last line is one JSON object:
``{"files", "loaded", "reasons"}``.
"""

from __future__ import annotations

import json
import multiprocessing
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

import tyro

from artsim import load
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError


@dataclass(frozen=True)
class Options:
    """Load every URDF file below some folders, and say what does not load and why."""

    folders: tyro.conf.Positional[tuple[Path, ...]]
    """Folders to look through, or URDF files."""
    seconds: float = 60.0
    """Time limit of each file."""
    repairs: bool = False
    """Also list what was assumed or left out while loading, by file."""


@dataclass(frozen=True)
class Outcome:
    """What came of a file: the error it ended with (None when it loaded), and the repairs made."""

    file: Path
    error: str | None
    repairs: tuple[str, ...] = ()


def main(options: Options) -> None:
    """Load and print."""
    files = urdf_files(options.folders)
    outcomes = []
    for outcome in track("files", load_all(files, options.seconds), total=len(files), unit="file"):
        outcomes.append(outcome)
    failed = [outcome for outcome in outcomes if outcome.error is not None]
    for outcome in failed:
        print(f"does not load: {outcome.error}")
    if options.repairs:
        for outcome in outcomes:
            for repair in outcome.repairs:
                print(f"{outcome.file}: {repair}")
    reasons = Counter(kind_of(outcome) for outcome in failed)
    for reason, count in reasons.most_common():
        print(f"{count:6d}  {reason}")
    loaded, repaired = len(files) - len(failed), sum(bool(outcome.repairs) for outcome in outcomes)
    share = 100.0 * loaded / len(files)
    print(f"{loaded} of {len(files)} files load as given ({share:.1f} %), {repaired} of them with repairs")
    print(json.dumps({"files": len(files), "loaded": loaded, "reasons": dict(reasons.most_common())}))


def urdf_files(folders: Sequence[Path]) -> list[Path]:
    """Every ``*.urdf`` below some folders, each once, in a stable order.

    Raises
    ------
    ConfigError
        When a folder does not exist, or there is no such file.
    """
    found: dict[Path, None] = {}
    for folder in folders:
        if not folder.exists():
            raise ConfigError("no such folder", folder, "name a folder that holds URDF files")
        for file in [folder] if folder.is_file() else sorted(folder.rglob("*.urdf")):
            if file.is_file():
                found[file.resolve()] = None
    if not found:
        raise ConfigError("no URDF file below these folders", " ".join(map(str, folders)), "name others")
    return list(found)


def load_all(files: Sequence[Path], seconds: float) -> Iterator[Outcome]:
    """Outcomes in the order of the files, from one worker process that a new one replaces when a file kills it."""
    worker, ours = _start()
    for file in files:
        ours.send(file)
        answer: Outcome | None = None
        try:
            if ours.poll(seconds):
                answer = ours.recv()
            reason = f"no answer within {seconds:g} s"
        except EOFError:
            worker.join()
            reason = f"the process ended with code {worker.exitcode}"
        if answer is None:
            worker.kill()
            worker.join()
            worker, ours = _start()
            answer = Outcome(file, f"{file}: {reason}")
        yield answer
    ours.send(None)
    worker.join()


def _start() -> tuple[multiprocessing.process.BaseProcess, Connection]:
    # A fresh interpreter: one that is forked would keep the pipe's other end open, and never see it close.
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    worker = context.Process(target=_work, args=(theirs,), daemon=True)
    worker.start()
    theirs.close()
    return worker, ours


def _work(connection: Connection) -> None:
    while (file := connection.recv()) is not None:
        connection.send(_outcome(file))


def _outcome(file: Path) -> Outcome:
    try:
        obj = load(file)
    except ArtsimError as error:
        return Outcome(file, str(error))
    except Exception as error:  # a raw exception is a finding of its own, and must not stop the rest
        return Outcome(file, f"{file}: raw {type(error).__name__}: {error}")
    return Outcome(file, None, tuple(map(str, obj.repairs)))


def kind_of(outcome: Outcome) -> str:
    """The reason of a failure without what differs from file to file: paths, names and numbers."""
    text = str(outcome.error).replace(str(outcome.file), "").partition(". Fix:")[0]
    text = re.sub(r"'[^']*'|\"[^\"]*\"", "...", text)
    text = re.sub(r"/\S+", "...", text)
    text = re.sub(r"\d+(\.\d+)?", "N", text).strip(" :")
    return text if len(text) <= 120 else f"{text[:117]}..."


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
