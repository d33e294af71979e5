"""The same function in several processes."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from artsim.errors import ArtsimError, ConfigError
from artsim.runs.each import each


@dataclass(frozen=True)
class Squaring:
    """Squares numbers, and ends the process at one: each time, or once where a file may say so."""

    fatal: int = -1
    mark: Path | None = None

    def __call__(self) -> Callable[[int], tuple[int, int]]:
        return self.square

    def square(self, number: int) -> tuple[int, int]:
        if number == self.fatal and not (self.mark is not None and self.mark.exists()):
            if self.mark is not None:
                self.mark.touch()
            os._exit(1)
        return number * number, os.getpid()


@pytest.mark.slow
def test_results_come_in_order_from_several_processes() -> None:
    results = list(each(Squaring(), range(40), 2))
    assert [square for square, _ in results] == [n * n for n in range(40)]
    assert os.getpid() not in {pid for _, pid in results}
    assert {pid for _, pid in each(Squaring(), range(3), 1)} == {os.getpid()}


@pytest.mark.slow
def test_tasks_are_taken_as_they_are_needed() -> None:
    taken = []

    def endless() -> Iterator[int]:
        while True:
            taken.append(len(taken))
            yield taken[-1]

    results = each(Squaring(), endless(), 2)
    assert [next(results)[0] for _ in range(3)] == [0, 1, 4]
    results.close()
    assert len(taken) < 20


@pytest.mark.slow
def test_a_process_that_ends_is_an_error_that_says_what_to_do() -> None:
    with pytest.raises(ArtsimError, match="fewer processes"):
        list(each(Squaring(fatal=3), range(10), 2))


@pytest.mark.slow
def test_the_task_of_a_process_that_ends_is_done_again(tmp_path: Path) -> None:
    found = each(Squaring(fatal=3, mark=tmp_path / "ended"), range(40), 2)
    assert [square for square, _ in found] == [n * n for n in range(40)]
    assert (tmp_path / "ended").exists()


@pytest.mark.parametrize("workers", [0, -1, 5000])
def test_numbers_of_processes_that_make_no_sense_are_refused(workers: int) -> None:
    with pytest.raises(ConfigError, match="1 to"):
        each(Squaring(), [1], workers)
