"""Whether files are as they were written."""

import hashlib
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

from artsim.common.progress import track
from artsim.errors import DatasetError
from artsim.runs.storage import FolderStorage, Place, Storage, storage_of

_BLOCK_BYTES = 1 << 20


def check_files(
    place: Place, digests: Mapping[str, Sequence[str]], threads: int = 2, progress: bool = True
) -> dict[str, tuple[str | None, str]]:
    """Compare files with their checksums.

    Parameters
    ----------
    place : path, str or Storage
    digests : mapping
        SHA-256 that each file may have, by its name at the place; any, when there are none.
    threads : int
    progress : bool
        Show a progress bar.

    Returns
    -------
    dict
        By name: what is wrong (None for a sound file), and the digest ("" where there is none).
    """
    storage, found, pool = storage_of(place), dict[str, tuple[str | None, str]](), ThreadPoolExecutor(threads)
    try:
        with track("check", total=len(digests), unit="file", shown=progress and bool(digests), leave=False) as bar:
            states = pool.map(lambda own: _check(storage, *own), digests.items())
            for name, state in zip(digests, states, strict=True):
                found[name] = state
                bar.update()
    finally:  # a Ctrl-C stops the threads after the files that they are at, not after all
        pool.shutdown(cancel_futures=True)
    return found


def _check(storage: Storage, name: str, digests: Sequence[str]) -> tuple[str | None, str]:
    if isinstance(storage, FolderStorage):
        path = storage.folder / name
        if path.is_symlink():
            return "is a link to somewhere else", ""
        if path.is_dir():
            return "is a folder", ""
        if not path.exists():
            return "is missing", ""
        if not path.is_file():
            return "is no regular file", ""
    digest = hashlib.sha256()
    try:
        with storage.open(name)[0] as file:
            while block := file.read(_BLOCK_BYTES):
                digest.update(block)
    except DatasetError as error:
        return error.what, ""
    except OSError as error:
        return f"cannot be read ({error.strerror})", ""
    if digests and digest.hexdigest() not in digests:
        return "has another checksum than when it was written", digest.hexdigest()
    return None, digest.hexdigest()
