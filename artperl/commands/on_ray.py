"""The same function for many tasks on a Ray cluster, with results in order."""

from __future__ import annotations

import uuid
from collections import deque
from collections.abc import Callable, Generator, Iterable
from importlib.metadata import version
from typing import Any, TypeVar

from artsim.common.extras import needs
from artsim.errors import ArtsimError
from artsim.runs.ray_pool import connect, version_difference

Task = TypeVar("Task")
Result = TypeVar("Result")

_QUEUED = 4
"""Tasks for each processor of the cluster, handed out, or done and not yet asked for."""
_ATTEMPTS = 4
"""Of a task whose process or node dies."""

_here: tuple[str, Callable[[Any], Any]] | None = None
"""Run that this process of a node works for, and its function."""


def each_on_ray(
    prepare: Callable[[], Callable[[Task], Result]], tasks: Iterable[Task], address: str
) -> Generator[Result, None, None]:
    """Results of a function for tasks, in the order of the tasks; as :func:`artperl.core.processes.each` has them.

    A task whose process or node dies is done elsewhere, four times at most.

    Parameters
    ----------
    prepare : callable
        Makes the function, once in each process of a node. It can be pickled, and so can tasks and results.
    tasks : iterable
    address : str
        "auto" for the cluster that this machine belongs to, "local" to start one here, or HOST:PORT of its head.

    Raises
    ------
    ConfigError
        When Ray is not installed, there is no cluster, or a node has another version of this package.
    ArtsimError
        When the process of a task dies each time.
    """
    with needs("estimation on Ray"):
        import ray
    own = not ray.is_initialized()
    if own:
        connect(ray, address)
    waiting: deque[Any] = deque()
    try:
        function = ray.put(prepare)
        work = ray.remote(num_cpus=1, max_retries=_ATTEMPTS - 1)(_work)
        run, here = uuid.uuid4().hex, {"artsim": version("artsim")}

        def result() -> Result:
            try:
                kind, value = ray.get(waiting.popleft())
            except ray.exceptions.RayError as error:
                raise ArtsimError(
                    f"the process of a cloud died {_ATTEMPTS} times ({type(error).__name__})", f"--ray {address}",
                    "look at ray status: did nodes run out of memory?",
                ) from error  # fmt: skip
            if kind == "failed":
                raise value
            found: Result = value
            return found

        for task in tasks:
            waiting.append(work.remote(run, here, function, task))
            if len(waiting) >= _QUEUED * max(1, int(ray.cluster_resources().get("CPU", 1))):
                yield result()
        while waiting:
            yield result()
    finally:
        for ref in waiting:
            ray.cancel(ref, force=True)
        if own:
            ray.shutdown()


def _work(run: str, wanted: dict[str, str], prepare: Callable[[], Callable[[Any], Any]], task: Any) -> tuple[str, Any]:
    """Do a task in a process of a node: its result, or the error that the driver is to raise."""
    global _here
    try:
        if _here is None or _here[0] != run:
            difference = version_difference(wanted)
            if difference is not None:
                return "failed", difference
            _here = run, prepare()
        return "done", _here[1](task)
    except ArtsimError as error:
        return "failed", error
