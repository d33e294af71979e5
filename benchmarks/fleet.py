"""A billion samples over a thousand workers, simulated: ``python -m benchmarks.fleet``.

An event of the simulation is one attempt at one shard by one worker. Workers differ in speed, some are stragglers, die
at random and come back after a while; the storage takes so many requests and bytes a second, and fails some. What a
sample costs in seconds and bytes is measured first, on this machine. Each line is one way to run it; the last line of
the output is one JSON object.
"""

from __future__ import annotations

import heapq
import json
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tyro

from artsim.datasets.generate import generate
from artsim.loading.sources import family_sources

_DAY = 86_400.0


@dataclass(frozen=True)
class Options:
    """What is simulated."""

    samples: int = 1_000_000_000
    workers: int = 1_000
    shard_size: int = 4_096
    sample_seconds: float = 0.0
    """Processor seconds of a sample; 0 measures them."""
    sample_bytes: float = 0.0
    """Of a sample in its shard; 0 measures them."""
    spread: float = 0.15
    """Standard deviation of the logarithm of a worker's speed."""
    stragglers: float = 0.02
    """Share of workers that are five times as slow."""
    hours_to_failure: float = 100.0
    """Mean time until a worker dies."""
    minutes_away: float = 10.0
    """Until a dead worker is replaced."""
    requests_per_s: float = 3_500.0
    """Writes that a prefix of object storage takes a second (S3's published figure)."""
    gigabytes_per_s: float = 12.5
    """That the network or the storage takes: 100 Gbit/s."""
    failing: float = 0.1
    """Share of writes that fail and are made again."""
    driver_tasks_per_s: float = 0.0
    """Tasks that one driver hands out a second; 0 where workers know their share (--part)."""
    whole_parts: bool = False
    """Each worker has a fixed share (--part); else whoever is free takes the next shard (--ray)."""
    core_hour_dollars: float = 0.04
    """Price of an hour of a processor."""
    gigabyte_month_dollars: float = 0.023
    """Price of storing a gigabyte for a month."""
    million_writes_dollars: float = 5.0
    """Price of a million writes."""
    seed: int = 0


@dataclass(frozen=True)
class Outcome:
    """What became of it: hours until all is done, processor hours, hours that workers waited to
    write, writes, deaths, dollars."""

    hours: float
    half_done_hours: float
    processor_hours: float
    waited_hours: float
    writes: int
    deaths: int
    dollars: float
    dollars_a_month: float


def measured(samples: int = 2_000) -> tuple[float, float]:
    """Processor seconds and bytes of a sample of 2,048 points, with everything between its plan and the disk."""
    from artsim.datasets.description import read_plan
    from artsim.datasets.plan import Plan, SampleOptions
    from artsim.datasets.sample_options import PLANNED_ATTEMPTS, draw_sample
    from artsim.datasets.shards import write_shard
    from artsim.model.object_file import ObjectCache
    from artsim.renderers import make_renderer

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        generate(family_sources(["laptop", "drawer", "dishwasher", "eyeglasses"], 16), folder, 64, progress=False)
        plan: Plan = replace(read_plan(folder), num_samples=samples, shard_size=samples, sample=SampleOptions())
        objects, renderer = ObjectCache(folder, below="objects"), make_renderer("raycast")
        shard = plan.shards()[0]
        drawn = (
            draw_sample(objects[plan.object_of(i).key], plan.sample, plan.seed, i, renderer, PLANNED_ATTEMPTS)
            for i in plan.indices(shard)
        )
        start = time.process_time()
        size, _ = write_shard(folder / "measured.tar", drawn)
        return (time.process_time() - start) / len(shard), size / len(shard)


def simulate(fleet: Options) -> Outcome:
    """Run the events until every shard is there."""
    rng = np.random.default_rng(fleet.seed)
    shards = -(-fleet.samples // fleet.shard_size)
    speed = np.exp(fleet.spread * rng.standard_normal(fleet.workers))
    speed[rng.random(fleet.workers) < fleet.stragglers] /= 5.0
    seconds = fleet.shard_size * fleet.sample_seconds / speed
    share = [shards // fleet.workers + (n < shards % fleet.workers) for n in range(fleet.workers)]
    left, finished = shards, 0
    deaths = writes = 0
    lost = spent = half = now = waited = 0.0
    network = handed = 0.0  # when the storage and the driver are next free
    upload = fleet.shard_size * fleet.sample_bytes / (fleet.gigabytes_per_s * 1e9)
    mean = fleet.hours_to_failure * 3600.0
    # Events by time: a worker that is free (0), or one that has a shard to write (1), when it was begun, attempts left.
    events: list[tuple[float, int, int, float, int]] = [(0.0, n, 0, 0.0, 0) for n in range(fleet.workers)]
    dies = rng.exponential(mean, fleet.workers)
    heapq.heapify(events)
    while events and finished < shards:
        now, worker, writing, begun, attempts = heapq.heappop(events)
        if not writing:
            if (share[worker] if fleet.whole_parts else left) <= 0:
                continue
            share[worker], left = share[worker] - 1, left - 1
            if fleet.driver_tasks_per_s:
                now = handed = max(now, handed + 1.0 / fleet.driver_tasks_per_s)
            made = now + seconds[worker] * rng.uniform(0.9, 1.1)
            if dies[worker] < made:  # the shard is lost, and made again
                died = max(dies[worker], now)
                deaths, lost = deaths + 1, lost + died - now
                share[worker], left = share[worker] + 1, left + 1
                back = died + 60.0 * fleet.minutes_away
                dies[worker] = back + rng.exponential(mean)
                heapq.heappush(events, (back, worker, 0, 0.0, 0))
            else:
                spent += made - now
                attempts = int(rng.geometric(1.0 - fleet.failing))
                heapq.heappush(events, (made, worker, 1, now, attempts))
            continue
        writes += 2  # the shard and its record
        network = max(now, network) + max(upload, 2.0 / fleet.requests_per_s)
        waited += network - now
        if attempts > 1:
            heapq.heappush(events, (network + 0.2, worker, 1, begun, attempts - 1))
            continue
        finished += 1
        half = network if finished == shards // 2 else half
        heapq.heappush(events, (network, worker, 0, 0.0, 0))
    end = max(now, network)
    hours = (spent + lost + waited) / 3600.0
    size = fleet.samples * fleet.sample_bytes / 1e9
    return Outcome(
        round(end / 3600.0, 2), round(half / 3600.0, 2), round(hours), round(waited / 3600.0, 1), writes, deaths,
        round(hours * fleet.core_hour_dollars + writes / 1e6 * fleet.million_writes_dollars),
        round(size * fleet.gigabyte_month_dollars),
    )  # fmt: skip


def main(fleet: Options) -> None:
    """Measure, simulate every way, and print a table."""
    if not (fleet.sample_seconds and fleet.sample_bytes):
        seconds, size = measured()
        fleet = replace(fleet, sample_seconds=fleet.sample_seconds or seconds, sample_bytes=fleet.sample_bytes or size)
    print(f"a sample: {1e3 * fleet.sample_seconds:.2f} ms of one processor, {fleet.sample_bytes / 1e3:.1f} kB")
    ways = {
        "free workers take the next shard": fleet,
        "a fixed share each (--part)": replace(fleet, whole_parts=True),
        "no failures": replace(fleet, failing=0.0, hours_to_failure=1e9, stragglers=0.0),
        "no stragglers, fixed share": replace(fleet, whole_parts=True, stragglers=0.0),
        "shards of 1,024": replace(fleet, shard_size=1_024),
        "shards of 65,536": replace(fleet, shard_size=65_536),
        "a worker dies every hour": replace(fleet, hours_to_failure=1.0),
        "a worker dies every hour, shards of 65,536": replace(fleet, hours_to_failure=1.0, shard_size=65_536),
        "10 Gbit/s": replace(fleet, gigabytes_per_s=1.25),
        "a disk of 200 MB/s": replace(fleet, gigabytes_per_s=0.2),
        "10,000 workers": replace(fleet, workers=10_000),
        "half of the writes fail": replace(fleet, failing=0.5),
        "one driver of 100 tasks/s, shards of 1,024": replace(fleet, driver_tasks_per_s=100.0, shard_size=1_024),
    }
    outcomes = {}
    print(f"{'way':<46}{'hours':>8}{'half at':>9}{'cpu h':>8}{'wait h':>8}{'deaths':>8}{'M writes':>10}{'dollars':>9}")
    for name, way in ways.items():
        got = outcomes[name] = simulate(way)
        print(
            f"{name:<46}{got.hours:>8.2f}{got.half_done_hours:>9.2f}{got.processor_hours:>8.0f}{got.waited_hours:>8.1f}"
            f"{got.deaths:>8}{got.writes / 1e6:>10.2f}{got.dollars:>9.0f}"
        )
    print(json.dumps({
        "sample_ms": round(1e3 * fleet.sample_seconds, 3), "sample_kb": round(fleet.sample_bytes / 1e3, 2),
        "terabytes": round(fleet.samples * fleet.sample_bytes / 1e12, 1),
        **{name: [got.hours, got.dollars] for name, got in outcomes.items()},
    }))  # fmt: skip


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
