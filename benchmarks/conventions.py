"""Rest frames of families beside those of real objects: ``python -m benchmarks.conventions --partnet DIR``.

Prints the table of docs/conventions.md: for each family, and for the real objects of the dev half, medians of the
extents over the diagonal, the root, and where joints point (:mod:`artsim.checks.conventions` says how). What differs
stands below the table.
"""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path

import tyro

from artsim.checks.conventions import Frame, differences
from artsim.checks.realism import REAL, read_split, real_objects
from artsim.errors import ConfigError
from artsim.families import CATEGORIES, make
from benchmarks.realism import SPLIT

_SHOWN = 0.1
"""Share of the objects from which a sort of joint is shown."""


@dataclass(frozen=True)
class Options:
    """Compare the frames of families with those of real objects."""

    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Folder of real objects."""
    categories: list[str] = field(default_factory=lambda: list(CATEGORIES))
    """Which of ours."""
    objects: int = 60
    """Procedural objects of each category, seeds 0 and up."""


def main(options: Options) -> None:
    """Print the table."""
    if options.partnet is None:
        raise ConfigError("there are no real objects to compare with", "--partnet", "name the folder")
    print("| category | objects | x y z over the diagonal | root's share | joints, share of the objects |")
    print("|---|---|---|---|---|")
    told = []
    split = read_split(SPLIT)
    for category in options.categories:
        family = Frame.of(make(category, seed) for seed in range(options.objects))
        print(row(category, f"{family.count}", family), flush=True)
        objects = list(real_objects(category, options.partnet, split, "dev")) if category in REAL else []
        if objects:
            real = Frame.of(objects)
            print(row("", f"{real.count} real", real), flush=True)
            told += [f"- {category}: {found}" for found in differences(family, real)]
    print("\n" + "\n".join(told or ["No family differs."]))


def row(name: str, count: str, frame: Frame) -> str:
    """One line of the table."""
    extents = " ".join(f"{value:.2f}" for value in frame.extents)
    joints = ", ".join(f"{sort} {100 * share:.0f} %" for sort, share in frame.joints.items() if share >= _SHOWN)
    return f"| {name} | {count} | {extents} | {100 * frame.root_share:.0f} % | {joints} |"


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
