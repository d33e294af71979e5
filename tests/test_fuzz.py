"""Mutated files of every kind end in success or in one of our own errors; the fuzzer finds what does not."""

from __future__ import annotations

import json
import os
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest

from tests.conftest import CASES, ROOT
from tests.fuzz import targets
from tests.fuzz.seeds import WEIGHTS, Input, corpus, input_at, input_of
from tests.fuzz.targets import TARGETS, examine
from tests.programs import run_here

FOUND = sorted((CASES / "fuzz").iterdir())
"""What the fuzzer has found before."""


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("desk")


@pytest.mark.slow
@pytest.mark.parametrize("file", FOUND, ids=lambda file: file.name)
def test_what_was_found_once_is_found_no_more(file: Path, desk: Path) -> None:
    _, _, finding = examine(input_of(file), desk)
    assert finding is None or finding.sort == "large", finding.text  # memory here is that of all tests before


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("kind", TARGETS)
def test_mutated_files_end_in_our_own_errors(kind: str, desk: Path) -> None:
    findings = []
    with np.errstate(all="ignore"):
        for i in range(200):
            _, _, finding = examine(input_at(7, i, [kind]), desk)
            if finding is not None and finding.sort != "large":
                findings.append(finding.text)
    assert not findings


@pytest.mark.slow
def test_seeds_are_small_and_read_without_an_error(desk: Path) -> None:
    for seed in corpus():
        assert sum(map(len, seed.files.values())) < 60_000
        member, data = next(iter(seed.files.items()))
        TARGETS[seed.kind](Input(seed, member, data).lay_out(desk))
    assert {seed.kind for seed in corpus()} == set(TARGETS) == set(WEIGHTS)


def test_an_input_depends_on_seed_and_number_alone() -> None:
    kinds = list(TARGETS)
    first = [input_at(1, i, kinds) for i in range(60)]
    again = [input_at(1, i, kinds) for i in reversed(range(60))][::-1]
    assert first == again
    assert [one.data for one in first] != [input_at(2, i, kinds).data for i in range(60)]
    assert sum(one.data != one.seed.files[one.member] for one in first) > 50


def test_a_raw_exception_is_found(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(folder: Path) -> None:
        raise KeyError("x")

    monkeypatch.setitem(targets.TARGETS, "cloud", read)
    _, _, finding = examine(input_at(0, 0, ["cloud"]), desk)
    assert finding is not None
    assert finding.sort == "raw"
    assert "KeyError" in finding.cause


def fuzz(out: Path, *options: object) -> CompletedProcess[str]:
    return run_here("benchmarks.fuzz", "--kinds", "cloud", "--workers", 1, "--out", out, *options)


@pytest.mark.slow
def test_a_run_counts_what_it_read_and_goes_on_where_it_stopped(tmp_path: Path) -> None:
    report = {"end": 20, "slowest_s": 0.5, "peak_mb": 1.0, "causes": {"raw KeyError": 1}}
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "0.json").write_text(json.dumps(report))
    done = fuzz(tmp_path, "--runs", "30")
    found = json.loads(done.stdout.splitlines()[-1])
    assert (done.returncode, found["runs"], found["raw_exceptions"], found["crashes"]) == (1, 30, 1, 0)
    assert 0.5 <= found["slowest_s"] < 2.0
    assert 1.0 <= found["peak_mb"] < 500.0
    assert json.loads((tmp_path / "parts" / "0.json").read_text())["end"] == 30
    assert fuzz(tmp_path, "--runs", "30").stdout == done.stdout  # nothing is left to be done
    other = fuzz(tmp_path, "--runs", "30", "--seed", "1")
    assert other.returncode == 2
    assert "another run is in this folder" in other.stderr


@pytest.mark.slow
def test_an_input_that_ends_its_process_is_a_crash_and_the_next_ones_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "sitecustomize.py").write_text(
        "import os, sys\n"
        "if '--part' in sys.orig_argv:\n"
        "    from tests.fuzz import seeds\n"
        "    real = seeds.input_at\n"
        "    seeds.input_at = lambda seed, i, kinds: os._exit(7) if i == 3 else real(seed, i, kinds)\n"
    )
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), str(ROOT)]))
    done = fuzz(tmp_path / "out", "--runs", "6")
    assert done.returncode == 1, done.stderr
    report = json.loads((tmp_path / "out" / "parts" / "0.json").read_text())
    assert (report["end"], report["causes"]) == (6, {"crash exit code 7": 1})
    (found,) = (path for path in (tmp_path / "out" / "found").rglob("cloud-*"))
    assert input_of(found).data == input_at(0, 3, ["cloud"]).data
