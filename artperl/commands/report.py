"""The verb ``artperl report``."""

import logging
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from artperl.methods import StoredMethod
from artsim.common.program import Figures, resumable

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Report(Figures):
    """Compare all methods on a benchmark: train or load each, test each on the same views, and write one report.

    The report is OUT/report.md; report.json has its figures. Stop it at any moment with Ctrl-C: rerun the command to
    resume. Each step says how long it took.

    To see what a report is, in some minutes: artperl report --quick

    The tables of the paper, in hours on two cores: artperl report --benchmark artimage

    The same with as much time for each method, one hour of one core: artperl report --minutes 60

    Of some methods and categories: artperl report --category laptop --methods full ancsh omad

    The same methods on real objects, without another training, in report-real.md: artperl report --row real
    """

    benchmark: Literal["artimage", "robotarm"] = "artimage"
    """artimage: regenerated ArtImage, tables 1 and 2 of the paper; robotarm: an arm of seven parts among other things,
    in RGB-D images with noise and masks that are not exact, its table 3."""
    arm: Path | None = None
    """URDF file of another arm for robotarm, such as your own; by default a procedural one of seven parts."""
    out: Path | None = None
    """Folder of the report; by default out/report-BENCHMARK."""
    quick: bool = False
    """One category, trainings of seconds, few views: to see the report. Its figures say nothing of the methods."""
    category: tuple[str, ...] = ()
    """Categories of the benchmark; by default all."""
    methods: tuple[StoredMethod, ...] = ()
    """By default all of the benchmark."""
    preset: Literal["quick", "long"] = "long"
    """Of the trainings: quick ones take some minutes each, full ones an hour and more."""
    minutes: float | None = None
    """Train every method for so many minutes of one core: the stages of the preset get longer or shorter. By default
    the preset says how long, and the method full of ArtImage has the weights that come with the package alone."""
    row: Literal["procedural", "real"] = "procedural"
    """Objects to test on: unseen procedural ones, or the half of PartNet-Mobility's that is for testing."""
    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Folder of real objects; by default that which ARTSIM_PARTNET_DIR names."""
    objects: int = 40
    """Unseen procedural objects of each category."""
    views: int = 120
    """Views of each category, at least."""
    workers: int = 1
    """Processes that make training clouds; the result does not depend on it."""

    def run(self) -> None:
        from artsim.common.extras import require_extra

        with require_extra("training"):
            import torch

            from artperl.training.comparison_run import ComparisonOptions, run_comparison

        options = ComparisonOptions(
            self.benchmark, self.category, "" if self.arm is None else str(self.arm), self.methods, self.preset,
            self.objects, self.views, minutes=self.minutes, row=self.row,
            partnet="" if self.partnet is None else str(self.partnet),
        )  # fmt: skip
        if self.quick:
            from artperl.training.comparison_run import quick_comparison

            options = quick_comparison(options)
        out = self.out or Path("out") / f"report-{self.benchmark}{'-quick' if self.quick else ''}"
        if self.minutes is not None:
            torch.set_num_threads(1)
        with resumable("finished steps are kept", out):
            figures = run_comparison(options, out, self.workers, True, log.info)
        self.say((out / f"report{options.suffix}.md").read_text())
        self.finish(figures)
