"""A Ray cluster that loses two of its three nodes during a run: ``python -m benchmarks.cluster``.

Three nodes of one processor run on this machine. Two are killed at a third and at two thirds of the run. The dataset
must be complete, and equal to that of one process byte for byte. The last line is one JSON object.
"""

from __future__ import annotations

import json
import os
import tempfile
import threading
import time
from dataclasses import dataclass
from pathlib import Path

import tyro

from artsim.common.files import file_sha256
from artsim.datasets.generate import generate
from artsim.datasets.sample_options import SampleOptions
from artsim.loading.sources import Source, family_sources


@dataclass(frozen=True)
class Options:
    """Kill nodes, and compare."""

    samples: int = 20_000
    num_points: int = 512
    shard_size: int = 64


def main(options: Options) -> None:
    """Run on the cluster and alone, and compare."""
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")
    import ray
    from ray.cluster_utils import Cluster

    sources: list[Source] = list(family_sources(["laptop", "drawer", "dishwasher"], 8))
    sample = SampleOptions(num_points=options.num_points)
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    ray.init(address=cluster.address, log_to_driver=False, logging_level="ERROR")
    for _ in range(2):
        cluster.add_node(num_cpus=1)
    with tempfile.TemporaryDirectory() as name:
        out, alone, killed = Path(name) / "cluster", Path(name) / "alone", list[int]()
        shards = options.samples // options.shard_size

        def kill() -> None:
            for third, node in enumerate([*cluster.worker_nodes], start=1):
                while len(list(out.glob("*.tar"))) < third * shards / 3:
                    time.sleep(0.05)
                cluster.remove_node(node, allow_graceful=False)
                killed.append(len(list(out.glob("*.tar"))))

        killer = threading.Thread(target=kill, daemon=True)
        killer.start()
        made = generate(sources, out, options.samples, sample=sample, shard_size=options.shard_size, ray="auto")
        killer.join()
        ray.shutdown()
        cluster.shutdown()
        generate(sources, alone, options.samples, sample=sample, shard_size=options.shard_size, workers=1)
        digests = [
            {
                path.relative_to(folder).as_posix(): file_sha256(path)
                for path in sorted(folder.rglob("*"))
                if path.is_file() and not path.name.startswith(".")
            }
            for folder in (out, alone)
        ]
    result = {
        "samples": made.made, "shards": shards, "killed_at_shards": killed, "same_bytes": digests[0] == digests[1],
        "files": len(digests[0]),
    }  # fmt: skip
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
