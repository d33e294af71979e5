"""Speed of making procedural objects: ``python -m benchmarks.objects``.

Makes new objects of every category on one core, without and with the sim-readiness gates. The last line is one JSON
object: ``objects_per_s``, ``gated_objects_per_s``, and ``per_category`` with both.
"""

from __future__ import annotations

import json
import os
import platform
import time
from dataclasses import dataclass, field

import tyro

from artsim import make
from artsim.checks.validity import check
from artsim.common.progress import say, track
from artsim.families import FAMILIES


@dataclass(frozen=True)
class Options:
    """Measure the speed of making procedural objects."""

    objects: int = 30
    """Objects of each category."""
    categories: tuple[str, ...] = field(default_factory=lambda: tuple(sorted(FAMILIES)))


def main(options: Options) -> None:
    """Print a table and the JSON line."""
    print(f"{platform.processor() or platform.machine()}, one of {os.cpu_count()} cores, Python", end=" ")
    print(f"{platform.python_version()}; {options.objects} objects a category")
    print(f"{'category':20s}{'objects/s':>12s}{'with gates/s':>14s}{'parts':>8s}{'triangles':>11s}{'pieces':>8s}")
    table: dict[str, dict[str, float]] = {}
    total_make = total_check = 0.0
    for category in track("objects", options.categories, unit="category", leave=False):
        made, checked = measure(category, options.objects)
        objects = [make(category, seed) for seed in range(5)]
        rates = options.objects / made, options.objects / (made + checked)
        table[category] = {"objects_per_s": round(rates[0], 1), "gated_objects_per_s": round(rates[1], 1)}
        parts = sum(map(len, objects)) / len(objects)
        triangles = sum(obj.num_faces for obj in objects) / len(objects)
        pieces = sum(len(p.body.pieces) for obj in objects for p in obj.parts if p.body) / len(objects)
        say(f"{category:20s}{rates[0]:12.1f}{rates[1]:14.1f}{parts:8.1f}{triangles:11.0f}{pieces:8.0f}")
        total_make, total_check = total_make + made, total_check + checked
    count = options.objects * len(options.categories)
    result = {
        "objects_per_s": round(count / total_make, 1),
        "gated_objects_per_s": round(count / (total_make + total_check), 1),
        "per_category": table,
    }
    print(json.dumps(result))


def measure(category: str, count: int) -> tuple[float, float]:
    """Processor seconds for making some objects, and for checking them."""
    make(category, 0)
    start = time.process_time()
    objects = [make(category, seed) for seed in range(count)]
    made = time.process_time() - start
    start = time.process_time()
    for obj in objects:
        check(obj)
    return made, time.process_time() - start


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
