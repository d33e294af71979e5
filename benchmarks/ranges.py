"""How far families reach beyond the real objects of their categories: ``python -m benchmarks.ranges``.

For every category with real objects and every ratio (:mod:`artsim.checks.ranges` names them), a line shows the range of
the real objects, the range that the family has to reach, and the range of many procedural objects. ``SHORT`` marks a
family that does not reach it, ``MISSES`` one that does not even hold the real objects. Leave-one-out shows how many
real objects lie in the range that the others of their category require. The last line is one JSON object.
"""

from __future__ import annotations

import json
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import tyro

from artsim import make
from artsim.checks.ranges import Reach, Values, left_out, ratios, reach
from artsim.checks.realism import REAL, Half, read_split, real_objects
from artsim.common.progress import track
from artsim.errors import ConfigError
from artsim.families import FAMILIES
from benchmarks.realism import SPLIT


@dataclass(frozen=True)
class Options:
    """Compare the reach of families with real objects."""

    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Folder of real objects."""
    categories: list[str] = field(default_factory=lambda: sorted(set(REAL) & set(FAMILIES)))
    """Which of ours."""
    objects: int = 300
    """Procedural objects of each category, seeds 0 and up."""
    half: Half = "dev"
    """Which real objects. Families are tuned on "dev" alone; "test" tells whether that carries over."""
    workers: int = 2
    """Processes."""
    all: bool = False
    """Print the ratios that a family reaches, too."""


def main(options: Options) -> None:
    """Compare and print."""
    if options.partnet is None:
        raise ConfigError("no folder of real objects is named", "partnet", "set ARTSIM_PARTNET_DIR")
    for category in options.categories:
        if category not in REAL or category not in FAMILIES:
            known = ", ".join(sorted(set(REAL) & set(FAMILIES)))
            raise ConfigError(f"nothing to compare for {category!r}", "categories", f"use {known}")
    split = read_split(SPLIT)
    result = {}
    with ProcessPoolExecutor(options.workers, multiprocessing.get_context("spawn")) as pool:
        for category in options.categories:
            real = {obj.object_id: ratios(obj) for obj in real_objects(category, options.partnet, split, options.half)}
            if not real:
                continue
            tasks = [(category, seed) for seed in range(options.objects)]
            made = pool.map(_ratios, tasks, chunksize=8)
            found = reach(real, track(category, made, total=len(tasks), leave=False))
            outside = left_out(real)
            print("\n".join(table(category, found, outside, options.all)), flush=True)
            result[category] = summary(found, outside)
    print(json.dumps({"objects": options.objects, "half": options.half, "categories": result}))


def _ratios(task: tuple[str, int]) -> Values:
    return ratios(make(*task))


def table(category: str, found: list[Reach], outside: dict[str, list[str]], every: bool) -> list[str]:
    """Lines of text."""
    held, reached = (sum(r.holds_real for r in found), sum(r.reaches for r in found))
    lines = [
        f"{category}: {len(outside)} real; of {len(found)} ratios {held} hold the real objects, {reached} reach beyond",
        f"  {'':30}{'real':^16}{'required':^16}{'family':^16}",
    ]
    for r in found:
        if every or not r.reaches:
            ranges = "".join(f"{low:7.3f} {high:7.3f} " for low, high in (r.real, r.required, r.family))
            lines.append(f"  {r.name:30}{ranges} {'' if r.reaches else 'SHORT' if r.holds_real else 'MISSES'}".rstrip())
    for name, names in outside.items():
        if names:
            lines.append(f"  {name} lies beyond what the others require: {', '.join(names)}")
    return lines


def summary(found: list[Reach], outside: dict[str, list[str]]) -> dict[str, float]:
    """What the last line says of a category."""
    return {
        "real": len(outside),
        "ratios": len(found),
        "hold_real": round(sum(r.holds_real for r in found) / len(found), 4),
        "reach_beyond": round(sum(r.reaches for r in found) / len(found), 4),
        "left_out_inside": round(sum(not names for names in outside.values()) / len(outside), 4),
    }


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
