"""Files that a user names for results: none takes the place of an input, of a dataset's own file, or of no file at all.

:func:`write_output` is for these. What a program keeps for itself in a folder of its own goes by
:func:`artsim.common.files.write_atomic`.
"""

import contextlib
import os
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import BinaryIO

from artsim.common.files import atomic_file
from artsim.common.known_files import is_input, refuse_special
from artsim.errors import ConfigError

_MARKS = ("dataset.json", "plan.json", "scenes.json", "motions.json", "estimator.json")
"""Files by which a folder is known for a dataset, a set of scenes, of motions, or an estimator."""
_OWN = (*_MARKS, "progress.jsonl", "weights.safetensors", "base.npz")
_OBJECT = {
    "meta.json",
    "params.json",
    "semantics.txt",
    "mobility.urdf",
    "mobility.xml",
    "mobility.usda",
    "mobility.usdz",
    "simready",
    "meshes",
}
"""Everything in the folder of an object that artsim wrote."""
_DEEPEST = 4
"""Folders below one of those that are its own."""


def write_output(path: Path, data: bytes, inputs: Iterable[Path | None] = ()) -> None:
    """Write a result; see :func:`output_file`."""
    with output_file(path, inputs) as file:
        file.write(data)


@contextlib.contextmanager
def output_file(path: Path, inputs: Iterable[Path | None] = ()) -> Iterator[BinaryIO]:
    """A new file to write to that takes the place of ``path`` once the block ends without an error.

    Raises
    ------
    ConfigError
        As :func:`check_output`; or when the folder cannot be written to, or the disk is full.
    """
    check_output(path, inputs)
    with atomic_file(path) as file:
        yield file


def check_output(path: Path, inputs: Iterable[Path | None] = ()) -> None:
    """Refuse to write where an input is, a file of a dataset, or what is no regular file.

    Parameters
    ----------
    path : Path
    inputs : iterable of Path or None
        Files that are read, besides those that this process has read already.

    Raises
    ------
    ConfigError
    """
    path = Path(path)
    refuse_special(path)
    given = {os.path.realpath(one) for one in inputs if one is not None}
    if is_input(path) or os.path.realpath(path) in given:
        raise ConfigError("it is an input, which would be lost", path, "name another file to write")
    for depth, folder in enumerate(list(Path(os.path.realpath(path)).parents)[: _DEEPEST + 1]):
        mark = next((name for name in _MARKS if (folder / name).is_file()), None)
        if mark is None:
            continue
        if (depth and path.exists()) or (not depth and (path.name in _OWN or path.suffix == ".tar")):
            raise ConfigError(f"it belongs to what {folder / mark} describes", path, "name another file to write")
        return


def replace_folder(made: Path, folder: Path) -> None:
    """Put the folder of an object where an older one of artsim may be, and nothing else.

    Raises
    ------
    ConfigError
        When a folder is there that artsim did not write, or that an input is in.
    OSError
        When it cannot be put there.
    """
    if folder.exists():
        entries = set(os.listdir(folder))  # noqa: PTH208  # a file is no folder, which is an OSError
        own = not entries or "meta.json" in entries <= _OBJECT
        files = (Path(place) / name for place, _, names in os.walk(folder) for name in names if name != "meta.json")
        if not own or any(map(is_input, files)):
            what = "an input is in it" if own else "artsim did not write it"
            raise ConfigError(f"a folder is there, and {what}", folder, "name another folder for --out")
        shutil.rmtree(folder)
    made.rename(folder)
