"""WebDataset: tar files whose members have the suffixes that loaders know by themselves.

The shards of a dataset are tar files of this kind already. Here depth becomes a 16-bit PNG, the mask is called
``mask.png``, and shards have the size that is asked for.

webdataset's own decoders of images make 8-bit colours of every PNG. :func:`decode_values` keeps depths and part ids::

    webdataset.WebDataset(shards).decode(decode_values, "rgb8")
"""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from artsim.common.files import open_image
from artsim.datasets.dataset import Dataset
from artsim.datasets.shards import MAX_PIXELS, sample_key, sample_members, write_tar
from artsim.errors import DatasetError
from artsim.formats.base import Format, Piece
from artsim.formats.images import depth_png
from artsim.observing.sample import Sample
from artsim.runs.tasks import Output


class WebDatasetFormat(Format):
    """``<split>-<number>.tar`` of ``<index>.points.npy``, ``.part.npy``, ``.npcs.npy``, ``.json`` and images."""

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write one tar file."""
        name = f"{piece.name}.tar"
        output.files[name] = write_tar(output.folder / name, _entries(samples))
        return None


def decode_values(key: str, data: bytes) -> NDArray[np.uint16] | NDArray[np.uint8] | None:
    """A decoder for webdataset: ``depth.png`` (H, W) uint16, ``mask.png`` (H, W) uint8; None for other members.

    A depth in metres is the value times ``depth_unit`` of the sample's JSON.

    Raises
    ------
    DatasetError
        When the image is damaged.
    """
    if not key.endswith(("depth.png", "mask.png")):
        return None
    image = open_image(data, key, DatasetError, MAX_PIXELS)
    return np.asarray(image).astype(np.uint16 if key.endswith("depth.png") else np.uint8)


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
