"""One agent, any tree: ``python -m benchmarks.joint``.

How far off cabinets with any mix of doors and drawers, and robot arms, may begin for the joint agent to find them, and
for refinement alone. References are the objects themselves, stretched at random; points carry their true labels, and
then those of the estimator's own perception. The last line is one JSON object.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import torch
import tyro

from artperl.core.pose import KINDS
from artperl.data.fitting_problems import Labels
from artperl.estimator import load_estimator
from artperl.evaluation.basin import Joints, basin_problem, run_basin

LABELS: tuple[Labels, ...] = ("true", "perceived")
JOINTS: dict[Joints, str] = {"halfway": "half-way", "near": "off by up to as much"}


@dataclass(frozen=True)
class Options:
    """What one agent does for trees of every kind."""

    weights: Path = Path("any")
    """Folder of an estimator, or the name of one that comes with the package."""
    categories: tuple[str, ...] = ("storage_furniture", "robot_arm")
    objects: int = 96
    """Of each category."""
    threads: int = 2
    """Processor threads."""


def main(options: Options) -> None:
    """Measure and print."""
    torch.set_num_threads(options.threads)
    estimator = load_estimator(options.weights)
    result: dict[str, dict[str, Any]] = {}
    for category in options.categories:
        labelled = [(labels, basin_problem(estimator, [category], "any", options.objects, "deformed", labels))
                    for labels in LABELS]  # fmt: skip
        trees = labelled[0][1].shapes.trees
        kinds = Counter(
            " ".join(KINDS[kind] for kind in row[valid].tolist()[1:])
            for row, valid in zip(trees.kind, trees.valid, strict=True)
        )
        print(f"{category}: {len(kinds)} mixes of joints, of 1 to {int(trees.valid.sum(1).max()) - 1}")
        result[category] = {"mixes": len(kinds)}
        for labels, problem in labelled:
            for joints, how in JOINTS.items():
                print(f"{labels} labels, joints {how}")
                result[category][f"{labels} {joints}"] = run_basin(estimator, problem, joints=joints)
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
