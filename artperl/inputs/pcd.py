"""Points of PCD files (Point Cloud Library): ascii, binary and binary_compressed."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.bounds import MAX_VALUES, check_count, guard, read_file
from artperl.inputs.text import parse_columns
from artsim.errors import ConfigError

Array = NDArray[np.float64]

_FIX = "save the cloud again, as PCD with fields x y z"
_MOST_HEADER = 10_000
_MOST_RUNS = 5_000_000
"""Of compressed bytes, of which Python unpacks three million a second; a million points with colours have one."""
_KINDS = {"F": "f", "I": "i", "U": "u"}


def read_pcd(path: Path) -> tuple[Array, tuple[str, ...]]:
    """(N, 3) points, and which fields are not used.

    Raises
    ------
    ConfigError
        When the file is no PCD, is cut off, or has no x, y, z.
    """
    return guard(lambda: _read(path), path, "cloud", _FIX)


def _read(path: Path) -> tuple[Array, tuple[str, ...]]:
    data = read_file(path, "cloud")
    header, start = _header(data, path)
    names = [name.lower() for name in header["FIELDS"]]
    sizes, kinds = [int(v) for v in header["SIZE"]], [_KINDS[v.upper()] for v in header["TYPE"]]
    counts = [int(v) for v in header.get("COUNT", ["1"] * len(names))]
    if not (len(names) == len(sizes) == len(kinds) == len(counts) and all(axis in names for axis in "xyz")):
        raise ConfigError("it has no fields x, y, z", path, _FIX)
    if min(counts) < 1 or max(counts) > 4096:  # descriptors such as FPFH have 33
        raise ConfigError("its fields are of impossible sizes", path, _FIX)
    points = int(header["POINTS"][0]) if "POINTS" in header else int(header["WIDTH"][0]) * int(header["HEIGHT"][0])
    check_count(3 * points, path, "a cloud")
    others = [name for name in names if name not in ("x", "y", "z")]
    notes = (f"not used: {', '.join(others)[:200]}",) if others else ()
    kind = header["DATA"][0].lower()
    if points < 0 or kind not in ("ascii", "binary", "binary_compressed"):
        raise ConfigError("its PCD header is damaged", path, _FIX)
    columns = [names.index(axis) for axis in "xyz"]
    if kind == "ascii":
        if 2 * sum(counts) * points - 1 > len(data) - start:
            raise _cut_off(points, path)
        places = [sum(counts[:column]) for column in columns]
        cloud = parse_columns(data[start:], places, None, 0, points) if points else np.zeros((0, 3))
        if len(cloud) != points:
            raise _cut_off(points, path)
        return cloud, notes
    widths = [size * count for size, count in zip(sizes, counts, strict=True)]
    places = [sum(widths[:column]) for column in columns]
    types = [f"<{kinds[column]}{sizes[column]}" for column in columns]
    size = points * sum(widths)
    if kind == "binary":
        if start + size > len(data):
            raise _cut_off(points, path)
        row = np.dtype({"names": ["x", "y", "z"], "formats": types, "offsets": places, "itemsize": sum(widths)})
        rows = np.frombuffer(data, row, points, start)
        fields = [rows[axis] for axis in "xyz"]
    else:
        packed, whole = (int.from_bytes(data[start + at : start + at + 4], "little") for at in (0, 4))
        if whole != size or start + 8 + packed > len(data):
            raise _cut_off(points, path)
        if whole > 8 * MAX_VALUES:
            raise ConfigError("it is too large", path, "save fewer points, or fewer fields")
        raw = unpack_lzf(data[start + 8 : start + 8 + packed], whole)
        # Field by field here, not point by point.
        fields = [np.frombuffer(raw, of, points, points * at) for of, at in zip(types, places, strict=True)]
    return np.stack(fields, axis=1, dtype=np.float64, casting="unsafe"), notes


def unpack_lzf(packed: bytes, size: int) -> bytes:
    """Bytes that LZF, the compression of PCD files, has packed.

    Parameters
    ----------
    packed : bytes
    size : int
        Of the result.

    Raises
    ------
    ValueError
        When they are damaged, or make another size.
    """
    out, at, runs = bytearray(), 0, 0
    while at < len(packed):
        runs += 1
        if runs > _MOST_RUNS:
            raise ValueError("its compressed points are too many: save them as binary")
        control = packed[at]
        at += 1
        if control < 32:  # so many bytes, and one more, as they are
            out += packed[at : at + control + 1]
            at += control + 1
        else:  # a run that came before
            length = control >> 5
            if length == 7:
                length += packed[at]
                at += 1
            back = ((control & 31) << 8) + packed[at] + 1
            at += 1
            length += 2
            begin = len(out) - back
            if begin < 0:
                raise ValueError("its compressed points are damaged")
            run = out[begin : begin + length]
            out += run if len(run) == length else (run * (length // len(run) + 1))[:length]
        if len(out) > size:
            break
    if len(out) != size:
        raise ValueError("its compressed points are damaged")
    return bytes(out)


def _header(data: bytes, path: Path) -> tuple[dict[str, list[str]], int]:
    header: dict[str, list[str]] = {}
    at = 0
    while at < min(len(data), _MOST_HEADER) and "DATA" not in header:
        end = data.find(b"\n", at)
        end = len(data) if end < 0 else end
        words = data[at : min(end, at + _MOST_HEADER)].decode("latin-1").split()
        if words and not words[0].startswith("#"):
            header[words[0].upper()] = words[1:]
        at = end + 1
    if not {"FIELDS", "SIZE", "TYPE", "DATA"} <= header.keys() or not header["DATA"]:
        raise ConfigError("it has no PCD header", path, _FIX)
    return header, at


def _cut_off(count: int, path: Path) -> ConfigError:
    return ConfigError(f"it is cut off: it does not hold its {count:,} points", path, "copy or save it again")
