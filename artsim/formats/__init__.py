"""Finished datasets in the formats that other programs read: WebDataset, BOP, COCO, HDF5 and PLY.

Stable names; the modules of this package are private. h5py is imported when HDF5 is first written.
"""

from artsim.formats.conversion import ConvertResult, convert
from artsim.formats.webdataset import decode_values

__all__ = ["ConvertResult", "convert", "decode_values"]
