"""The tasks of a run on a Ray cluster: nodes and processes may die at any time, and their tasks are done elsewhere.

Where the dataset lies in a folder, one actor on the driver's machine hands its files to the nodes and takes theirs: the
nodes need not see that folder. Where it lies at a URL, or in a folder named by ``file://``, each node uses it directly.
"""

from __future__ import annotations

import contextlib
import io
import os
import socket
import threading
import time
import uuid
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, BinaryIO, TypeAlias, TypeVar

from artsim.common.extras import require_extra
from artsim.errors import ConfigError
from artsim.runs.pool import Progress, Tasks, WorkerLost, WorkerPool, ignore
from artsim.runs.storage import FolderStorage, storage_of
from artsim.runs.worker import Worker, outcome, set_worker

K = TypeVar("K")
T = TypeVar("T")

_ATTEMPTS = 4
"""Of a task whose process or node dies: one object that kills its process is told from a cluster that loses nodes."""
_QUEUED = 2
"""Tasks for each processor of the cluster: while one is done, the next is on its way."""
_LOOK = 5.0
"""Seconds between two looks at how many processors there are."""
_ANSWER = 10.0
"""Seconds that the head of a cluster has to answer."""
_WHOLE_FILE = 1 << 31


class RayPool:
    """A cluster as the workers of a run; a context manager.

    Parameters
    ----------
    address : str
        "auto" for the cluster that this machine belongs to, "local" to start one here, or HOST:PORT of its head.
    context : object, optional
        What each process gets: see :attr:`artsim.runs.worker.Worker.context`. A path or str becomes a storage. Other
        machines read and write the files of a path through this one; a FolderStorage is a folder that every node sees.
    packages : sequence of str
        Every node has to have the driver's versions of these.

    Raises
    ------
    ConfigError
        When Ray is not installed, or there is no cluster.
    """

    def __init__(self, address: str, context: Any = None, packages: Sequence[str] = ("artsim",)):
        with require_extra("work on Ray"):
            import ray
        self._ray = ray
        self._own = not ray.is_initialized()
        if self._own:
            connect(ray, address)
        self._run = uuid.uuid4().hex
        self._pending: dict[Any, tuple[Any, tuple[Any, ...], int]] = {}
        self._processors, self._looked = 1, -_LOOK
        here = ray.util.scheduling_strategies.NodeAffinitySchedulingStrategy(
            ray.get_runtime_context().get_node_id(), soft=False
        )
        storage = storage_of(context) if isinstance(context, str | Path) else context
        if isinstance(storage, FolderStorage):  # wherever the process that uses it runs
            storage = FolderStorage(storage.folder.absolute())
        self._hub = ray.remote(num_cpus=0, max_concurrency=8, scheduling_strategy=here)(_Hub).remote(storage)
        # A cluster that is started here has no other machine.
        if isinstance(context, str | Path) and isinstance(storage, FolderStorage) and address != "local":
            storage = RelayStorage(self._hub, storage.place)
        self._context = ray.put(storage)
        self._task = ray.remote(num_cpus=1, max_retries=0)(_do)
        self._versions = {name: version(name) for name in packages}

    def run(
        self, work: Callable[..., T], tasks: Tasks[K], limit: float | None = None, progress: Progress = ignore
    ) -> Iterator[tuple[K, T | WorkerLost]]:
        """Do tasks, in any order; see :meth:`artsim.runs.pool.WorkerPool.run`.

        A task whose process or node dies is done again, four times at most; the time limit ends its process.
        """
        waiting, again = iter(tasks), deque[tuple[Any, tuple[Any, ...], int]]()
        while True:
            while len(self._pending) < _QUEUED * self._cluster():
                if again:
                    self._give(work, again.popleft(), limit)
                elif (task := next(waiting, None)) is not None:
                    self._give(work, (*task, 1), limit)
                else:
                    break
            if not self._pending:
                return
            for ref in self._finished():
                key, arguments, attempt = self._pending.pop(ref)
                try:
                    kind, value, count = self._ray.get(ref)
                except self._ray.exceptions.RayError as error:
                    late = self._ray.get(self._hub.late.remote(f"{key}"))
                    if late is not None or attempt == _ATTEMPTS:
                        yield key, WorkerLost(late or f"its process died {attempt} times ({type(error).__name__})")
                    else:
                        again.append((key, arguments, attempt + 1))
                    continue
                if kind == "failed":
                    raise value
                progress(count)
                yield key, value

    def _finished(self) -> list[Any]:
        refs = list(self._pending)
        first, _ = self._ray.wait(refs, num_returns=1, timeout=1.0)
        return self._ray.wait(refs, num_returns=len(refs), timeout=0)[0] if first else []

    def _give(self, work: Callable[..., Any], task: tuple[Any, tuple[Any, ...], int], limit: float | None) -> None:
        about = self._run, self._hub, self._versions
        self._pending[self._task.remote(about, self._context, work, f"{task[0]}", task[1], limit)] = task

    def _cluster(self) -> int:
        """Processors of the cluster: nodes come and go."""
        if time.monotonic() >= self._looked + _LOOK:
            self._processors = max(1, int(self._ray.cluster_resources().get("CPU", 1)))
            self._looked = time.monotonic()
        return self._processors

    def __enter__(self) -> RayPool:
        return self

    def __exit__(self, *_: object) -> None:
        for ref in self._pending:
            with contextlib.suppress(Exception):  # the cluster may be gone
                self._ray.cancel(ref, force=True)
        with contextlib.suppress(Exception):
            self._ray.kill(self._hub)
        if self._own:
            self._ray.shutdown()


Team: TypeAlias = WorkerPool | RayPool
"""What does the tasks of a run: processes of this machine, or of a cluster."""


def connect(ray: Any, address: str) -> None:
    """Join a Ray cluster, or start one on this machine; see :class:`RayPool`.

    Raises
    ------
    ConfigError
        When there is none.
    """
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # nothing here calls home
    # Its next version leaves such variables alone of itself; the warning that it will is not for our users.
    os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
    try:
        more = {"include_dashboard": False} if address == "local" else {}
        if ":" in address:  # where nobody listens, Ray would try for minutes
            host, _, port = address.rpartition(":")
            socket.create_connection((host, int(port)), _ANSWER).close()
        ray.init(address=address, log_to_driver=False, logging_level="ERROR", **more)
    except (OSError, RuntimeError, ValueError) as error:
        raise ConfigError(
            f"there is no Ray cluster ({error!s:.200})", f"--ray {address}",
            "start one with: ray start --head; or use --ray local",
        ) from error  # fmt: skip


class _Hub:
    """What nodes ask the driver's machine for; an actor there."""

    def __init__(self, storage: Any):
        self.storage = storage
        self._late: dict[str, str] = {}

    def do(self, method: str, *arguments: Any) -> tuple[str, Any]:
        """Call a method of the storage."""
        return outcome(getattr(self.storage, method), arguments)

    def is_late(self, key: str, why: str) -> None:
        """Note why a task is given up."""
        self._late[key] = why

    def late(self, key: str) -> str | None:
        """Why a task was given up, if it was."""
        return self._late.pop(key, None)


class RelayStorage:
    """A storage that another machine has access to; see :class:`artsim.runs.storage.Storage`.

    Parameters
    ----------
    hub : actor
    place : str
        As the other machine calls it.
    """

    def __init__(self, hub: Any, place: str):
        self._hub, self.place = hub, place

    def __getattr__(self, method: str) -> Callable[..., Any]:
        """A method of the storage, done by the hub."""
        if method.startswith("_"):
            raise AttributeError(method)

        def ask(*arguments: Any) -> Any:
            import ray

            kind, value = ray.get(self._hub.do.remote(method, *arguments))
            if kind == "failed":
                raise value
            return value

        return ask

    def open(self, name: str) -> tuple[BinaryIO, int]:
        """The whole file, in memory: what the hub opens cannot be sent."""
        data = self.read(name, _WHOLE_FILE)
        return io.BytesIO(data), len(data)


_here: tuple[str, Worker] | None = None
"""Run that this process of a node works for, and what it keeps of it between tasks."""


def _do(
    about: tuple[str, Any, dict[str, str]],
    context: Any,
    work: Callable[..., Any],
    key: str,
    arguments: tuple[Any, ...],
    limit: float | None,
) -> tuple[str, Any, int]:
    """Do a task in a process of a node: what :func:`artsim.runs.worker.outcome` says, and how much was done."""
    global _here
    run, hub, versions = about
    counts: list[int] = []
    if _here is None or _here[0] != run:
        for name, wanted in versions.items():
            if version(name) != wanted:  # its bytes could be others
                what = f"a node has {name} {version(name)}, the driver {wanted}"
                fix = f"install the same on every node: pip install {name}=={wanted}"
                return "failed", ConfigError(what, os.uname().nodename, fix), 0
        _here = run, Worker(context, counts.append, bool)
    worker = _here[1]
    worker.tell = counts.append
    set_worker(worker)
    with _within(limit, lambda why: hub.is_late.remote(key, why)):
        kind, value = outcome(work, arguments)
    return kind, value, sum(counts)


@contextlib.contextmanager
def _within(limit: float | None, tell: Callable[[str], Any]) -> Iterator[None]:
    """End this process where the block takes longer than some seconds, after telling so."""
    if limit is None:
        yield
        return

    def end() -> None:
        import ray

        ray.get(tell(f"it took over {limit:g} s"))
        os._exit(1)

    timer = threading.Timer(limit, end)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
