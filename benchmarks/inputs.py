"""Load rate over other people's files: ``python -m benchmarks.inputs FOLDER...``.

Every file below the folders is loaded as given, each in a worker process under a time limit:

- URDF: ``*.urdf``;
- MJCF: ``*.xml`` whose top element is ``<mujoco>``, and that MuJoCo itself compiles;
- USD: ``*.usd``, ``.usda``, ``.usdc`` and ``.usdz`` with a joint of UsdPhysics that moves.

Loaded files are posed at random, and every part is compared with what yourdfpy, MuJoCo or usd-core make of the file. A
scene of several objects counts as loaded where each of them loads by its name. One line for each failure says why, then
failures are counted by kind. The last line is one JSON object: ``{"files", "loaded", "reasons"}`` of all files, and
under ``"formats"`` the same of each format.
"""

import json
import multiprocessing
import os
import re
import tempfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import tyro

from artsim import load
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError, SceneError
from artsim.loading.roots import PackageRoots
from artsim.model.objects import ArticulatedObject
from tests.oracles import NoOracleError, deviation, poses_of, random_states

FORMATS = {".urdf": "urdf", ".xml": "mjcf", ".usd": "usd", ".usda": "usd", ".usdc": "usd", ".usdz": "usd"}
"""Format of each ending."""
_OBJECTS = 8
"""Objects of one scene that are loaded."""
_HEAD = 20_000
"""Bytes in which the top element of an MJCF file stands."""


@dataclass(frozen=True)
class Options:
    """Load every URDF, MJCF and USD file below some folders, and say what does not load and why."""

    folders: tyro.conf.Positional[tuple[Path, ...]]
    """Folders to look through, or files."""
    seconds: float = 60.0
    """Time limit of each file."""
    states: int = 3
    """Random states in which a file is compared with the other program; 0 compares none."""
    repairs: bool = False
    """Also list what was assumed or left out while loading, by file."""
    package_root: PackageRoots = field(default_factory=dict)
    """Folder of each package name, as in package://NAME/; files outside an object's folder open below it, too."""


@dataclass(frozen=True)
class Outcome:
    """What came of a file."""

    file: Path
    error: str | None = None
    """None when it loaded."""
    repairs: tuple[str, ...] = ()
    skipped: str = ""
    """Why it does not count: the format's own library refuses it."""
    parts: int = 0
    """How many were compared with that library."""
    deviation: float = 0.0
    """Largest difference of an entry of their poses, radians and metres."""

    @property
    def format(self) -> str:
        """A value of :data:`FORMATS`."""
        return FORMATS[self.file.suffix.lower()]

    @property
    def reason(self) -> str:
        """The failure without what differs from file to file: paths, names and numbers."""
        text = str(self.error).replace(str(self.file), "").partition(". Fix:")[0]
        text = re.sub(r"'[^']*'|\"[^\"]*\"|/\S+", "...", text)
        text = re.sub(r"\d+(\.\d+)?", "N", text).strip(" :")
        return text if len(text) <= 120 else f"{text[:117]}..."


def main(options: Options) -> None:
    """Load and print."""
    files = object_files(options.folders)
    roots = {name: root.absolute() for name, root in options.package_root.items()}
    loading = load_all(files, options.seconds, options.states, roots)
    every = list(track("files", loading, total=len(files), unit="file"))
    outcomes = [outcome for outcome in every if not outcome.skipped]
    for outcome in outcomes:
        if outcome.error is not None:
            print(f"does not load: {outcome.error}")
        for repair in outcome.repairs if options.repairs else ():
            print(f"{outcome.file}: {repair}")
    result, formats = _summary(outcomes), dict[str, dict[str, Any]]()
    for reason, count in result["reasons"].items():
        print(f"{count:6d}  {reason}")
    for name in dict.fromkeys(FORMATS.values()):
        own = [outcome for outcome in every if outcome.format == name]
        for reason, count in Counter(outcome.skipped.partition(":")[0] for outcome in own if outcome.skipped).items():
            print(f"{name}: {count} files do not count: {reason}")
        if counted := [outcome for outcome in own if not outcome.skipped]:
            found = formats[name] = _summary(counted)
            print(f"{name}: {found['loaded']} of {found['files']} files load", end="")
            moves = "; {parts} parts of {compared} files move as in the other program, to {max_deviation:.2g} at most"
            print(moves.format(**found) if "parts" in found else "")
    repaired = sum(bool(outcome.repairs) for outcome in outcomes)
    share = 100.0 * result["loaded"] / max(len(outcomes), 1)
    print(f"{result['loaded']} of {len(outcomes)} files load as given ({share:.1f} %), {repaired} of them with repairs")
    print(json.dumps(result | {"formats": formats}))


def _summary(outcomes: Sequence[Outcome]) -> dict[str, Any]:
    reasons = Counter(outcome.reason for outcome in outcomes if outcome.error is not None)
    found = {"files": len(outcomes), "loaded": len(outcomes) - reasons.total(), "reasons": dict(reasons.most_common())}
    if compared := [outcome for outcome in outcomes if outcome.parts]:
        found |= {"compared": len(compared), "parts": sum(outcome.parts for outcome in compared)}
        found["max_deviation"] = max(outcome.deviation for outcome in compared)
    return found


def object_files(folders: Sequence[Path]) -> list[Path]:
    """Every URDF, MJCF and USD file below some folders, each once, in a stable order.

    Raises
    ------
    ConfigError
        When a folder does not exist, or there is no such file.
    """
    found: dict[Path, None] = {}
    for folder in folders:
        if not folder.exists():
            raise ConfigError("no such folder", folder, "name a folder that holds files of objects")
        for file in [folder] if folder.is_file() else sorted(folder.rglob("*")):
            if file.suffix.lower() in FORMATS and file.is_file() and (file.suffix.lower() != ".xml" or _is_mjcf(file)):
                found[file.resolve()] = None
    if not found:
        where = " ".join(map(str, folders))
        raise ConfigError("no URDF, MJCF or USD file below these folders", where, "name others")
    return list(found)


def _is_mjcf(file: Path) -> bool:
    with file.open("rb") as stream:
        text = re.sub(rb"<!--.*?-->|<\?.*?\?>", b"", stream.read(_HEAD), flags=re.DOTALL)
    return re.match(rb"(\xef\xbb\xbf)?\s*<mujoco[\s/>]", text) is not None


def load_all(files: Sequence[Path], seconds: float, states: int, roots: Mapping[str, Path]) -> Iterator[Outcome]:
    """Outcomes in the order of the files, from one worker process that a new one replaces when a file kills it."""
    worker, ours = _start()
    for file in files:
        ours.send((file, states, roots))
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
    with tempfile.TemporaryDirectory() as folder:  # MuJoCo and usd-core may write their warnings there
        os.chdir(folder)
        while (task := connection.recv()) is not None:
            connection.send(_outcome(*task))


def _outcome(file: Path, states: int, roots: Mapping[str, Path]) -> Outcome:
    poses = None
    try:
        poses = poses_of(file) if states or FORMATS[file.suffix.lower()] != "urdf" else None
    except NoOracleError as error:
        if FORMATS[file.suffix.lower()] != "urdf":
            return Outcome(file, skipped=str(error))
    try:
        parts, largest = 0, 0.0
        objects = _objects(file, roots)
        if poses is not None and states:
            for obj in objects:
                compared, found = deviation(obj, poses, random_states(obj, states))
                parts, largest = parts + compared, max(largest, found)
    except ArtsimError as error:
        return Outcome(file, str(error))
    except Exception as error:  # a raw exception is a finding of its own, and must not stop the rest
        return Outcome(file, f"{file}: raw {type(error).__name__}: {error}")
    repairs = dict.fromkeys(str(repair) for obj in objects for repair in obj.repairs)
    return Outcome(file, None, tuple(repairs), parts=parts, deviation=largest)


def _objects(file: Path, roots: Mapping[str, Path]) -> list[ArticulatedObject]:
    """The object of a file; of a scene of several, each by its name, the first ones of very many."""
    try:
        return [load(file, package_roots=roots)]
    except SceneError as error:
        if not error.names:
            raise
        return [load(file, package_roots=roots, body=name) for name in error.names[:_OBJECTS]]


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
