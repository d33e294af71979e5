"""Files are read within limits; whatever is no JSON or array is refused."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artsim.common.array_files import parse_npy, parse_npz
from artsim.common.files import parse_json, read_bounded, read_json
from artsim.errors import AssetError


@pytest.mark.parametrize(
    "text",
    [b"[" * 100_000, b"[" * 70 + b"]" * 70, b"{\"a\":" * 500, b"1" * 5000, b"[1" + b"0" * 25 + b"]", b"1e999", b"NaN",
     b"[Infinity]", b'"\\ud800"', b"\xff", b"", b"[0," * 10, b"nul", b"\xef\xbb\xbf"],
)  # fmt: skip
def test_json_of_no_use_is_a_value_error(text: bytes) -> None:
    with pytest.raises(ValueError, match=r"."):
        parse_json(text)


def test_json_is_read_with_a_byte_order_mark() -> None:
    assert parse_json(b'\xef\xbb\xbf{"a": [1, 2.5, "\\ud83d\\ude00"]}') == {"a": [1, 2.5, "\U0001f600"]}


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("shape", [(), (0, 3), (4, 3), (2, 3, 4)])
@pytest.mark.parametrize("dtype", ["f8", "i1", "<u2", ">f4", "?", "U3"])
def test_arrays_come_back(order: Any, shape: tuple[int, ...], dtype: str) -> None:
    array = np.asarray(np.arange(np.prod(shape, dtype=int)).reshape(shape).astype(dtype), order=order)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, a=array, b=array)
    one = io.BytesIO()
    np.save(one, array)
    for found in (*parse_npz(buffer.getvalue()).values(), parse_npy(one.getvalue())):
        np.testing.assert_array_equal(found, array)
        assert found.dtype == array.dtype
        assert found.flags.writeable


def test_a_file_is_read_up_to_its_limit_and_no_further(tmp_path: Path) -> None:
    (tmp_path / "f").write_bytes(bytes(100))
    assert len(read_bounded(tmp_path / "f", 100, "file")) == 100
    with pytest.raises(AssetError, match="over the limit"):
        read_bounded(tmp_path / "f", 99, "file")
    with pytest.raises(AssetError, match="is a folder"):
        read_bounded(tmp_path, 99, "file")
    with pytest.raises(AssetError, match="cannot read file"):
        read_json(tmp_path / "a\0b", "file")
