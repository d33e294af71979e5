"""Time of an estimate: ``python -m benchmarks.inference``.

Clouds of unseen procedural objects go through the whole pipeline one at a time. The median over all instances of each
category, warm, is printed in whole and by stage; the last line is one JSON object.
"""

from __future__ import annotations

import json
import os
import platform
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

from artperl.data.categories import ARTIMAGE
from artperl.evaluation.artimage import row_objects, row_samples
from artperl.evaluation.benchmark import find_estimator

WARM_UP = 5


@dataclass(frozen=True)
class Options:
    """How long an estimate takes."""

    weights: Path | None = None
    """Folder of estimators (or of training runs) by category; by default those that come with the package."""
    categories: tuple[str, ...] = tuple(ARTIMAGE)
    instances: int = 100
    """Of each category, at least."""


def main(options: Options) -> None:
    """Measure and print."""
    print(f"{platform.processor() or platform.machine()}, {os.cpu_count()} cores, of which an estimate takes one")
    median: dict[str, float] = {}
    stages: dict[str, dict[str, float]] = {}
    for category in options.categories:
        times = milliseconds(category, options)
        median[category] = round(float(np.median([sum(one.values()) for one in times])), 1)
        every = dict.fromkeys(stage for one in times for stage in one)
        stages[category] = {s: round(float(np.median([one.get(s, 0.0) for one in times])), 1) for s in every}
        by_stage = ", ".join(f"{stage} {value}" for stage, value in stages[category].items())
        print(f"{category:12} {median[category]:6.1f} ms ({by_stage}), {len(times)} instances", flush=True)
    print(json.dumps({"median_ms": median, "stages_ms": stages}))


def milliseconds(category: str, options: Options) -> list[dict[str, float]]:
    """Of each stage, for each instance."""
    estimator = find_estimator(options.weights, category)
    tested = row_objects("procedural", category, objects=min(20, options.instances))
    samples = row_samples("procedural", tested, options.instances)
    for sample in samples[:WARM_UP]:
        estimator(sample.points)
    return [estimator(sample.points).milliseconds for sample in samples]


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
