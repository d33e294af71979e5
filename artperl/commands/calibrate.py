"""The verb ``artperl calibrate``."""

import logging
from dataclasses import dataclass
from pathlib import Path

import tyro

from artsim.common.program import Figures
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError
from artsim.model.draws import StateOptions, ViewOptions

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Calibrate(Figures):
    """Recalibrate the confidence of an estimator, on procedural objects outside training and test.

    Training does so by itself. Do it again for an estimator that shall judge other objects, such as those of some
    categories only.

        artperl calibrate out/laptop/best
    """

    estimator: tyro.conf.Positional[str]
    """Folder of the estimator, or the name of one that comes with the package."""
    out: Path | None = None
    """Folder to write it to; by default its own, of which only the confidence changes."""
    category: tuple[str, ...] = ()
    """Procedural categories; by default those of its references."""
    objects: int = 40
    """Objects of each category."""
    views: int = 4
    """Views of each object."""

    def run(self) -> None:
        from artperl.data.categories import JOINTS, Parts
        from artperl.evaluation.calibration import calibrated
        from artperl.evaluation.samples import (
            NUM_POINTS,
            VALIDATION_SEEDS,
            degraded_samples,
            foreign_samples,
            frozen_samples,
        )
        from artperl.evaluation.scoring import evaluate, evaluate_foreign
        from artperl.evaluation.tables import summary, table
        from artperl.methods.estimator_files import load_estimator
        from artperl.methods.estimator_folders import WEIGHTS, folder_of, read_settings
        from artperl.methods.estimator_writing import save_estimator
        from artsim.families import FAMILIES

        mixed = SampleOptions(NUM_POINTS, states=StateOptions("mixed"), views=ViewOptions("mixed"))
        for name in ("objects", "views"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{getattr(self, name)} is not possible", name, "use 1 or more")
        folder = folder_of(self.estimator)
        if self.out is None and folder.parent == WEIGHTS:
            raise ConfigError("the package's estimators are not overwritten", self.estimator, "use --out")
        estimator = load_estimator(folder)
        categories = self.category or estimator.categories
        unknown = [name for name in categories if name not in FAMILIES]
        if unknown:
            raise ConfigError(f"unknown category {unknown[0]!r}", "category", f"use {', '.join(sorted(FAMILIES))}")
        votes = estimator.perception.votes
        parts: Parts = "any" if votes or not set(categories) <= set(JOINTS) else "artimage"
        samples = frozen_samples(
            categories, self.objects, self.views, mixed, VALIDATION_SEEDS, parts, estimator.perception.num_rows
        )
        scored = evaluate(estimator, [*samples, *degraded_samples(samples)], True)
        judge = evaluate if votes else evaluate_foreign
        foreign = judge(estimator, foreign_samples(estimator.categories, 12))
        made = calibrated(estimator, scored, foreign)
        save_estimator(made, self.out or folder, read_settings(folder)["about"])
        figures = summary(scored)
        self.say(table(figures))
        self.finish(figures)
        log.info(f"these figures are of the confidence before; the new one is in {self.out or folder}")
