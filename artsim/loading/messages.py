"""Messages between processes that do not trust each other: plain values, arrays, and records of known classes.

A message is the length of a text, the text, which is JSON, and the bytes of its arrays. Nothing is unpickled: whatever
reads a hostile file may be taken over by it, and may send anything.
"""

import json
import math
import struct
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from artsim import errors
from artsim.errors import ArtsimError

_LENGTHS = struct.Struct("<QQ")
_MOST_BYTES = 1 << 31
_KINDS = "biuf"
"""Of arrays: truths and numbers."""


def write_message(stream: IO[bytes], value: object) -> None:
    """Write a value: None, truths, numbers, text, bytes, paths, lists, tuples, mappings of text, arrays, dataclasses,
    and errors of artsim.

    Raises
    ------
    TypeError
        When it is anything else.
    """
    content = bytearray()
    text = json.dumps(_plain(value, content)).encode()
    for part in (_LENGTHS.pack(len(text), len(content)), text, content):
        stream.write(part)
    stream.flush()


def read_message(stream: IO[bytes], records: Iterable[type] = ()) -> Any:
    """The next value of a stream.

    Parameters
    ----------
    stream : binary file
    records : iterable of type
        Dataclasses that it may hold.

    Raises
    ------
    EOFError
        When the stream ends.
    ValueError
        When it is no message, or holds another class.
    """
    length, size = _LENGTHS.unpack(_read(stream, _LENGTHS.size))
    if length + size > _MOST_BYTES:
        raise ValueError("a message is too long")
    text, content = _read(stream, length), memoryview(_read(stream, size))
    try:
        return _value(json.loads(text), content, {kind.__name__: kind for kind in records})
    except (KeyError, IndexError, TypeError, AttributeError, RecursionError, OverflowError) as error:
        raise ValueError(f"it is no message ({error})") from error


def _read(stream: IO[bytes], size: int) -> bytes:
    data = stream.read(size)
    if len(data) < size:
        raise EOFError
    return data


def _plain(value: Any, content: bytearray) -> Any:
    """A value as JSON has it: what is not plain is a list of its kind and what it is made of."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, bytes | np.ndarray):
        kind, array = ("bytes", np.frombuffer(value, np.uint8)) if isinstance(value, bytes) else ("array", value)
        if array.dtype.kind not in _KINDS:
            raise TypeError(f"arrays of {array.dtype} are not sent")
        start = len(content)
        content += array.tobytes()
        return [kind, array.dtype.str, list(array.shape), start]
    if isinstance(value, Path):
        return ["path", str(value)]
    if isinstance(value, ArtsimError):
        return ["error", type(value).__name__, _plain(value.__reduce__()[1], content)]
    if is_dataclass(value):
        named = {each.name: _plain(getattr(value, each.name), content) for each in fields(value)}
        return ["record", type(value).__name__, named]
    if isinstance(value, Mapping):
        return ["mapping", {str(key): _plain(item, content) for key, item in value.items()}]
    if isinstance(value, list | tuple):
        return [type(value).__name__ if type(value) is list else "tuple", [_plain(item, content) for item in value]]
    raise TypeError(f"{type(value).__name__} is not sent")


def _value(plain: Any, content: memoryview, records: Mapping[str, type]) -> Any:
    if not isinstance(plain, list):
        return plain
    kind, *of = plain
    if kind in ("list", "tuple"):
        items = [_value(item, content, records) for item in of[0]]
        return items if kind == "list" else tuple(items)
    if kind == "mapping":
        return {key: _value(item, content, records) for key, item in of[0].items()}
    if kind == "record":
        return records[of[0]](**{key: _value(item, content, records) for key, item in of[1].items()})
    if kind == "path":
        return Path(of[0])
    if kind == "error":
        error = getattr(errors, of[0])
        if not issubclass(error, ArtsimError):
            raise ValueError(f"{of[0]} is no error of artsim")
        return error(*_value(of[1], content, records))
    dtype, shape, start = np.dtype(of[0]), tuple(of[1]), of[2]
    if dtype.kind not in _KINDS or min((start, *shape)) < 0:
        raise ValueError("it holds another kind of array")
    if kind == "bytes":
        return bytes(content[start : start + shape[0]])
    return np.frombuffer(content, dtype, math.prod(shape), start).reshape(shape).copy()  # aligned, and its own
