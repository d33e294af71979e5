"""Whether files are as they were written."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from artsim.common.files import file_sha256
from artsim.common.progress import track


def check_files(
    folder: Path, digests: Mapping[str, Sequence[str]], threads: int = 2, progress: bool = True
) -> dict[str, tuple[str | None, str]]:
    """Compare files with their checksums.

    Parameters
    ----------
    folder : Path
    digests : mapping
        SHA-256 that each file may have, by its path within the folder; any, when there are none.
    threads : int
    progress : bool
        Show a progress bar.

    Returns
    -------
    dict
        By path: what is wrong (None for a sound file), and the digest ("" where there is none).
    """
    with (
        _readers(threads) as pool,
        track("check", total=len(digests), unit="file", shown=progress and bool(digests), leave=False) as bar,
    ):
        states = pool.map(lambda own: _check(folder / own[0], own[1]), digests.items())
        found = {}
        for name, state in zip(digests, states, strict=True):
            found[name] = state
            bar.update()
    return found


@contextlib.contextmanager
def _readers(threads: int) -> Iterator[ThreadPoolExecutor]:
    """Threads that a Ctrl-C stops after the files that they are at, not after all."""
    pool = ThreadPoolExecutor(threads)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


def _check(path: Path, digests: Sequence[str]) -> tuple[str | None, str]:
    if path.is_symlink():
        return "is a link to somewhere else", ""
    if path.is_dir():
        return "is a folder", ""
    if not path.exists():
        return "is missing", ""
    if not path.is_file():
        return "is no regular file", ""
    try:
        digest = file_sha256(path)
    except OSError as error:
        return f"cannot be read ({error.strerror})", ""
    if digests and digest not in digests:
        return "has another checksum than when it was written", digest
    return None, digest
