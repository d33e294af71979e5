"""Poses of the parts of articulated objects in clouds and images: estimators, their training and their tests.

First steps: artperl estimate cloud.ply --category laptop --view out.html
"""

import sys
from itertools import pairwise
from typing import Annotated

import tyro

from artperl.commands.benchmarks import Ablation, ArtImage, Robustness
from artperl.commands.calibrate import Calibrate
from artperl.commands.demo import Demo
from artperl.commands.detections import MakeDetections
from artperl.commands.estimate import Estimate
from artperl.commands.evaluate import Evaluate
from artperl.commands.reartmix import ReArtMix
from artperl.commands.report import Report
from artperl.commands.score import Score
from artperl.commands.train import Train
from artperl.commands.train_detector import TrainDetector
from artsim.common.messages import note
from artsim.common.program import run_program

VERBS = {
    "Poses": (Annotated[Estimate, tyro.conf.subcommand("estimate")],),
    "Training": (
        Annotated[Demo, tyro.conf.subcommand("demo")],
        Annotated[Train, tyro.conf.subcommand("train")],
        Annotated[TrainDetector, tyro.conf.subcommand("train-detector")],
        Annotated[Calibrate, tyro.conf.subcommand("calibrate")],
    ),
    "Tests": (
        Annotated[Evaluate, tyro.conf.subcommand("evaluate")],
        Annotated[Score, tyro.conf.subcommand("score")],
        Annotated[Report, tyro.conf.subcommand("report")],
        Annotated[ArtImage, tyro.conf.subcommand("artimage")],
        Annotated[ReArtMix, tyro.conf.subcommand("reartmix")],
        Annotated[Robustness, tyro.conf.subcommand("robustness")],
        Annotated[Ablation, tyro.conf.subcommand("ablation")],
        Annotated[MakeDetections, tyro.conf.subcommand("detections")],
    ),
}


def main() -> None:
    """Entry point of ``artperl``."""
    sys.argv[1:] = with_new_names(sys.argv[1:])
    run_program(VERBS, "artperl", __doc__)


def with_new_names(words: list[str]) -> list[str]:
    """Words of a command line, in which ``evaluate --benchmark NAME`` and ``evaluate --ablation`` are commands, and the
    preset full is long.
    """
    if ("--preset", "full") in pairwise(words):
        note("the preset full is now long")
        words[words.index("--preset") + 1] = "long"
    if words[:1] != ["evaluate"]:
        return words
    rest = words[1:]
    if "--ablation" in rest:
        rest.remove("--ablation")
        name = "ablation"
    elif "--benchmark" in rest[:-1]:
        at = rest.index("--benchmark")
        name = rest[at + 1]
        del rest[at : at + 2]
    else:
        return words
    note(f"artperl evaluate {'--ablation' if name == 'ablation' else f'--benchmark {name}'} is now artperl {name}")
    return [name, *rest]


def train_main() -> None:
    """Entry point of ``train.py``."""
    run_program({"": (Train,)}, "train.py")
