"""WebDataset: tar files whose members have the suffixes that loaders know by themselves.

The shards of a dataset are tar files of this kind already. Here depth becomes a 16-bit PNG, the mask is called
``mask.png``, and shards have the size that is asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import orjson

from artsim.datasets.dataset import Dataset
from artsim.datasets.shards import sample_key, sample_members, write_tar
from artsim.formats.base import Output, Piece, PlainFormat
from artsim.formats.images import depth_png
from artsim.observing.sample import Sample


class WebDatasetFormat(PlainFormat):
    """``<split>-<number>.tar`` of ``<index>.points.npy``, ``.part.npy``, ``.npcs.npy``, ``.json`` and images."""

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write one tar file."""
        name = f"{piece.name}.tar"
        output.files[name] = write_tar(output.folder / name, _entries(samples))
        return None


def _entries(samples: Iterable[Sample]) -> Iterator[tuple[str, dict[str, bytes]]]:
    for sample in samples:
        members = sample_members(sample)
        if sample.depth is not None:
            del members["depth.npy"]
            members["depth.png"], unit = depth_png(sample.depth)
            members["json"] = orjson.dumps({**orjson.loads(members["json"]), "depth_unit": unit})
        if "part_mask.png" in members:
            members["mask.png"] = members.pop("part_mask.png")
        yield sample_key(sample.index), members
