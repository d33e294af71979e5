"""One agent, any tree: ``python -m benchmarks.joint``.

The joint agent fits cabinets with any mix of doors and drawers, and robot arms, whose trees it shares with no other
category: from starts that are off by more and more, beside refinement alone. References are the objects themselves,
stretched at random; points carry the labels of its own perception. The last line is one JSON object.
"""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import torch
import tyro

from artperl.benchmarks.basin import run_basin
from artperl.checkpoint import load_estimator
from artperl.pose import KINDS
from artperl.problems import Problems

SEED = 777


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
    result = {}
    for category in options.categories:
        problem = Problems([category], estimator.base, options.objects, 64, SEED, parts="any", references="deformed")[0]
        trees = problem.shapes.trees
        kinds = Counter(
            " ".join(KINDS[kind] for kind in row[valid].tolist()[1:])
            for row, valid in zip(trees.kind, trees.valid, strict=True)
        )
        print(f"{category}: {len(kinds)} mixes of joints, of 1 to {int(trees.valid.sum(1).max()) - 1}")
        found = run_basin(estimator, [category], "any", options.objects, "deformed")
        result[category] = {"mixes": len(kinds), "start": found}
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
