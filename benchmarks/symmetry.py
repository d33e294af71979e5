"""Which objects look the same turned round: ``python -m benchmarks.symmetry``.

For each category, the share of procedural objects that have a symmetry, and the share with each: half and quarter turns
by their axis, with parts exchanged or not (:mod:`artsim.observing.symmetry` says what counts as one). Estimates of such
objects are judged with and without symmetry. The last line is one JSON object.
"""

from __future__ import annotations

import json
import multiprocessing
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

import numpy as np
import tyro
from scipy.spatial.transform import Rotation

from artsim import make
from artsim.common.progress import track
from artsim.families import FAMILIES
from artsim.observing.symmetry import Symmetry, symmetries


@dataclass(frozen=True)
class Options:
    """Count objects that look the same turned round."""

    categories: list[str] = field(default_factory=lambda: sorted(FAMILIES))
    """Which of ours."""
    objects: int = 100
    """Procedural objects of each category, seeds 0 and up."""
    workers: int = 2
    """Processes."""


def main(options: Options) -> None:
    """Count and print."""
    result = {}
    with ProcessPoolExecutor(options.workers, multiprocessing.get_context("spawn")) as pool:
        for category in options.categories:
            tasks = [(category, seed) for seed in range(options.objects)]
            found = list(track(category, pool.map(_names, tasks, chunksize=4), total=len(tasks), leave=False))
            counts = Counter(name for names in found for name in names)
            share = sum(bool(names) for names in found) / len(found)
            texts = [f"{name} {100 * n / len(found):.0f} %" for name, n in counts.most_common(4)]
            print(f"{category:20}{100 * share:5.0f} %   {', '.join(texts)}", flush=True)
            result[category] = round(share, 4)
    print(json.dumps({"objects": options.objects, "symmetric": result}))


def _names(task: tuple[str, int]) -> list[str]:
    return [describe(symmetry) for symmetry in symmetries(make(*task))]


def describe(symmetry: Symmetry) -> str:
    """Say "half turn about z, parts exchanged"."""
    turn = Rotation.from_matrix(symmetry.rotation).as_rotvec()
    angle = float(np.linalg.norm(turn))
    axis = "+".join(name for name, share in zip("xyz", np.abs(turn), strict=True) if share > 1e-6)
    kind = {2: "half turn", 4: "quarter turn", 3: "third of a turn"}[round(2 * np.pi / angle)]
    exchanged = ", parts exchanged" if (symmetry.parts != np.arange(len(symmetry.parts))).any() else ""
    return f"{kind} about {axis}{exchanged}"


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
