"""A process of its own for readers that a damaged or hostile file may bring down, with bounds on memory and time.

A native library may end the process where a file is damaged, and a file of few bytes may stand for billions of things.
The process is started once and serves many files. One that ends, or takes more than it may, is replaced.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from artsim.common.extras import require_extra
from artsim.errors import ArtsimError, AssetError
from artsim.loading.meshes import LoadLimits
from artsim.loading.messages import read_message, write_message

_POLL_S = 0.005
"""Between two looks at the process: it can take some 20 MB meanwhile."""
_ARGUMENTS = (LoadLimits,)
"""Records that a request may hold besides plain values."""
_START = "from artsim.loading.reader_process import serve; serve()"


class Bounds(NamedTuple):
    """What reading may take, besides what the process has taken before.

    ``memory_mb`` and ``time_s`` (of the processor) are for any file; the others for each megabyte of its content.
    """

    memory_mb: float = 150.0
    memory_mb_per_mb: float = 20.0
    time_s: float = 1.5
    time_s_per_mb: float = 10.0


class Reader(NamedTuple):
    """What reads files in the process.

    Attributes
    ----------
    name : str
        Where it stands, as ``module:name``: the process imports it.
    read : callable
        Of a module. Called as ``read(file, *arguments, holds)``; it calls ``holds`` with the bytes that the content has
        before it lets the library read them.
    prepare : callable
        Called once in each process: what it takes, such as imports, counts for no file.
    library : str
        For messages.
    records : tuple of type
        Dataclasses that arguments and results may hold: see :mod:`artsim.loading.messages`.
    """

    name: str
    read: Callable[..., Any]
    prepare: Callable[[], object]
    library: str
    records: tuple[type, ...] = ()


def read_apart(reader: Reader, file: Path, *arguments: Any, bounds: Bounds | None = None) -> Any:
    """What a reader makes of a file, in another process.

    Parameters
    ----------
    reader : Reader
    file : Path
    *arguments
        More for the reader.
    bounds : Bounds, optional

    Raises
    ------
    AssetError
        When reading takes too much, or ends the process.
    ArtsimError
        What the reader raises.
    """
    with _lock:
        worker = _running(reader.library)
        try:
            done, answer = worker.ask(reader, file, arguments, bounds or Bounds())
        except BaseException:  # Ctrl-C included: what it would answer later belongs to no one
            worker.end()
            raise
    if isinstance(answer, ArtsimError):
        raise answer
    if not done:
        raise RuntimeError(f"a reader failed:\n{answer}")
    return answer


_lock = threading.Lock()
_workers: dict[int, _Worker] = {}
"""By the process that they serve: a fork of it must not use its worker."""


def _running(library: str) -> _Worker:
    worker = _workers.get(os.getpid())
    if worker is None or not worker.lives():
        with require_extra(f"{library}, in a process with bounds,"):
            worker = _workers[os.getpid()] = _Worker()
        atexit.register(worker.end)
    return worker


class _Worker:
    def __init__(self) -> None:
        import psutil

        self._process = subprocess.Popen(
            [sys.executable, "-c", _START],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # where a library ends a process it says so at length
            # A library that ends the process writes a report to the folder for temporary files, unless there is none.
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), "TMPDIR": os.devnull},
        )
        self._seen = psutil.Process(self._process.pid)
        self._gone = psutil.Error

    def lives(self) -> bool:
        return self._process.poll() is None

    def end(self) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            if pipe is not None:
                with contextlib.suppress(OSError):
                    pipe.close()

    def ask(self, reader: Reader, file: Path, arguments: Any, bounds: Bounds) -> tuple[bool, Any]:
        """Whether a file is read, and what is read or the error."""
        self._send((str(Path.cwd()), reader.name, (file, *arguments)))
        self._receive(reader)  # it is ready: what it has taken by now counts for no file
        watch = _Watch(self._seen, self._gone, bounds)
        try:
            self._send(None)
            while True:
                kind, value = self._receive(reader)
                if kind != "holds":
                    return kind == "done", value
                watch.content_mb = value / 1e6
        except (EOFError, OSError, ValueError) as error:
            self._process.kill()  # one that answers in no message is no better than one that has ended
            code = self._process.wait()
            if watch.excess is not None:
                raise AssetError(
                    f"takes over {watch.excess} to read, more than files of its size do",
                    file,
                    "leave out what is not the object: references, variants and copies multiply",
                ) from error
            name = f"signal {-code}" if code < 0 else f"code {code}"
            raise AssetError(
                f"is damaged: {reader.library} ends without an answer ({name})", file, "write it again, or convert it"
            ) from error
        finally:
            watch.stop()

    def _send(self, what: Any) -> None:
        assert self._process.stdin is not None
        write_message(self._process.stdin, what)

    def _receive(self, reader: Reader) -> Any:
        assert self._process.stdout is not None
        return read_message(self._process.stdout, reader.records)


class _Watch(threading.Thread):
    """Ends a process when it takes more than it may."""

    def __init__(self, seen: Any, gone: type[Exception], bounds: Bounds):
        super().__init__(daemon=True)
        self._seen, self._gone, self._bounds = seen, gone, bounds
        self._done = threading.Event()
        self._memory, self._time = self._taken()
        self.content_mb = 0.0
        self.excess: str | None = None
        self.start()

    def _taken(self) -> tuple[float, float]:
        """Memory, MB, and time, s, of the process."""
        times = self._seen.cpu_times()
        return self._seen.memory_info().rss / 1e6, times.user + times.system

    def run(self) -> None:
        while not self._done.wait(_POLL_S):
            try:
                memory, time = self._taken()
            except self._gone:
                return
            most = self._bounds.memory_mb + self._bounds.memory_mb_per_mb * self.content_mb
            longest = self._bounds.time_s + self._bounds.time_s_per_mb * self.content_mb
            if memory - self._memory > most:
                self.excess = f"{most:.0f} MB of memory"
            elif time - self._time > longest:
                self.excess = f"{longest:.1f} s of processor time"
            else:
                continue
            with contextlib.suppress(self._gone):
                self._seen.kill()
            return

    def stop(self) -> None:
        self._done.set()
        self.join()


def serve() -> None:
    """Answer requests until their pipe is closed: what the process does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who asks
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)

    def answer(kind: str, value: Any) -> None:
        write_message(answers, (kind, value))

    readers: dict[str, Reader] = {}
    while True:
        try:
            folder, name, arguments = read_message(sys.stdin.buffer, _ARGUMENTS)
            if name not in readers:
                module, _, attribute = name.partition(":")
                readers[name] = getattr(import_module(module), attribute)
                readers[name].prepare()
            answer("ready", None)
            read_message(sys.stdin.buffer)
        except EOFError:
            return
        try:
            os.chdir(folder)
            answer("done", readers[name].read(*arguments, lambda size: answer("holds", size)))
        except ArtsimError as error:
            answer("failed", error)
        except Exception:  # a bug of a reader, of any kind: whoever asks is to see it, with its traceback
            answer("broken", traceback.format_exc())
