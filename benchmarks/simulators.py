"""Do simulators agree on exported objects? ``python -m benchmarks.simulators``.

Exports objects of every category, loads each into PyBullet, MuJoCo and SAPIEN, and compares numbers of links and
joints, and the places of all parts at random states, with artsim. The last line is one JSON object: for each simulator
the share of objects loaded with equal counts and kinematics, and the largest difference in metres.
"""

from __future__ import annotations

import json
import tempfile
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import tyro

from artsim import make
from artsim.common.progress import say, track
from artsim.export import export
from artsim.families import FAMILIES
from artsim.physics.simulators import AGREEMENT, Agreement, compare_simulators


@dataclass(frozen=True)
class Options:
    """Load exported objects into three simulators."""

    objects: int = 200
    """Objects over all categories."""
    states: int = 20
    """Random states of each."""
    first_seed: int = 0


def main(options: Options) -> None:
    """Print a table, what differs, and the JSON line."""
    found: dict[str, list[Agreement]] = defaultdict(list)
    categories = sorted(FAMILIES)
    for i in track("simulating", range(options.objects), unit="object", leave=False):
        category, seed = categories[i % len(categories)], options.first_seed + i // len(categories)
        with tempfile.TemporaryDirectory() as folder:
            export(make(category, seed), Path(folder))
            for agreement in compare_simulators(folder, options.states):
                found[agreement.simulator].append(agreement)
                if agreement.problem:
                    say(f"{category}:{seed} in {agreement.simulator}: {agreement.problem}")
    print(
        f"{options.objects} objects of {len(categories)} categories, {options.states} states; equal: counts the same,"
    )
    print(f"parts within {AGREEMENT:g} m (of the diagonal, for objects larger than 1 m)")
    result = {}
    for name, agreements in found.items():
        loaded = sum(a.links >= 0 for a in agreements) / len(agreements)
        equal = sum(not a.problem for a in agreements) / len(agreements)
        metres = max(a.metres for a in agreements)
        print(f"  {name:10s} loaded {100 * loaded:6.2f} %   equal {100 * equal:6.2f} %   off by {metres:.2g} m at most")
        result[name] = {"loaded": loaded, "equal": equal, "metres": metres}
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
