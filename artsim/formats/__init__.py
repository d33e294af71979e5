"""Finished datasets in the formats that other programs read: WebDataset, BOP, COCO, HDF5 and PLY.

Stable names; the modules of this package are private. h5py is imported when HDF5 is first written.
"""

from typing import TYPE_CHECKING

from artsim.common.lazy import lazy_names

if TYPE_CHECKING:
    from artsim.formats.conversion import ConvertResult, convert
    from artsim.formats.webdataset import decode_values

__all__ = ["ConvertResult", "convert", "decode_values"]

_HOMES = {
    "ConvertResult": "conversion",
    "convert": "conversion",
    "decode_values": "webdataset",
}
__getattr__, __dir__ = lazy_names(__name__, _HOMES)
