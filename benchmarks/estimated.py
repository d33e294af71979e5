"""Do estimates of real objects simulate? ``python -m benchmarks.estimated``.

``artperl estimate --urdf --mjcf`` of one cloud of each of 60 real objects of the dev half, as a user runs it, but in
one process: each folder passes the strict checks of ``artsim verify`` or not, and MuJoCo, SAPIEN and PyBullet load it.
Seconds are those of the estimate and its files, after the estimator is loaded. The last line is one JSON object.
"""

import json
import os
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.samples import samples_of
from artsim.checks.realism import REAL, read_split, real_objects
from artsim.checks.validity import check_file
from artsim.common.progress import say, track
from artsim.errors import ConfigError
from artsim.loading.urdf import load
from artsim.model.objects import ArticulatedObject
from artsim.physics.simulators import SIMULATORS


@dataclass(frozen=True)
class Options:
    """Which estimator, and how many objects."""

    estimator: str = "generic"
    categories: tuple[str, ...] = (
        "storage_furniture", "table", "refrigerator", "safe", "microwave", "oven", "dishwasher", "washing_machine",
        "door", "toilet", "trash_can", "laptop",
    )  # fmt: skip
    objects: int = 60


def chosen(options: Options) -> Iterator[ArticulatedObject]:
    """Real objects of the dev half, category by category."""
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    if folder is None:
        raise ConfigError("no folder of real objects is named", "partnet", "set ARTSIM_PARTNET_DIR")
    split = read_split(Path(__file__).parent / "splits" / "partnet_dev.json")
    for category in options.categories:
        if category in REAL:
            yield from real_objects(category, Path(folder), split, "dev")


def loaded(folder: Path) -> dict[str, int]:
    """Joints that each simulator finds."""
    files = {"mujoco": folder / "mobility.xml"}
    return {name: load_file(files.get(name, folder / "mobility.urdf")).joints for name, load_file in SIMULATORS.items()}


def main(options: Options) -> None:
    """Measure and print."""
    estimator = find_estimator(None, options.estimator)
    objects = list(chosen(options))[: options.objects]
    samples = samples_of(objects, 1)
    seconds, failed, differ = [], Counter[str](), 0
    for sample in track("estimates", samples, unit="object"):
        with tempfile.TemporaryDirectory() as place:
            folder, begun = Path(place), time.perf_counter()
            estimate = estimator(sample.points)
            estimate.export(folder, ("urdf", "mjcf"), sample.category)
            seconds.append(time.perf_counter() - begun)
            found = [gate for gate in check_file(load(folder / "mobility.urdf"), folder) if not gate.passed]
            failed.update(gate.name for gate in found)
            joints = loaded(folder)
            differ += len(set(joints.values())) > 1
            if found or len(set(joints.values())) > 1:
                say(f"{sample.object_id}: {'; '.join(map(str, found))} {joints}")
    result: dict[str, Any] = {
        "objects": len(samples), "failed gates": dict(failed), "simulators that differ in joints": differ,
        "seconds": {"median": round(float(np.median(seconds)), 2), "largest": round(max(seconds), 2)},
    }  # fmt: skip
    print("\n".join(f"{name}: {value}" for name, value in result.items()))
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
