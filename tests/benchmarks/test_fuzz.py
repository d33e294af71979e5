"""Mutated files of every kind end in success or in one of our own errors; the fuzzer finds what does not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from artsim.errors import ConfigError
from benchmarks.fuzz import targets
from benchmarks.fuzz.__main__ import CHUNK, Options, State, run
from benchmarks.fuzz.corpus import corpus
from benchmarks.fuzz.inputs import Desk, Input, input_at, input_of
from benchmarks.fuzz.targets import TARGETS, Target
from benchmarks.fuzz.worker import Report, examine
from tests.conftest import CASES

FOUND = sorted((CASES / "fuzz").iterdir())
"""What the fuzzer has found before."""


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Desk:
    return Desk(tmp_path_factory.mktemp("desk"))


@pytest.mark.slow
@pytest.mark.parametrize("file", FOUND, ids=lambda file: file.name)
def test_what_was_found_once_is_found_no_more(file: Path, desk: Desk) -> None:
    _, _, finding = examine(0, input_of(file, corpus()), desk)
    assert finding is None or finding.sort == "large", finding.text  # memory here is that of all tests before


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", TARGETS)
def test_mutated_files_end_in_our_own_errors(kind: str, desk: Desk) -> None:
    findings = []
    with np.errstate(all="ignore"):
        for i in range(150):
            _, _, finding = examine(i, input_at(7, i, [kind], corpus()), desk)
            if finding is not None and finding.sort != "large":
                findings.append(finding.text)
    assert not findings


def test_seeds_are_small_and_read_without_an_error(desk: Desk) -> None:
    for seed in corpus():
        assert len(seed.files[seed.member]) < 60_000
        assert targets.fails(seed.kind, desk.lay_out(Input(seed, seed.files[seed.member]))) is None
        TARGETS[seed.kind].read(desk.lay_out(Input(seed, seed.files[seed.member])))
    assert {seed.kind for seed in corpus()} == set(TARGETS)


def test_an_input_depends_on_seed_and_number_alone() -> None:
    kinds = list(TARGETS)
    first = [input_at(1, i, kinds, corpus()) for i in range(60)]
    again = [input_at(1, i, kinds, corpus()) for i in reversed(range(60))][::-1]
    assert [one.data for one in first] == [one.data for one in again]
    assert [one.data for one in first] != [input_at(2, i, kinds, corpus()).data for i in range(60)]


def test_a_raw_exception_is_found(desk: Desk, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(folder: Path) -> None:
        raise KeyError("x")

    monkeypatch.setitem(TARGETS, "side", Target(read, 1))
    _, _, finding = examine(3, input_at(0, 0, ["side"], corpus()), desk)
    assert finding is not None
    assert (finding.index, finding.sort) == (3, "raw")
    assert "KeyError" in finding.cause


def test_a_run_goes_on_where_it_stopped() -> None:
    state = State(0, ["urdf"])
    assert state.missing(2 * CHUNK + 10) == [(0, CHUNK), (CHUNK, 2 * CHUNK), (2 * CHUNK, 2 * CHUNK + 10)]
    state.add(Report(CHUNK, 2 * CHUNK))
    state.add(Report(2 * CHUNK, 2 * CHUNK + 10))
    assert state.missing(2 * CHUNK + 10) == [(0, CHUNK)]
    assert state.missing(3 * CHUNK) == [(0, CHUNK), (2 * CHUNK + 10, 3 * CHUNK)]
    assert state.runs == CHUNK + 10


@pytest.mark.slow
def test_a_run_of_worker_processes_counts_what_it_read(tmp_path: Path) -> None:
    options = Options(runs=30, workers=1, kinds=("side",), out=tmp_path / "out")
    state = run(options)
    assert (state.runs, state.raw_exceptions, state.crashes) == (30, 0, 0)
    assert 0.0 < state.slowest_s < 2.0
    assert 0.0 < state.peak_mb < 500.0
    assert run(options) == state  # nothing is left to be done
    with pytest.raises(ConfigError, match="another run is in this folder"):
        run(Options(runs=30, seed=1, kinds=("side",), out=tmp_path / "out"))


def test_unknown_kinds_are_refused() -> None:
    with pytest.raises(ConfigError, match="no kind x"):
        Options(kinds=("x",))
