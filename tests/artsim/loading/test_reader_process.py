"""What a reader takes in its own process is bounded, and its end ends no other."""

from __future__ import annotations

import multiprocessing
import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artsim.errors import AssetError, SceneError
from artsim.loading.reader_process import Bounds, Reader, read_apart

Holds = Callable[[int], None]
BOUNDS = Bounds(memory_mb=50, memory_mb_per_mb=20, time_s=0.3, time_s_per_mb=1)


def read(file: Path, what: str, amount: float, holds: Holds) -> Any:
    if what == "holds":
        holds(int(amount * 1e6))
        what, amount = "memory", 100
    if what == "memory":
        np.ones(int(amount * 1e6 / 8)).sum()
        time.sleep(0.1)
    elif what == "time":
        end = time.process_time() + amount
        while time.process_time() < end:
            pass
    elif what == "sleep":
        time.sleep(amount)
    elif what == "exit":
        os._exit(int(amount))
    elif what == "abort":
        os.abort()
    elif what == "scene":
        raise SceneError("holds two", file, "choose", ("a", "b"))
    elif what == "bug":
        raise ZeroDivisionError
    return os.getpid(), file.resolve()


READER = Reader(f"{__name__}:READER", read, os.getpid, "its library")


def ask(what: str = "", amount: float = 0) -> Any:
    return read_apart(READER, Path("a.usd"), what, amount, bounds=BOUNDS)


def test_one_process_serves_many_files_and_reads_where_it_is_asked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, _ = ask()
    monkeypatch.chdir(tmp_path)
    assert ask() == (first, tmp_path / "a.usd")
    assert first != os.getpid()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "amount", "message"),
    [
        ("memory", 400, "takes over 50 MB of memory to read"),
        ("time", 5, "takes over 0.3 s of processor time to read"),
        ("exit", 3, r"its library ends without an answer .code 3"),
        ("exit", 0, r"its library ends without an answer .code 0"),
        ("abort", 0, "its library ends without an answer"),
    ],
)
def test_what_ends_it_is_an_error_and_the_next_file_is_read(what: str, amount: float, message: str) -> None:
    before, _ = ask()
    with pytest.raises(AssetError, match=message):
        ask(what, amount)
    assert ask()[0] != before


@pytest.mark.slow
def test_large_content_may_take_more() -> None:
    with pytest.raises(AssetError, match="takes over 50 MB"):
        ask("memory", 100)
    ask("holds", 3)
    ask("sleep", 0.5)  # waiting takes no time of the processor


def test_errors_come_back_as_they_are() -> None:
    with pytest.raises(SceneError, match=r"a\.usd: holds two\. Fix: choose") as caught:
        ask("scene")
    assert caught.value.names == ("a", "b")
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        ask("bug")


def _ask_in_a_fork(queue: Any) -> None:
    queue.put(ask()[0])


def test_a_fork_has_its_own() -> None:
    first, _ = ask()
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=_ask_in_a_fork, args=(queue,))
    child.start()
    other = queue.get(timeout=60)
    child.join()
    assert other != first
    assert ask()[0] == first
