"""The worker processes of a run on this machine."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import TracebackType
from typing import Any, TypeAlias, TypeVar

from artsim.common.messages import messages_shown
from artsim.errors import DatasetError
from artsim.runs.worker import serve

K = TypeVar("K")
T = TypeVar("T")

Tasks: TypeAlias = "Iterable[tuple[K, tuple[Any, ...]] | None]"
"""Keys and arguments of tasks. None: no more until one of those that are handed out is done."""
Progress: TypeAlias = "Callable[[int], object]"


def ignore(count: int) -> None:
    """Nobody hears of progress."""


_PATIENCE = 10.0
"""Seconds that a process has to leave what it is at once the run is over."""


@dataclass(frozen=True)
class WorkerLost:
    """The answer of a task whose process died or took too long, and how that came about."""

    why: str


@dataclass
class _Member:
    """A process, what it is at, and since when."""

    process: BaseProcess
    connection: Connection
    greeted: bool = False
    task: tuple[Any, tuple[Any, ...]] | None = None
    since: float = 0.0


class WorkerPool:
    """The worker processes of a run: started when first given work, stopped at the end however it comes.

    Parameters
    ----------
    workers : int
        Processes at most.
    context : object, optional
        What each process gets, once: see :attr:`artsim.runs.worker.Worker.context`.
    """

    def __init__(self, workers: int, context: Any = None):
        # Inherited by the processes: with one of them for each core, NumPy's own threads only get in the way.
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
        self.workers, self._context = workers, context
        self._spawn = multiprocessing.get_context("spawn")
        self._members: list[_Member] = []

    def run(
        self, work: Callable[..., T], tasks: Tasks[K], limit: float | None = None, progress: Progress = ignore
    ) -> Iterator[tuple[K, T | WorkerLost]]:
        """Do tasks, in any order.

        A process that dies is replaced, and its task done again alone in a new one: what it died of may have been the
        memory that the others took. When it dies again, the answer is :class:`WorkerLost`.

        Parameters
        ----------
        work : callable
            A function of a module; it may call :func:`artsim.runs.worker.report`.
        tasks : Tasks
        limit : float, optional
            Seconds that a task may take before its process is killed.
        progress : callable
            Told each count that is reported.

        Yields
        ------
        key, answer

        Raises
        ------
        DatasetError
            When a process ends before it was given anything.
        Exception
            What ``work`` raises.
        """
        waiting = iter(tasks)
        again: deque[tuple[Any, tuple[Any, ...]]] = deque()
        alone = False
        while True:
            for _ in range((1 if alone else self.workers) - len(self._busy())):
                task = (again.popleft() if again else None) if alone else next(waiting, None)
                if task is None:
                    break
                self._give(work, task, fresh=alone)
            busy = self._busy()
            if not busy and not again and not alone:
                return
            if not busy:  # all others are done; once what was lost is done again, tasks may come that waited for it
                alone = bool(again)
                continue
            ready = wait([m.connection for m in busy] + [m.process.sentinel for m in busy], timeout=0.2)
            for member in busy:
                task = member.task
                assert task is not None
                alive, done = member.process.is_alive(), False  # once it is dead, what it said is all that it says
                if not alive or member.connection in ready:
                    for kind, value in _messages(member.connection):
                        if kind == "progress":
                            progress(value)
                        elif kind == "ready":
                            member.greeted, member.since = True, time.monotonic()
                        elif kind == "failed":
                            raise value
                        else:
                            member.task, done = None, True
                            yield task[0], value
                if done:
                    continue
                if not alive:
                    self._members.remove(member)
                    member.connection.close()
                    if not member.greeted:
                        raise DatasetError(
                            "a worker process ended as it started (a script without `if __name__ == '__main__'`?)",
                            fix="start the run from a module, or below `if __name__ == '__main__':`",
                        )
                    if alone:
                        yield task[0], WorkerLost(f"a worker process died of it ({_cause(member.process.exitcode)})")
                    else:
                        again.append(task)
                elif limit is not None and member.greeted and time.monotonic() > member.since + limit:
                    self._end(member)
                    yield task[0], WorkerLost(f"it took over {limit:g} s")

    def _busy(self) -> list[_Member]:
        return [member for member in self._members if member.task is not None]

    def _give(self, work: Callable[..., Any], task: tuple[Any, tuple[Any, ...]], fresh: bool) -> None:
        """Hand a task to an idle process; to a new one where there is none, or when it shall be ``fresh``."""
        idle = [member for member in self._members if member.task is None]
        if fresh:
            for member in idle:
                self._end(member)
        member = self._start() if fresh or not idle else idle[0]
        member.task, member.since = task, time.monotonic()
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):  # it died: noticed where answers are awaited
            member.connection.send((work, task[1]))

    def _start(self) -> _Member:
        """A new process; it never hears a Ctrl-C, which is the parent's to answer."""
        ours, theirs = self._spawn.Pipe()
        process = self._spawn.Process(target=serve, args=(theirs, self._context, messages_shown()))
        if sys.platform == "win32":
            process.start()
        else:
            resource_tracker.ensure_running()  # else the first start does it, and lets SIGINT through again
            before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
            try:
                process.start()
            finally:
                signal.pthread_sigmask(signal.SIG_SETMASK, before)
        theirs.close()
        self._members.append(_Member(process, ours))
        return self._members[-1]

    def _end(self, member: _Member) -> None:
        """Stop a process at once."""
        self._members.remove(member)
        member.process.kill()
        member.process.join()
        member.connection.close()

    def __enter__(self) -> WorkerPool:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for member in self._members:
            with contextlib.suppress(OSError):
                member.connection.send(None)  # stop
        deadline = time.monotonic() + _PATIENCE
        for member in [*self._members]:
            while member.process.is_alive() and time.monotonic() < deadline:
                _messages(member.connection)  # a process whose answer nobody takes cannot end
                member.process.join(0.02)
            self._end(member)


def results(answers: Iterable[tuple[K, T | WorkerLost]], where: str | Path) -> Iterator[tuple[K, T]]:
    """Answers of tasks none of which may be lost.

    Parameters
    ----------
    answers : iterable
        As :meth:`WorkerPool.run` gives them.
    where : path or str
        What is made, for messages.

    Raises
    ------
    DatasetError
        When the process of a task was lost.
    """
    for key, answer in answers:
        if isinstance(answer, WorkerLost):
            name = " ".join(map(str, key)) if isinstance(key, tuple) else key
            fix = "use fewer --workers; the same command resumes"
            raise DatasetError(f"{answer.why} while {name} was made", where, fix)
        yield key, answer


def _messages(connection: Connection) -> list[tuple[str, Any]]:
    """What a process has said since it was last asked."""
    found = []
    with contextlib.suppress(EOFError, OSError):
        while connection.poll():
            found.append(connection.recv())
    return found


def _cause(exit_code: int | None) -> str:
    """How a process ended, in words."""
    if exit_code is None or exit_code >= 0:
        return f"exit code {exit_code}"
    try:
        name = signal.Signals(-exit_code).name
    except ValueError:
        name = str(-exit_code)
    return f"{name}: out of memory?" if name == "SIGKILL" else name
