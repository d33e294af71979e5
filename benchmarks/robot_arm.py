"""The paper's robot arm (table 3) with real meshes: ``python -m benchmarks.robot_arm``.

The arm is a Franka Panda of seven parts and six joints, PyBullet's model of it, with its hand held. It is compared as
``artperl report --benchmark robotarm`` does: methods learn from clouds of its file, and are tested on RGB-D images with
noise and masks that are not exact. A stopped run goes on. The last line is one JSON object.
"""

import json
import shutil
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import pybullet_data
import torch
import tyro

from artperl.methods import StoredMethod
from artperl.training.comparison_run import ComparisonOptions, run_comparison
from artsim.common.files import write_atomic

_LOCKED = ("panda_joint7", "panda_finger_joint1", "panda_finger_joint2")


@dataclass(frozen=True)
class Options:
    """How well methods take to a robot arm."""

    out: Path = Path("out/robot_arm")
    """Folder of the arm's files, the trainings and the report."""
    methods: tuple[StoredMethod, ...] = ("full", "ancsh")
    views: int = 120
    """Of the test, each of a scene of its own."""
    threads: int = 2
    """Processor threads."""


def main(options: Options) -> None:
    """Train, measure and print."""
    torch.set_num_threads(options.threads)
    arm = seven_part_panda(options.out / "panda")
    asked = ComparisonOptions("robotarm", arm=str(arm), methods=options.methods, views=options.views)
    report = run_comparison(asked, options.out)
    print((options.out / "report.md").read_text())
    print(json.dumps(report["rows"]))


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
