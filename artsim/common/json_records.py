"""Dataclasses out of the plain values of a JSON file, each value checked against the type of its field."""

from __future__ import annotations

import math
import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")

_MAX_ITEMS = 10_000


def from_json_values(kind: type[T], data: object) -> T:
    """A dataclass of ``kind``, inverse of ``dataclasses.asdict`` and JSON for fields of plain types.

    Fields may be bool, int, float, str, Literal, tuples of these, dataclasses of these, and any of them or None. A
    field that is not given takes its default.

    Parameters
    ----------
    kind : type
        A dataclass.
    data : object
        A mapping of field names to JSON's values.

    Raises
    ------
    ValueError
        Naming the field that is unknown, missing or of another type.
    """
    if not isinstance(data, Mapping):
        raise ValueError(f"{kind.__name__} is not a set of named values")
    hints = get_type_hints(kind)
    known = {field.name for field in fields(kind)} if is_dataclass(kind) else set()
    unknown = [name for name in data if name not in known]
    if unknown:
        raise ValueError(f"{kind.__name__} has no field {unknown[0]!r}")
    values = {name: _as_type(hints[name], value, name) for name, value in data.items()}
    try:
        return kind(**values)
    except TypeError as error:  # a field without a default is missing
        raise ValueError(str(error)) from error


def _as_type(hint: Any, value: object, name: str) -> Any:
    """The value as the type of a field has it."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        if value is None and type(None) in inner:
            return None
        return _as_type(next(kind for kind in inner if kind is not type(None)), value, name)
    if origin is Literal:
        if isinstance(value, (str, int)) and value in inner:
            return value
    elif origin is tuple:
        if isinstance(value, (list, tuple)) and len(value) <= _MAX_ITEMS:
            kinds = (inner[0],) * len(value) if len(inner) == 2 and inner[1] is Ellipsis else inner
            if len(kinds) == len(value):
                return tuple(_as_type(kind, item, name) for kind, item in zip(kinds, value, strict=True))
    elif is_dataclass(hint) and isinstance(hint, type):
        return from_json_values(hint, value)
    elif hint is float:
        if isinstance(value, (int, float)) and not isinstance(value, bool) and not math.isnan(value):
            return float(value)
    elif hint in (bool, int, str) and type(value) is hint:
        return value
    raise ValueError(f"{name} is {value!r:.60}")
