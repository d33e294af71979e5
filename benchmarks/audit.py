"""Are the procedural objects sim-ready, and how fast are they made? ``python -m benchmarks.audit`` (``make audit``).

Makes many objects of every category (seeds 0, 1, ...) and passes each through the gates; looks for near-duplicates
within each category; and passes the real objects of ``ARTSIM_PARTNET_DIR`` through the same gates, side by side. The
last line is one JSON object with the fractions ``strict_urdf``, ``strict_kinematic``, ``inertia``, ``collision_free``,
``near_duplicates``, and objects per second of one core, without and with the gates that need no file.
"""

import json
import multiprocessing
import os
import platform
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
import tyro
from scipy.spatial import cKDTree

from artsim import make
from artsim.checks.validity import check, check_file
from artsim.common.progress import track
from artsim.errors import ArtsimError, ConfigError
from artsim.export import export
from artsim.families import FAMILIES
from artsim.loading.sources import FamilySource, FileSource, Source, find_sources
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject

NEAR = 0.01
"""Chamfer distance of near-duplicates, over the diagonal."""
_DENSE, _SPARSE, _PROBE = 20_000, 400, 32

T = TypeVar("T")


@dataclass(frozen=True)
class Options:
    """Pass many objects through the sim-readiness gates."""

    objects: int = 10_000
    """Procedural objects over all categories."""
    categories: list[str] = field(default_factory=lambda: sorted(FAMILIES))
    """Which of ours."""
    workers: int = field(default_factory=lambda: os.cpu_count() or 1)
    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Real objects to pass through the same gates."""
    rate: int = 5
    """Objects of each category whose making is timed."""


@dataclass(frozen=True)
class Outcome:
    """Gates that one object failed, with the problems found."""

    category: str
    name: str
    failed: dict[str, tuple[str, ...]]


def main(options: Options) -> None:
    """Print tables, failures by seed, and the JSON line."""
    start = time.perf_counter()
    print(f"{platform.processor() or platform.machine()}, {options.workers} processes")
    categories = options.categories
    for category in categories:
        if category not in FAMILIES:
            raise ConfigError(f"unknown category {category!r}", "categories", f"use {', '.join(sorted(FAMILIES))}")
    sources = [FamilySource(categories[i % len(categories)], i // len(categories)) for i in range(options.objects)]
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(options.workers, context) as team:
        outcomes = list(_bar(team.map(audit, sources, chunksize=8), "objects", len(sources)))
        counts = [sum(s.category == c for s in sources) for c in categories]
        found = _bar(team.map(near_duplicates, categories, counts), "near-duplicates", len(categories))
        repeats = dict(zip(categories, found, strict=True))
        real = find_sources([options.partnet]) if options.partnet else []
        real_outcomes = list(_bar(team.map(audit, real), "real objects", len(real)))
    print(f"\n{len(outcomes)} procedural objects, seeds 0 to {max(counts) - 1} of each category")
    result = table(outcomes, repeats)
    if real_outcomes:
        print(f"\n{len(real_outcomes)} real objects (our measurement of PartNet-Mobility, the files as they are)")
        table(real_outcomes, {})
    print("\nprocedural objects that failed:")
    for outcome in outcomes:
        for gate, problems in outcome.failed.items():
            print(f"  {outcome.name}: {gate}: {problems[0]}")
    print(f"\n{time.perf_counter() - start:.0f} s")
    result |= rates(categories, options.rate)
    print(json.dumps(result))


def rates(categories: Sequence[str], count: int) -> dict[str, float]:
    """Objects per second of processor time, made and made with gates, over some of every category."""
    made = checked = 0.0
    for category in track("rates", categories, unit="category", leave=False):
        make(category, 0)
        start = time.process_time()
        objects = [make(category, seed) for seed in range(count)]
        made += time.process_time() - start
        start = time.process_time()
        for obj in objects:
            check(obj)
        checked += time.process_time() - start
    total = count * len(categories)
    return {"objects_per_s": round(total / made, 1), "gated_objects_per_s": round(total / (made + checked), 1)}


def _bar(items: Iterable[T], name: str, total: int) -> Iterable[T]:
    return track(name, items, total=total, unit="object", leave=False)


GATES = ("strict URDF", "kinematics", "inertia", "collision free", "joined parts apart", "watertight",
         "convex collision geometry")  # fmt: skip


def audit(source: Source) -> Outcome:
    """All gates on one object; what cannot be loaded has failed every one."""
    category = source.category if isinstance(source, FamilySource) else source.path.parent.parent.name
    try:
        obj = source.load()
        with tempfile.TemporaryDirectory() as folder:
            path = source.path if isinstance(source, FileSource) else Path(folder)
            if isinstance(source, FamilySource):
                export(obj, path)
            failed = {gate.name: gate.problems for gate in check_file(obj, path) if not gate.passed}
    except ArtsimError as error:
        failed = {gate: (str(error),) for gate in GATES}
    return Outcome(category, source.name, failed)


def table(outcomes: Sequence[Outcome], repeats: dict[str, tuple[int, int]]) -> dict[str, float]:
    """Print the share of each category's objects that pass each gate; returns the shares over all."""
    groups: dict[str, list[Outcome]] = defaultdict(list)
    for outcome in outcomes:
        groups[outcome.category].append(outcome)
    heads = ("URDF", "kinem.", "inertia", "coll.free", "joined", "closed", "convex")
    print(f"{'category':20s}{'objects':>8s}" + "".join(f"{h:>10s}" for h in heads) + f"{'near-dup.':>11s}")
    for category, group in [*sorted(groups.items()), ("all", list(outcomes))]:
        shares = [100 * np.mean([gate not in o.failed for o in group]) for gate in GATES]
        near, pairs = repeats.get(category, (0, 0)) if category != "all" else _sum(repeats)
        near_share = f"{100 * near / pairs:10.2f}%" if pairs else f"{'-':>11s}"
        print(f"{category:20s}{len(group):8d}" + "".join(f"{share:9.1f}%" for share in shares) + near_share)
    passed = {gate: float(np.mean([gate not in o.failed for o in outcomes])) for gate in GATES}
    near, pairs = _sum(repeats)
    return {
        "strict_urdf": passed["strict URDF"],
        "strict_kinematic": passed["kinematics"],
        "inertia": passed["inertia"],
        "collision_free": passed["collision free"],
        "near_duplicates": float(near / pairs) if pairs else 0.0,
    }


def _sum(repeats: dict[str, tuple[int, int]]) -> tuple[int, int]:
    return sum(near for near, _ in repeats.values()), sum(pairs for _, pairs in repeats.values())


def near_duplicates(category: str, count: int) -> tuple[int, int]:
    """Pairs of one category's first objects whose surfaces at rest lie nearer than ``NEAR``, and all pairs.

    The distance is the mean of both directed mean distances between surface points, over the mean of the diagonals.
    """
    objects = [make(category, seed) for seed in range(count)]
    dense = [surface_points(obj, _DENSE) for obj in objects]
    trees = [cKDTree(points) for points in dense]
    near = 0
    for i in range(count):
        for j in range(i):
            limit = NEAR * 0.5 * (objects[i].diagonal + objects[j].diagonal)
            # Most pairs are far from each other: a few points tell.
            probe = trees[j].query(dense[i][:_PROBE])[0].mean()
            if probe > 3.0 * limit:
                continue
            there, back = trees[j].query(dense[i][:_SPARSE])[0], trees[i].query(dense[j][:_SPARSE])[0]
            near += int(0.5 * (there.mean() + back.mean()) < limit)
    return near, count * (count - 1) // 2


def surface_points(obj: ArticulatedObject, count: int) -> Array:
    """(count, 3) points drawn uniformly from the surface at rest, metres."""
    rng = np.random.default_rng(0)
    corners = np.concatenate([(p.vertices * obj.scale)[p.faces] for p in obj.parts])
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1)
    chosen = rng.choice(len(corners), count, p=area / area.sum())
    a, b = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    triangle = corners[chosen]
    points: Array = (1 - a) * triangle[:, 0] + a * (1 - b) * triangle[:, 1] + a * b * triangle[:, 2]
    return points


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
