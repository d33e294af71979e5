"""The paper's robot arm (table 3): ``python -m benchmarks.robot_arm``.

A Franka Panda of seven parts and six joints, one instance: the estimator for any tree learns on from it for a few
minutes, and is then tested in states and from sides that it has not seen. The published images are real and not public;
here PyBullet's model of the arm is seen by a simulated camera. A second row does without the beam search, which tells
how round links have rolled. The last line is one JSON object.
"""

from __future__ import annotations

import json
import shutil
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal
from xml.etree import ElementTree

import pybullet_data
import torch
import tyro

from artperl.estimator import load_estimator
from artperl.evaluation.samples import samples_of
from artperl.evaluation.scoring import evaluate
from artperl.evaluation.tables import summary
from artperl.training.options import PRESETS
from artperl.training.run import Training
from artsim.common.files import write_atomic
from artsim.datasets.plan import SampleOptions
from artsim.loading.urdf import load

PUBLISHED = {
    "ArtPERL": ((5.7, 5.9, 5.8, 8.4, 10.1, 12.5, 19.6), (0.008, 0.012, 0.014, 0.037, 0.058, 0.136, 0.225)),
    "A-NCSH": ((7.8, 7.9, 10.3, 10.5, 11.2, 16.4, 23.5), (0.012, 0.044, 0.067, 0.066, 0.079, 0.236, 0.403)),
}
"""Rotation, degrees, and translation, metres, of each part; table 3 of the paper, other images of the same arm."""

_LOCKED = ("panda_joint7", "panda_finger_joint1", "panda_finger_joint2")


@dataclass(frozen=True)
class Options:
    """How well the joint estimator takes to a robot arm."""

    out: Path = Path("out/robot_arm")
    """Folder of the arm's files and of the training run, which is gone on with if it was stopped."""
    start_from: Path = Path("any")
    """Estimator that is learnt on from: a folder, or the name of one that comes with the package."""
    perception_steps: int = 2000
    """Batches that its perception learns on from."""
    views: int = 500
    """Of the test, each in a state of its own."""
    noise: Literal["none", "kinect_v1", "d435", "azure", "gaussian3mm"] = "none"
    """Depth sensor of training and test."""
    threads: int = 2
    """Processor threads."""


def main(options: Options) -> None:
    """Train, measure and print."""
    torch.set_num_threads(options.threads)
    arm = seven_part_panda(options.out / "panda")
    sample = SampleOptions(noise=options.noise)
    learning = replace(
        PRESETS["joint"], categories=(), files=(str(arm),), parts="any", start_from=str(options.start_from),
        perception_steps=options.perception_steps, test_objects=40, sample=sample,
    )  # fmt: skip
    training = Training(learning, options.out / "run")
    training.run()
    estimator = load_estimator(options.out / "run" / "best")
    samples = samples_of([load(arm)], options.views, sample)
    without_beam = replace(estimator, options=replace(estimator.options, beam=0))
    variants = {"whole": estimator, "no beam search": without_beam}
    result: dict[str, Any] = {}
    for name, variant in variants.items():
        (result[name],) = summary(evaluate(variant, samples, progress=True)).values()
        parts = result[name]["parts"]
        diagonal = float(samples[0].diagonal)
        rotation = [(part["rotation_deg"]["median"], part["rotation_deg"]["mean"]) for part in parts]
        metres = [part["translation_percent_diagonal"]["mean"] * diagonal / 100.0 for part in parts]
        print(f"{name}: {len(samples)} views, {100 * result[name]['segmentation']:.1f} % of points have the right part")
        print("  rotation, deg, median and mean:", ", ".join(f"{middle:.1f} {mean:.1f}" for middle, mean in rotation))
        print("  translation, m, mean:          ", ", ".join(f"{value:.3f}" for value in metres))
        print(f"  {100 * result[name]['right']:.0f} % right, {result[name]['ms_per_instance']:.0f} ms", flush=True)
    for name, (degrees, distances) in PUBLISHED.items():
        print(
            f"{name}, published for real images: {', '.join(map(str, degrees))} deg; {', '.join(map(str, distances))}"
        )
    print(json.dumps(result))


def seven_part_panda(folder: Path) -> Path:
    """URDF file of a Panda whose hand is part of its sixth link, copied to a folder with its meshes."""
    shutil.copytree(Path(pybullet_data.getDataPath(), "franka_panda"), folder, dirs_exist_ok=True)
    file = folder / "panda.urdf"
    robot = ElementTree.parse(file)
    for joint in robot.iter("joint"):
        if joint.get("name") in _LOCKED:
            joint.set("type", "fixed")
    write_atomic(file, ElementTree.tostring(robot.getroot()))
    return file


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
