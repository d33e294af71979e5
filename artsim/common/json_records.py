"""Values of untrusted JSON as types have them: plain types, records (dataclasses), and bounds in ``Annotated``."""

import math
import re
import types
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

T = TypeVar("T")

_MAX_ITEMS = 10_000
_MAX_TEXT = 4096

SHA256 = re.compile(r"[0-9a-f]{64}")
Pixels = Annotated[int, range(1, 8193)]
"""Width or height of an image."""


def from_json_values(kind: type[T], data: object, others: bool = False) -> T:
    """A dataclass of ``kind``, inverse of ``dataclasses.asdict`` and JSON.

    Fields may be of the types of :func:`as_type`. A field that is not given takes its default.

    Parameters
    ----------
    kind : type
        A dataclass.
    data : object
        A mapping of field names to JSON's values.
    others : bool
        Pass over names that are no field, in place of refusing them.

    Raises
    ------
    ValueError
        Naming the field that is unknown, missing or of another type.
    """
    if not isinstance(data, Mapping):
        raise ValueError(f"{kind.__name__} is not a set of named values")
    hints = _hints(kind)  # type: ignore[arg-type]  # a class is hashable
    unknown = [name for name in data if name not in hints]
    if unknown and not others:
        raise ValueError(f"{kind.__name__} has no field {unknown[0]!r:.60}")
    values = {name: as_type(hints[name], value, name) for name, value in data.items() if name in hints}
    try:
        return kind(**values)
    except TypeError as error:  # a field without a default is missing
        raise ValueError(str(error)) from error


def as_type(hint: Any, value: object, name: str, bounds: tuple[object, ...] = ()) -> Any:
    """A value of JSON as a type has it.

    Parameters
    ----------
    hint : type
        bool, int, float, str, list, dict, Literal, tuples and mappings of these, dataclasses of these, and unions.
        ``Annotated[int, range(1, 9)]`` bounds a number, ``Annotated[tuple[str, ...], range(9)]`` a length, and
        ``Annotated[str, re.compile(...)]`` says what a whole text matches.
    value : object
    name : str
        For messages.

    Raises
    ------
    ValueError
        When it is of another type, or out of bounds.
    """
    origin, inner = get_origin(hint), get_args(hint)
    most = next((bound.stop for bound in bounds if isinstance(bound, range)), _MAX_ITEMS + 1)
    if origin is Annotated:
        return as_type(inner[0], value, name, inner[1:])
    if origin in (Union, types.UnionType):
        if value is None and type(None) in inner:
            return None
        return _as_any(inner, value, name)
    if origin is Literal:
        if isinstance(value, (str, int)) and value in inner:
            return value
    elif origin is tuple:
        if isinstance(value, (list, tuple)) and len(value) < most:
            kinds = (inner[0],) * len(value) if len(inner) == 2 and inner[1] is Ellipsis else inner
            if len(kinds) == len(value):
                return tuple(as_type(kind, item, name) for kind, item in zip(kinds, value, strict=True))
    elif origin in (dict, Mapping):
        if isinstance(value, dict) and len(value) < most:
            return {as_type(inner[0], key, name): as_type(inner[1], item, str(key)) for key, item in value.items()}
    elif is_dataclass(hint) and isinstance(hint, type):
        return from_json_values(hint, value)
    elif hint is float:
        if isinstance(value, (int, float)) and not isinstance(value, bool) and not math.isnan(value):
            return float(value)
    elif type(value) is hint and _within(value, bounds):
        return value
    raise ValueError(f"{name} is {value!r:.60}")


def _as_any(hints: tuple[Any, ...], value: object, name: str) -> Any:
    """A value as the first of some types that takes it."""
    errors = []
    for hint in hints:
        try:
            return as_type(hint, value, name)
        except ValueError as error:
            errors.append(error)
    raise errors[0]


def _within(value: object, bounds: tuple[object, ...]) -> bool:
    for bound in bounds:
        if isinstance(bound, range) and (value if isinstance(value, int) else len(value)) not in bound:  # type: ignore[arg-type]
            return False
        if isinstance(bound, re.Pattern) and not bound.fullmatch(str(value)):
            return False
    return not isinstance(value, str) or len(value) <= _MAX_TEXT


@cache
def _hints(kind: type) -> dict[str, Any]:
    """Types of the fields that are given when a record is made."""
    known = {field.name for field in fields(kind) if field.init} if is_dataclass(kind) else set()
    return {name: hint for name, hint in get_type_hints(kind, include_extras=True).items() if name in known}
