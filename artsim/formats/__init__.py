"""Finished datasets in the formats that other programs read.

Stable names; the modules of this package are private. h5py and pyarrow are imported when they are first needed.
"""

from artsim.formats.conversion import ConvertResult, convert
from artsim.formats.op_align import read_op_align
from artsim.formats.webdataset import decode_values

__all__ = ["ConvertResult", "convert", "decode_values", "read_op_align"]
