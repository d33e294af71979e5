"""The same function for many tasks, in several processes or on a cluster, with results in order."""

from collections.abc import Callable, Generator, Iterable, Iterator
from typing import Any, TypeVar

from artsim.errors import ArtsimError, ConfigError
from artsim.runs.pool import WorkerLost, WorkerPool
from artsim.runs.ray_pool import RayPool
from artsim.runs.worker import this_worker

Task = TypeVar("Task")
Result = TypeVar("Result")

_MOST = 1024
"""Processes."""
_AHEAD = 4
"""Tasks of each process that are handed out, or done while an earlier one is not."""
_AHEAD_ON_RAY = 4096


def each(
    prepare: Callable[[], Callable[[Task], Result]], tasks: Iterable[Task], workers: int = 1, ray: str | None = None
) -> Generator[Result, None, None]:
    """Results of a function for tasks, in the order of the tasks, as soon as they are known.

    Tasks are taken as they are needed, so that there may be millions. Where results are no longer asked for, or Ctrl-C
    is pressed, what has begun is finished and nothing else begins. The task of a process that dies is done again.

    Parameters
    ----------
    prepare : callable
        Makes the function, once in each process. It can be pickled, and so can tasks and results.
    tasks : iterable
    workers : int
        Processes; with 1 all is done in this one.
    ray : str, optional
        Address of a Ray cluster that does the tasks instead; see :class:`artsim.runs.ray_pool.RayPool`.

    Raises
    ------
    ConfigError
        When there is no such number of processes; that Ray is not installed, there is no cluster, or a node has another
        version of this package.
    ArtsimError
        When the process of a task dies each time.
    """
    if not 1 <= workers <= _MOST:
        raise ConfigError(f"{workers} processes are not 1 to {_MOST}", "workers", "use one for each core")
    return _here(prepare, tasks) if workers == 1 and ray is None else _in_processes(prepare, tasks, workers, ray)


def _here(prepare: Callable[[], Callable[[Task], Result]], tasks: Iterable[Task]) -> Generator[Result, None, None]:
    yield from map(prepare(), tasks)


def _in_processes(
    prepare: Callable[[], Callable[[Task], Result]], tasks: Iterable[Task], workers: int, ray: str | None
) -> Generator[Result, None, None]:
    early: dict[int, Result] = {}
    following, ahead = 0, _AHEAD * workers if ray is None else _AHEAD_ON_RAY

    def numbered() -> Iterator[tuple[int, tuple[Task]] | None]:
        for number, task in enumerate(tasks):
            while number >= following + ahead:
                yield None
            yield number, (task,)

    with WorkerPool(workers, prepare) if ray is None else RayPool(ray, prepare) as team:
        for number, result in team.run(_apply, numbered()):
            if isinstance(result, WorkerLost):
                fix = "use fewer processes if memory was short; on Ray, look at ray status"
                raise ArtsimError(result.why, f"task {number}", fix)
            early[number] = result
            while following in early:
                yield early.pop(following)
                following += 1


def _apply(task: Any) -> Any:
    return this_worker().kept(_function)(task)


def _function(prepare: Callable[[], Callable[[Any], Any]]) -> Callable[[Any], Any]:
    return prepare()
