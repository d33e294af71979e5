"""The verbs ``artperl artimage``, ``robustness`` and ``ablation``: the estimators of several categories are tested."""

import logging
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from artsim.common.program import Figures
from artsim.errors import ConfigError

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class _Tested(Figures):
    """Which estimators are tested, and on which categories."""

    estimators: tyro.conf.Positional[Path | None] = None
    """Folder of the estimators by category; by default those that come with the package."""
    category: tuple[str, ...] = ()
    """Categories; by default those of ArtImage."""
    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Unpacked PartNet-Mobility, for real objects; by default what ARTSIM_PARTNET_DIR names."""

    def categories(self) -> tuple[str, ...]:
        """The categories."""
        from artperl.data.categories import ARTIMAGE

        return self.category or tuple(ARTIMAGE)


@dataclass(frozen=True)
class ArtImage(_Tested):
    """Test the estimators on regenerated ArtImage: at least 500 views of each category in each row."""

    method: str = "full"
    """Method of the estimators, with --root; without, they are of the method full."""
    rows: tuple[Literal["procedural", "real", "real_trained", "procedural_sphere", "real_sphere"], ...] = ()
    """By default all that there are objects and weights for. The last two are from all round."""
    real_weights: Path | None = None
    """For the row real_trained: folder of the estimators that have learnt from real objects, too."""
    root: Path | None = None
    """Folder of the original ArtImage, whose test split is read instead of views that are made here. Without --views,
    all frames."""
    objects: int = 40
    """Unseen procedural objects of each category."""
    views: int | None = None
    """The least number of views of each category in each row, by default 500."""
    seen_from: tuple[float, float] | None = None
    """Range of the camera's azimuth, for the estimators: degrees about the object's vertical, 0 for its front.
    By default unknown."""
    num_points: int = 8192
    """Points of a cloud: pixels of the object, drawn at random."""

    def run(self) -> None:
        from artperl.evaluation.artimage import ROWS, VIEWS
        from artperl.evaluation.benchmark import run_benchmark, run_original

        categories = self.categories()
        if self.root is not None and (self.rows or self.seen_from):
            raise ConfigError("the original images have no rows, and no azimuths", "root", "leave the others out")
        if self.root is None and self.method != "full":
            raise ConfigError("without --root, the method is full", "method", "leave it out")
        if self.root is not None:
            figures = run_original(
                self.root, categories, self.estimators, self.method, self.views, self.num_points, True, self.say
            )
        else:
            rows = self.rows or tuple(
                row
                for row in ROWS
                if not (row == "real_trained" and self.real_weights is None)
                and not (row.startswith("real") and self.partnet is None)
            )
            for row in (row for row in ROWS if not self.rows and row not in rows):
                log.warning(f"{row}: left out, since {'--real-weights' if self.partnet else '--partnet'} is not given")
            figures = run_benchmark(
                rows, categories, self.estimators, self.real_weights, self.partnet, self.objects,
                self.views or VIEWS, self.num_points, True, self.say, self.seen_from,
            )  # fmt: skip
        self.finish(figures)


@dataclass(frozen=True)
class Robustness(_Tested):
    """Test the estimators where it is difficult: sensors, occluders, bad masks, few points.

    With --json FILE, the same command continues a run that was stopped.
    """

    rows: tuple[Literal["procedural", "real", "real_all"], ...] = ()
    """Objects: procedural ones, the real ones for testing, or all real ones; by default the first two, if there are."""
    conditions: tuple[str, ...] = ()
    """Such as occluded_40 leak_7; by default all."""
    objects: int = 40
    """Unseen procedural objects of each category."""
    views: int = 100
    """The least number of views of each row."""

    def run(self) -> None:
        from artperl.evaluation.conditions import CONDITIONS
        from artperl.evaluation.robustness import run_robustness

        categories = self.categories()
        sources = self.rows or (("procedural",) if self.partnet is None else ("procedural", "real"))
        figures = run_robustness(
            sources, categories, self.conditions or tuple(CONDITIONS), self.estimators, self.partnet, self.objects,
            self.views, self.json_file, True, self.say,
        )  # fmt: skip
        self.finish(figures)


@dataclass(frozen=True)
class Ablation(_Tested):
    """Measure what each stage brings: the estimators without one stage after the other, on validation objects.

    With --json FILE, the same command continues a run that was stopped.
    """

    views: int = 32
    """The least number of views of each row."""

    def run(self) -> None:
        from artperl.evaluation.ablation import run_ablation, verdict_lines

        record = run_ablation(
            self.categories(), self.estimators, self.partnet, self.views, self.json_file, True, self.say
        )
        self.say("\n".join(verdict_lines(record)))
        self.finish(record)
