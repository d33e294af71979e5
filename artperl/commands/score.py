"""The verb ``artperl score``."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from artsim.common.outputs import check_output, write_output
from artsim.common.program import Figures
from artsim.errors import ConfigError, DatasetError

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Score(Figures):
    """Score anybody's estimates against a dataset, such as the test split of ArtSim-10K, and write a page.

    A file of estimates is a JSON list, or has a JSON record in each line: what artperl estimate writes of a dataset.
    Samples without an estimate count as failures. Errors are up to symmetry.

    Example: artsim dataset artsim-10k --splits test --out out/artsim-10k

    Then: artperl score predictions.json --data out/artsim-10k/test --out page.md

    Of a dataset that an estimator learnt from: artperl score poses.jsonl --data out/first --split test
    """

    predictions: tyro.conf.Positional[tuple[Path, ...]]
    """Files of estimates, one for each method; a method has the name of its file."""
    data: Path
    """Folder of the dataset."""
    split: Literal["train", "val", "test"] | None = None
    """Score the samples of this split alone: test, for an estimator that learnt from train. By default all."""
    out: Path | None = None
    """Write the page, Markdown, to this file; by default it is printed."""

    def run(self) -> None:
        from artperl.evaluation.predictions import page, read_predictions, score_predictions, symmetries_of
        from artperl.evaluation.tables import summary
        from artsim.datasets.dataset import open_dataset
        from artsim.datasets.frozen import frozen_name

        if not self.predictions:
            raise ConfigError("there are no estimates", "score", "name files of them")
        for path in (self.out, self.json_file):
            if path is not None:
                check_output(path, self.predictions)
        read = [read_predictions(path) for path in self.predictions]
        dataset = open_dataset(self.data, self.split)
        if not len(dataset):
            raise DatasetError(f"its split {self.split} has no sample", self.data, "name another with --split")
        symmetric = symmetries_of(dataset)
        scored = {own.name: score_predictions(own, dataset, symmetric) for own in read}
        title = frozen_name(dataset) or f"{self.data.name}, no frozen dataset"
        title += f", split {self.split}" if self.split else ""
        notes = [
            f"{len(dataset)} views of {len(dataset.all_planned)} objects. A view without an estimate is a failure: "
            "half a turn, one diagonal, no overlap.",
            "Right: every part within 10 degrees and 5 % of the diagonal. Errors of parts, up to symmetry.",
        ]
        text = page(title, scored, notes)
        if self.out is None:
            self.say(text)
        else:
            write_output(self.out, text.encode(), self.predictions)
            log.info(f"{self.out}: {', '.join(scored)} against {title}")
        self.finish({name: summary(own) for name, own in scored.items()})
