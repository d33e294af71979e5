"""How near procedural objects come to real ones: ``python -m benchmarks.realism --partnet DIR``.

Every category with real objects is compared with those of a frozen split, by :mod:`artsim.checks`:

- likeness: surfaces, boxes, joint placement and joint ranges, at a diagonal of 1. Printed are the median distance
  between two real objects (the yardstick), the share of real objects that are the nearest one of some procedural object
  (COV), the mean distance of a real object's nearest procedural one (MMD), and how many real objects have a procedural
  neighbour within the yardstick;
- ranges of ratios: ``MISSES`` marks a ratio whose range does not hold the real objects, ``SHORT`` one that does not
  reach beyond them;
- conventions: medians of the extents over the diagonal, the root, and where joints point.

The last line is one JSON object.
"""

import json
import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import tyro

from artsim import make
from artsim.checks.conventions import Frame, differences
from artsim.checks.ranges import Values, left_out, ratios, reach
from artsim.checks.realism import (
    MEASURES,
    REAL,
    Half,
    Likeness,
    Realism,
    distances,
    draw_split,
    likeness,
    pair_distances,
    read_split,
    real_objects,
)
from artsim.common.progress import track
from artsim.errors import ConfigError
from artsim.families import CATEGORIES
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject

SPLIT = Path(__file__).parent / "splits" / "partnet_dev.json"
_SHOWN = 0.1
"""Share of the objects from which a sort of joint is shown."""
_FRAMES = 60
"""Procedural objects whose frames are compared."""

T = TypeVar("T")


@dataclass(frozen=True)
class Options:
    """Compare procedural with real objects."""

    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Folder of real objects."""
    categories: tuple[str, ...] = tuple(sorted(set(REAL) & set(CATEGORIES)))
    """Which of ours."""
    objects: int = 120
    """Procedural objects of each category, seeds 0 and up."""
    half: Half = "dev"
    """Which real objects. Families are tuned on "dev" alone; "test" tells whether that carries over."""
    split: Path = SPLIT
    """The frozen split; drawn and written first where there is none."""
    workers: int = 2
    """Processes."""

    def __post_init__(self) -> None:
        if self.partnet is None:
            raise ConfigError("no folder of real objects is named", "partnet", "set ARTSIM_PARTNET_DIR")
        known = sorted(set(REAL) & set(CATEGORIES))
        if unknown := sorted(set(self.categories) - set(known)):
            raise ConfigError(f"nothing to compare for {unknown[0]!r}", "categories", f"use {', '.join(known)}")


def main(options: Options) -> None:
    """Compare and print."""
    folder = options.partnet
    assert folder is not None
    if not options.split.exists():
        options.split.write_text(json.dumps(draw_split(folder), indent=1) + "\n")
    split, result = read_split(options.split), {}
    # Spawned, since forked copies of a process with threads can hang.
    with ProcessPoolExecutor(options.workers, multiprocessing.get_context("spawn")) as pool:
        for category in options.categories:
            halves: dict[Half, list[ArticulatedObject]] = {
                half: list(real_objects(category, folder, split, half)) for half in ("dev", "test")
            }
            real = halves[options.half]
            if not real:
                continue
            # Without a pair, the other half lends its objects to measure with, and to nothing else.
            pairs = real if len(real) > 1 else halves["dev"] + halves["test"]
            print(f"{category}: {options.objects} procedural, {len(real)} real")
            result[category] = {
                "real": len(real),
                **compare_likeness(category, real, pairs, options.objects, pool),
                **compare_ranges(category, real, options.objects, pool),
                "differs": compare_frames(category, real),
            }
    print(json.dumps({"objects": options.objects, "half": options.half, "categories": result}))


def _parallel(category: str, work: Callable[[Any], T], tasks: Sequence[Any], pool: ProcessPoolExecutor) -> Iterator[T]:
    return iter(track(category, pool.map(work, tasks, chunksize=8), total=len(tasks), leave=False))


def compare_likeness(
    category: str, real: Sequence[ArticulatedObject], pairs: Sequence[ArticulatedObject], count: int,
    pool: ProcessPoolExecutor,
) -> dict[str, Any]:  # fmt: skip
    """Print and return the distances between procedural and real objects, in diagonals."""
    seen = [likeness(obj) for obj in real]
    tasks = [(category, seed, seen) for seed in range(count)]
    rows = np.stack(list(_parallel(category, _to_real, tasks, pool)))
    realism = Realism(rows, pair_distances([likeness(obj) for obj in pairs]))
    near, names = realism.near, [obj.object_id for obj in real]
    print(f"  {realism.near_at_once.sum()} have a neighbour that is near by every measure at once")
    print(f"  {'':9}{'real':>8}{'COV':>8}{'MMD':>8}{'near':>8}   farthest real object")
    found: dict[str, Any] = {}
    for m, measure in enumerate(MEASURES):
        yardstick, worst = realism.yardstick[m], int(realism.neighbour[:, m].argmax())
        print(
            f"  {measure:9}{yardstick:8.4f}{realism.coverage[m]:8.2f}{realism.minimum_matching_distance[m]:8.4f}"
            f"{near[:, m].sum() if np.isfinite(yardstick) else '-':>5}/{len(real)}   {names[worst]} at "
            f"{realism.neighbour[worst, m]:.4f}"
        )
        values = yardstick, realism.coverage[m], realism.minimum_matching_distance[m], near[:, m].mean()
        found[measure] = [round(float(value), 5) if np.isfinite(value) else None for value in values]
    return {"near": round(float(near.all(axis=1).mean()), 5), "median_coverage_mmd_near": found}


def _to_real(task: tuple[str, int, list[Likeness]]) -> Array:
    """(R, 5) distances of a procedural object from all real ones."""
    category, seed, real = task
    own = likeness(make(category, seed))
    return np.array([distances(own, theirs) for theirs in real])


def compare_ranges(
    category: str, real: Sequence[ArticulatedObject], count: int, pool: ProcessPoolExecutor
) -> dict[str, float]:
    """Print and return how far the ratios of a family reach beyond those of real objects."""
    values = {obj.object_id: ratios(obj) for obj in real}
    made: Iterable[Values] = _parallel(category, _ratios, [(category, seed) for seed in range(count)], pool)
    found, outside = list(reach(values, made)), left_out(values)
    for r in found:
        if not r.reaches:
            ranges = "".join(f"{low:7.3f} {high:7.3f} " for low, high in (r.real, r.required, r.family))
            print(f"  {r.name:30}{ranges} {'SHORT' if r.holds_real else 'MISSES'}")
    return {
        "hold_real": round(sum(r.holds_real for r in found) / len(found), 4),
        "reach_beyond": round(sum(r.reaches for r in found) / len(found), 4),
        "left_out_inside": round(sum(not names for names in outside.values()) / len(outside), 4),
    }


def _ratios(task: tuple[str, int]) -> Values:
    return ratios(make(*task))


def compare_frames(category: str, real: Sequence[ArticulatedObject]) -> list[str]:
    """Print the rest frames of a family and of real objects, and return in what they differ."""
    frames = {"family": Frame.of(make(category, seed) for seed in range(_FRAMES)), "real": Frame.of(real)}
    for name, frame in frames.items():
        extents = " ".join(f"{value:.2f}" for value in frame.extents)
        joints = ", ".join(f"{sort} {100 * share:.0f} %" for sort, share in frame.joints.items() if share >= _SHOWN)
        print(f"  {name:9}extents {extents}, root {100 * frame.root_share:.0f} %, {joints}", flush=True)
    found = list(differences(frames["family"], frames["real"]))
    print("".join(f"  differs: {one}\n" for one in found), end="")
    return found


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
