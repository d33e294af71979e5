"""The same function for many tasks, in several processes, with results in order."""

from __future__ import annotations

import multiprocessing
import signal
from collections import deque
from collections.abc import Callable, Generator, Iterable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from typing import Any, TypeVar

from artsim.errors import ArtsimError, ConfigError

Task = TypeVar("Task")
Result = TypeVar("Result")

_AHEAD = 4
"""Tasks of each process that are handed out, or done and not yet asked for."""
_MOST = 1024
"""Processes."""

_function: Callable[[Any], Any] | None = None
"""Of a process that works for another one."""


def each(
    prepare: Callable[[], Callable[[Task], Result]], tasks: Iterable[Task], workers: int = 1
) -> Generator[Result, None, None]:  # fmt: skip
    """Results of a function for tasks, in the order of the tasks, as soon as they are known.

    Tasks are taken as they are needed, so that there may be millions. Where results are no longer asked for, or Ctrl-C
    is pressed, what has begun is finished and nothing else begins.

    Parameters
    ----------
    prepare : callable
        Makes the function, once in each process. It can be pickled, and so can tasks and results.
    tasks : iterable
    workers : int
        Processes; with 1 all is done in this one.

    Raises
    ------
    ConfigError
        When there is no such number of processes.
    ArtsimError
        When a process ends that should not.
    """
    if not 1 <= workers <= _MOST:
        raise ConfigError(f"{workers} processes are not 1 to {_MOST}", "workers", "use one for each core")
    return _here(prepare, tasks) if workers == 1 else _in_processes(prepare, tasks, workers)


def _here(prepare: Callable[[], Callable[[Task], Result]], tasks: Iterable[Task]) -> Generator[Result, None, None]:
    yield from map(prepare(), tasks)


def _in_processes(
    prepare: Callable[[], Callable[[Task], Result]], tasks: Iterable[Task], workers: int
) -> Generator[Result, None, None]:  # fmt: skip
    waiting: deque[Future[Result]] = deque()
    # Spawned, since torch's threads do not survive a fork.
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), _begin, (prepare,))
    try:
        for task in tasks:
            waiting.append(pool.submit(_work, task))
            if len(waiting) >= _AHEAD * workers:
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    except BrokenProcessPool as error:
        raise ArtsimError(
            "a process ended before its work was done", "workers",
            "use fewer processes if memory was short; a script that starts some begins with if __name__ =="
            ' "__main__":',
        ) from error  # fmt: skip
    finally:
        pool.shutdown(cancel_futures=True)


def _begin(prepare: Callable[[], Callable[[Any], Any]]) -> None:
    global _function
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for whoever asked
    _function = prepare()


def _work(task: Any) -> Any:
    assert _function is not None
    return _function(task)
