"""How near procedural objects come to real ones: ``python -m benchmarks.realism --partnet DIR``.

For every category with real objects, 500 procedural objects are compared with the real ones of the dev half of a frozen
split: surfaces, boxes, joint placement and joint ranges, at a diagonal of 1 (:mod:`artsim.checks.realism` says how). A
table per category shows the median distance between two real objects (the yardstick), the share of real objects that
are the nearest one of some procedural object (COV), the mean distance of a real object's nearest procedural one (MMD),
and how many real objects have a procedural neighbour within the yardstick. The last line is one JSON object.
"""

from __future__ import annotations

import json
import multiprocessing
import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from artsim import make
from artsim.checks.realism import (
    MEASURES,
    REAL,
    Half,
    Likeness,
    Realism,
    Split,
    distances,
    draw_split,
    likeness,
    pair_distances,
    read_split,
    real_objects,
)
from artsim.common.progress import track
from artsim.errors import ConfigError
from artsim.families import FAMILIES
from artsim.model.kinematics import Array

SPLIT = Path(__file__).parent / "splits" / "partnet_dev.json"


@dataclass(frozen=True)
class Options:
    """Compare procedural with real objects."""

    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Folder of real objects."""
    categories: list[str] = field(default_factory=lambda: sorted(set(REAL) & set(FAMILIES)))
    """Which of ours."""
    objects: int = 500
    """Procedural objects of each category, seeds 0 and up."""
    half: Half = "dev"
    """Which real objects. Families are tuned on "dev" alone; "test" tells whether that carries over."""
    split: Path = SPLIT
    """The frozen split; drawn and written first where there is none."""
    workers: int = 2
    """Processes."""


def main(options: Options) -> None:
    """Compare and print."""
    folder = options.partnet
    if folder is None:
        raise ConfigError("no folder of real objects is named", "partnet", "set ARTSIM_PARTNET_DIR")
    for category in options.categories:
        if category not in REAL or category not in FAMILIES:
            known = ", ".join(sorted(set(REAL) & set(FAMILIES)))
            raise ConfigError(f"nothing to compare for {category!r}", "categories", f"use {known}")
    if not options.split.exists():
        options.split.write_text(json.dumps(draw_split(folder), indent=1) + "\n")
    split = read_split(options.split)
    result = {}
    # Spawned, since forked copies of a process with threads can hang.
    with ProcessPoolExecutor(options.workers, multiprocessing.get_context("spawn")) as pool:
        for category in options.categories:
            found = compare(category, folder, split, options.half, options.objects, pool)
            if found is not None:
                names, realism = found
                print("\n".join(table(category, names, realism)), flush=True)
                result[category] = summary(names, realism)
    print(json.dumps({"objects": options.objects, "half": options.half, "categories": result}))


def compare(
    category: str, folder: Path, split: Split, half: Half, objects: int, pool: ProcessPoolExecutor
) -> tuple[list[str], Realism] | None:
    """Ids of the real objects and the comparison; None where the half has none."""
    real = {obj.object_id: likeness(obj) for obj in real_objects(category, folder, split, half)}
    if not real:
        return None
    yardstick = list(real.values())
    if len(yardstick) < 2:  # no pair: the other half lends its objects to measure with, and to nothing else
        other: Half = "test" if half == "dev" else "dev"
        yardstick += [likeness(obj) for obj in real_objects(category, folder, split, other)]
    batch = 10
    starts = range(0, objects, batch)
    tasks = [(category, range(s, min(s + batch, objects)), list(real.values())) for s in starts]
    rows = track(category, pool.map(_to_real, tasks), total=len(tasks), leave=False)
    return list(real), Realism(np.concatenate(list(rows)), pair_distances(yardstick))


def _to_real(task: tuple[str, Sequence[int], list[Likeness]]) -> Array:
    """(len(seeds), R, 5) distances of some procedural objects from all real ones."""
    category, seeds, real = task
    made = (likeness(make(category, seed)) for seed in seeds)
    return np.array([[distances(ours, theirs) for theirs in real] for ours in made])


def table(category: str, names: Sequence[str], realism: Realism) -> list[str]:
    """Lines of text."""
    near = realism.near
    lines = [
        f"{category}: {len(realism.to_real)} procedural, {len(names)} real, "
        f"{realism.near_at_once.sum()} of them with a neighbour that is near by every measure at once",
        f"  {'':9}{'real':>8}{'COV':>8}{'MMD':>8}{'near':>8}   farthest real object",
    ]
    for m, measure in enumerate(MEASURES):
        comparable, worst = bool(np.isfinite(realism.yardstick[m])), int(realism.neighbour[:, m].argmax())
        lines.append(
            f"  {measure:9}{realism.yardstick[m]:8.4f}{realism.coverage[m]:8.2f}"
            f"{realism.minimum_matching_distance[m]:8.4f}{near[:, m].sum() if comparable else '-':>5}/{len(names)}"
            f"   {names[worst]} at {_share(realism, worst, m)}"
        )
    measurable = np.isfinite(realism.yardstick).any()
    for r in map(int, np.flatnonzero(measurable & (~near.all(axis=1) | ~realism.near_at_once))):
        far = [f"{MEASURES[m]} {_share(realism, r, int(m))}" for m in np.flatnonzero(~near[r])]
        lines.append(f"  far off: {names[r]} ({', '.join(far) or 'no neighbour near by every measure at once'})")
    return lines


def _share(realism: Realism, r: int, m: int) -> str:
    """Distance from a real object to its nearest procedural one, over the median distance between two real ones."""
    distance, median = realism.neighbour[r, m], realism.yardstick[m]
    if np.isnan(median):
        return f"{distance:.4f}, no two real ones"
    return f"{distance / median:.2f} of the median" if median > 1e-9 else f"{distance:.4f}, real ones do not differ"


def summary(names: Sequence[str], realism: Realism) -> dict[str, Any]:
    """What the last line says of a category; lengths in diagonals."""
    per_measure = {
        measure: {
            "median_real": _rounded(realism.yardstick[m]),
            "coverage": _rounded(realism.coverage[m]),
            "mmd": _rounded(realism.minimum_matching_distance[m]),
            "near": _rounded(realism.near[:, m].mean()),
        }
        for m, measure in enumerate(MEASURES)
    }
    return {
        "real": len(names),
        "near": _rounded(realism.near.all(axis=1).mean()),
        "near_at_once": _rounded(realism.near_at_once.mean()),
        **per_measure,
    }


def _rounded(value: float) -> float | None:
    return round(float(value), 5) if np.isfinite(value) else None


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
