"""PLY: the clouds of samples, coloured by part."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from artsim.datasets.dataset import Dataset
from artsim.datasets.shards import sample_key
from artsim.formats.base import Piece, PlainFormat
from artsim.model.ply import cloud_ply
from artsim.observing.sample import Sample
from artsim.runs.tasks import Output


class PlyFormat(PlainFormat):
    """``<split>/<index>.ply``: one cloud for each sample, camera frame, metres."""

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write one file for each sample."""
        for sample in samples:
            output.write(f"{piece.split}/{sample_key(sample.index)}.ply", cloud_ply(sample.points, sample.part))
        return None
