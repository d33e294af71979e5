"""Messages hold what was sent, and nothing but what may be sent."""

from __future__ import annotations

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from artsim.errors import ArtsimError, SceneError
from artsim.loading.messages import read_message, write_message
from artsim.model.objects import JointDynamics, Repair


def sent(value: object, *records: type) -> Any:
    stream = io.BytesIO()
    write_message(stream, value)
    stream.seek(0)
    return read_message(stream, records)


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text() | st.binary(),
    lambda inner: st.lists(inner) | st.tuples(inner, inner) | st.dictionaries(st.text(), inner),
    max_leaves=10,
)


@given(PLAIN)
def test_plain_values_come_back_as_they_are(value: object) -> None:
    assert sent(value) == value


def test_arrays_records_paths_and_errors_come_back() -> None:
    arrays = {"a": np.arange(6.0).reshape(2, 3).T, "b": np.zeros((0, 3), np.int32), "c": np.array([True, False])}
    for name, array in sent(arrays).items():
        np.testing.assert_array_equal(array, arrays[name])
        assert (array.dtype, array.shape) == (arrays[name].dtype, arrays[name].shape)
    assert sent((Path("a/b"), np.float64(2.5))) == (Path("a/b"), 2.5)
    assert sent([Repair("x", "y", note=True)], Repair) == [Repair("x", "y", note=True)]
    error = sent(SceneError("two", "a.usd", "choose", ("b", "c")))
    assert (type(error), str(error), error.names) == (SceneError, "a.usd: two. Fix: choose", ("b", "c"))


@pytest.mark.parametrize(
    "plain",
    [
        ["record", "JointDynamics", {}],
        ["record", "Repair", {"command": 1}],
        ["error", "printable", ["tuple", []]],
        ["array", "|O", [1], 0],
        ["array", "<f8", [1 << 40], 0],
        ["array", "<f8", [-1], 0],
        ["module", "os"],
        [],
    ],
)
def test_what_may_not_be_sent_is_refused(plain: object) -> None:
    text = json.dumps(plain).encode()
    with pytest.raises(ValueError, match=r"."):
        read_message(io.BytesIO(struct.pack("<QQ", len(text), 8) + text + bytes(8)), (Repair,))


def test_other_values_are_not_sent_and_a_stream_that_ends_is_no_message() -> None:
    for value in (object(), {1, 2}, np.array([object()])):
        with pytest.raises(TypeError):
            sent(value)
    with pytest.raises(ValueError, match="no message"):
        sent(JointDynamics())
    with pytest.raises(EOFError):
        read_message(io.BytesIO(b"\0" * 9))
    with pytest.raises(ValueError, match="too long"):
        read_message(io.BytesIO(struct.pack("<QQ", 1 << 62, 0)))
    assert issubclass(SceneError, ArtsimError)
