"""A process that does the tasks of a run: what it keeps between them, and what it says to its parent."""

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from artsim.common.extras import import_failure
from artsim.common.messages import Messages
from artsim.errors import ArtsimError, DatasetError

T = TypeVar("T")


@dataclass
class Worker:
    """A process of a run."""

    context: Any
    """What the run gave to each of its processes, such as the storage of a dataset."""
    tell: Callable[[int], object]
    """Hears how much more is done."""
    is_stopped: Callable[[], bool]
    """Whether the run wishes that work in hand is left as it is."""
    _kept: dict[Callable[[Any], Any], Any] = field(default_factory=dict)

    def kept(self, make: Callable[[Any], T]) -> T:
        """What ``make`` makes of the context, once for all tasks."""
        if make not in self._kept:
            self._kept[make] = make(self.context)
        found: T = self._kept[make]
        return found


_worker: Worker | None = None


def this_worker() -> Worker:
    """The worker that this process is."""
    assert _worker is not None
    return _worker


def set_worker(worker: Worker) -> None:
    """Let this process work for a run."""
    global _worker
    _worker = worker


def serve(connection: Connection, context: Any, messages: Messages | None) -> None:
    """Do what the parent asks for until it says None, or is gone. The parent answers Ctrl-C."""
    with contextlib.nullcontext() if messages is None else messages.shown():
        _serve(connection, context)


def _serve(connection: Connection, context: Any) -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        while os.getppid() == parent.pid:
            time.sleep(0.5)
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()
    # Nothing but a wish to stop comes while there is a task.
    set_worker(Worker(context, lambda count: connection.send(("progress", count)), connection.poll))
    try:
        connection.send(("ready", None))
        while (task := connection.recv()) is not None:
            connection.send(outcome(*task))
    except (EOFError, OSError):
        os._exit(1)  # the parent is gone


def outcome(work: Callable[..., Any], arguments: tuple[Any, ...]) -> tuple[str, Any]:
    """What becomes of a task: ("done", its result) or ("failed", what it raised)."""
    try:
        return "done", work(*arguments)
    except ArtsimError as error:
        return "failed", error
    except ImportError as error:
        return "failed", import_failure(error, None)
    except Exception as error:  # whatever it is, the parent has to know; it may not survive a trip between processes
        return "failed", DatasetError(f"a worker process failed ({type(error).__name__}: {error})")


def report(count: int) -> None:
    """Tell the run that so much more is done."""
    this_worker().tell(count)


class StoppedError(Exception):
    """The run was asked to stop."""


def stop_if_asked() -> None:
    """Raise :class:`StoppedError` once the run wishes so: then, work in hand is left as it is."""
    if this_worker().is_stopped():
        raise StoppedError
