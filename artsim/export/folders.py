"""The folder of an object: made under another name, renamed once it is whole, and known by its ``meta.json``."""

import contextlib
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from artsim.common.files import read_json, write_error
from artsim.common.outputs import replace_folder
from artsim.errors import AssetError
from artsim.export import FORMATS

_MAX_META = 10_000_000


@contextlib.contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """A folder to write to, which takes the place of an older one of artsim once the block ends without an error.

    Raises
    ------
    ConfigError
        When it cannot be written, or a folder is there that artsim did not write.
    """
    part = folder.with_name(f".{folder.name}.{os.getpid()}.part")
    try:
        yield part
        replace_folder(part, folder)
    except OSError as error:
        raise write_error(error, folder) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def remove_unfinished(out: Path) -> None:
    """Remove folders that killed runs did not finish."""
    for part in [*out.glob(".*.part"), *out.glob("*/.*.part")]:
        shutil.rmtree(part, ignore_errors=True)


def whole_meta(
    folder: Path, formats: Sequence[str], is_same: Callable[[dict[str, Any]], object]
) -> dict[str, Any] | None:
    """Content of ``meta.json`` of a folder that is there with all its formats; a folder is whole if it is there at all.

    Parameters
    ----------
    folder : Path
    formats : sequence of str
    is_same : callable
        Whether a run makes just this again, by the content of ``meta.json``. It may raise KeyError, ValueError or
        TypeError of one that is damaged.
    """
    try:
        meta: dict[str, Any] = read_json(folder / "meta.json", "meta.json", max_bytes=_MAX_META)
        if set(meta["artsim"]["formats"]) != set(formats) or not is_same(meta):
            return None
    except (AssetError, ValueError, KeyError, TypeError):
        return None
    return meta if all((folder / FORMATS[name]).exists() for name in formats) else None
