"""Estimation on a Ray cluster gives the lines of a local run, in order, though processes die."""

from __future__ import annotations

import json
import os
import signal
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artperl.commands.estimate import Estimate
from artperl.evaluation.samples import frozen_samples
from artsim.errors import ArtsimError, ConfigError
from artsim.runs.each import each
from tests.conftest import installed

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module", autouse=True)
def cluster() -> Iterator[None]:
    """Ray on this machine, with two processors."""
    ray = installed("ray")
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    ray.init("local", num_cpus=2, include_dashboard=False, log_to_driver=False, logging_level="ERROR")
    yield
    ray.shutdown()


@dataclass(frozen=True)
class Squaring:
    """Squares numbers; its process dies of 7 the first time, and 13 has no square."""

    marks: Path

    def __call__(self) -> Callable[[int], int]:
        return self.square

    def square(self, number: int) -> int:
        if number == 7 and not (self.marks / "died").exists():
            (self.marks / "died").touch()
            os.kill(os.getpid(), signal.SIGKILL)
        if number == 13:
            raise ArtsimError("has no square", "13")
        return number * number


def test_results_come_in_order_and_what_a_dead_process_had_is_done_again(tmp_path: Path) -> None:
    assert list(each(Squaring(tmp_path), range(12), ray="auto")) == [n * n for n in range(12)]
    assert (tmp_path / "died").exists()
    found = each(Squaring(tmp_path), range(8, 40), ray="auto")
    with pytest.raises(ArtsimError, match="has no square"):
        list(found)


def test_lines_are_those_of_a_local_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # nodes run elsewhere
    for n, sample in enumerate(frozen_samples(["laptop"], 2, 1)):
        Path("clouds").mkdir(exist_ok=True)
        np.save(f"clouds/{n}.npy", sample.points[:1024])
    Path("clouds/2.npy").write_bytes(b"no cloud")

    def lines(name: str, **more: Any) -> list[dict[str, Any]]:
        with pytest.raises(SystemExit):  # one cloud is none
            Estimate((Path("clouds"),), out=Path(name), **more).run()
        told = [json.loads(line) for line in Path(name).read_text().splitlines()]
        return [{key: value for key, value in line.items() if key != "milliseconds"} for line in told]

    here, there = lines("here.jsonl"), lines("there.jsonl", ray="auto")
    assert [line["file"] for line in there] == [line["file"] for line in here]
    for mine, other in zip(here[:2], there[:2], strict=True):
        np.testing.assert_allclose(mine["T_camera_part"], other["T_camera_part"], atol=1e-9)
    assert "error" in there[2]
    with pytest.raises(ConfigError, match="leave one of them out"):
        Estimate((Path("clouds"),), ray="auto", workers=2).run()
