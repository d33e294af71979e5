"""The worker processes of a run, and the lock that keeps a second run out of its folder."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import ParamSpec, TypeVar

from artsim.datasets.worker import start_worker
from artsim.errors import DatasetError
from artsim.files import write_error

P = ParamSpec("P")
T = TypeVar("T")


class Team:
    """The worker processes of a run: started when first given work, stopped at the end however it comes."""

    def __init__(self, folder: Path, workers: int):
        # Inherited by the processes: with one of them for each core, NumPy's own threads only get in the way.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        context = multiprocessing.get_context("spawn")
        self.folder, self.workers = folder, workers
        self.made, self.stop = context.Value("q", 0), context.Event()
        self.pool = ProcessPoolExecutor(workers, context, start_worker, (folder, self.made, self.stop))

    def submit(self, work: Callable[P, T], *args: P.args, **kwargs: P.kwargs) -> Future[T]:
        """Give work to the processes; those that it starts never hear a Ctrl-C, which is the parent's to answer."""
        if sys.platform == "win32":
            return self.pool.submit(work, *args, **kwargs)
        before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            return self.pool.submit(work, *args, **kwargs)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def __enter__(self) -> Team:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: object) -> None:
        self.stop.set()
        self.pool.shutdown(wait=True, cancel_futures=True)
        if isinstance(error, BrokenProcessPool | MemoryError):
            raise DatasetError(
                "a worker process died (out of memory? a script without `if __name__ == '__main__'`?)",
                self.folder,
                "use fewer --workers; the same command resumes",
            ) from error


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep a second run out of the folder; the lock goes with the process, however it ends."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        lock = (folder / ".lock").open("w")
    except OSError as error:
        raise write_error(error, folder) from error
    with lock:
        if sys.platform != "win32":
            import fcntl

            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise DatasetError("another run is writing here", folder, "wait for it or stop it") from error
            except OSError as error:
                raise DatasetError(f"cannot lock ({error.strerror})", folder, "use a folder on a local disk") from error
        yield
