"""Generation on a Ray cluster: the bytes of a local run, whatever becomes of nodes and processes meanwhile."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import artsim
from artsim.datasets.sample_options import SampleOptions
from artsim.errors import ConfigError
from artsim.loading.sources import Source, family_sources
from tests.artsim.datasets.troublesome import Troublesome, digests
from tests.conftest import ROOT, installed

pytestmark = pytest.mark.slow

OPTIONS = SampleOptions(num_points=64)


@pytest.fixture(scope="module")
def cluster() -> Iterator[Any]:
    """A head and two nodes, each with one processor; the tests run one after the other."""
    ray = installed("ray")
    os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
    paths = [str(ROOT), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
    before, os.environ["PYTHONPATH"] = os.environ.get("PYTHONPATH"), os.pathsep.join(filter(None, paths))
    from ray.cluster_utils import Cluster

    made = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    ray.init(address=made.address, log_to_driver=False, logging_level="ERROR")
    for _ in range(2):
        made.add_node(num_cpus=1)
    yield made
    ray.shutdown()
    made.shutdown()
    if before is None:
        del os.environ["PYTHONPATH"]
    else:
        os.environ["PYTHONPATH"] = before


def make(sources: list[Source], out: Path, samples: int = 600, **more: Any) -> artsim.datasets.generate.GenerateResult:
    options = {"sample": OPTIONS, "shard_size": 10, "progress": False, "splits": (1, 1, 1), "workers": 1, **more}
    return artsim.generate(sources, out, samples, **options)


def test_no_object_stops_a_run_that_may_leave_it_out(cluster: Any, tmp_path: Path) -> None:
    """One kills its process each time, one never ends loading: the first is done elsewhere, until that is hopeless."""
    good = family_sources(["laptop"], 2)
    bad: list[Source] = [Troublesome(name, f"{n:064x}") for n, name in enumerate(("kills", "stalls"))]  # type: ignore[misc]
    made = make([good[0], *bad, good[1]], tmp_path / "out", 20, skip_broken=True, ray="auto", load_limit=20.0)
    kills, stalls = sorted(made.left_out)
    assert kills.startswith("kills: its process died 4 times")
    assert stalls.startswith("stalls: it took over 20 s")
    make(good, tmp_path / "local", 20)
    beside, alone = digests(tmp_path / "out"), digests(tmp_path / "local")
    for description in ("plan.json", "dataset.json"):  # which name what was left out
        assert alone.pop(description) != beside.pop(description)
    assert beside == alone


def test_two_of_three_nodes_die_and_the_run_is_as_a_local_one(cluster: Any, tmp_path: Path) -> None:
    sources: list[Source] = list(family_sources(["laptop", "drawer"], 3))
    out, killed = tmp_path / "ray", []

    def kill() -> None:
        for node in [*cluster.worker_nodes]:
            while len(list(out.glob("*.tar"))) < 5 * (len(killed) + 1):
                time.sleep(0.01)
            cluster.remove_node(node, allow_graceful=False)
            killed.append(len(list(out.glob("*.tar"))))

    killer = threading.Thread(target=kill)
    killer.start()
    made = make(sources, out, ray="auto")
    killer.join()
    assert max(killed) < 60  # of the shards, some were left to make
    assert made.made == 600
    make(sources, tmp_path / "local")
    assert digests(out) == digests(tmp_path / "local")
    assert make(sources, out, ray="auto").made == 0
    assert not [path for path in out.rglob("*") if path.name.endswith(".part") or path.name.startswith("_")]


def test_a_cluster_that_is_not_there_is_named(tmp_path: Path) -> None:
    ray = installed("ray")
    if ray.is_initialized():
        ray.shutdown()
    with pytest.raises(ConfigError, match=r"there is no Ray cluster .* Fix: start one with: ray start --head; or use"):
        make(list(family_sources(["laptop"], 1)), tmp_path / "out", 10, ray="127.0.0.1:1")
    assert not list((tmp_path / "out").glob("*.tar"))
