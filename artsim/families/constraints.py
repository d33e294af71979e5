"""What a user may ask of a procedural object: numbers of parts and joints, joint types, size, handles and legs.

A constraint has a name and a wanted value. The names are those of ``NAMES``; any other is a kind of moving part, such
as ``door``: words of a part's label. The same names serve :func:`artsim.make`, the command line and the names
of sources: ``door=2,drawer=1..3,handles=no``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from artsim.errors import ConfigError
from artsim.model.joints import JOINT_TYPES
from artsim.model.objects import ArticulatedObject

Interval = tuple[float, float]
Wanted = Interval | bool | frozenset[str]
"""Least and greatest value, yes or no, or joint types."""
Given = int | float | bool | str | Sequence[int | float | None] | Collection[str]
"""What :func:`artsim.make` takes for one constraint."""

LENGTHS = ("size", "height", "width", "depth")
"""The diagonal of the object's box at rest, and its extents along Z, Y and X, metres."""
FEATURES = ("handles", "legs")
"""What families record of an object besides its parts; see :meth:`artsim.making.assembly.Assembly.record`."""
NAMES = ("joints", "joint_types", *LENGTHS, *FEATURES)
TOLERANCE = 0.05
"""Share by which a length may miss a single number that is asked for: hardly any draw meets it exactly."""
_SHOWN = 8
_KIND = re.compile(r"[a-z]+(_[a-z]+)*")
_YES, _NO = ("yes", "true"), ("no", "false")


@dataclass(frozen=True)
class Constraints:
    """Wanted values by name, in alphabetical order of the names."""

    wanted: tuple[tuple[str, Wanted], ...] = ()

    @staticmethod
    def of(given: Mapping[str, Given]) -> Constraints:
        """Constraints out of the keywords of :func:`artsim.make`; None stands for no constraint.

        Raises
        ------
        ConfigError
            When a value makes no sense.
        """
        wanted = {_name(name): _wanted(_name(name), value) for name, value in given.items() if value is not None}
        return Constraints(tuple(sorted(wanted.items())))

    @staticmethod
    def parse(texts: Sequence[str]) -> Constraints:
        """Constraints out of texts such as ``doors=2``, ``drawers=1..3``, ``handles=no``.

        Raises
        ------
        ConfigError
            When a text is none.
        """
        given: dict[str, Given] = {}
        for text in texts:
            name, equals, value = text.partition("=")
            if not (name and equals and value):
                raise ConfigError(f"{text!r} is no constraint", "having", "write NAME=VALUE, such as doors=2")
            if _name(name) in map(_name, given):
                raise ConfigError(f"{name} is asked for twice", "having", "name it once, as a range: doors=1..3")
            given[name] = _value(_name(name), value)
        return Constraints.of(given)

    def __bool__(self) -> bool:
        return bool(self.wanted)

    def __str__(self) -> str:
        """As :meth:`parse` reads it, joined by commas."""
        return ",".join(f"{name}={_text(value)}" for name, value in self.wanted)

    def met_by(self, obj: ArticulatedObject) -> bool:
        """Whether an object meets all of them."""
        return all(_meets(measured(obj, name), name, wanted) for name, wanted in self.wanted)

    def refusal(self, category: str, objects: Sequence[ArticulatedObject]) -> ConfigError:
        """The error that says what objects of a category reach, where none of them meets the constraints."""
        reached = {name: [measured(obj, name) for obj in objects] for name, _ in self.wanted}
        unmet = [
            name for name, wanted in self.wanted if not any(_meets(value, name, wanted) for value in reached[name])
        ]
        shown = "; ".join(_reached(name, reached[name]) for name in unmet or reached)
        alone = "" if unmet else ", each is met, but not all of them at once"
        kinds = sorted({part.label for obj in objects for part in obj.parts[1:]})
        return ConfigError(
            f"none of {len(objects)} objects drawn has {self}{alone}. Drawn are {shown}",
            category,
            f"ask for values that are drawn, of {', '.join(NAMES)}, or of its parts {', '.join(kinds)}; "
            "or leave a constraint out",
        )


NO_CONSTRAINTS = Constraints()


def count_parts(obj: ArticulatedObject, kind: str) -> int:
    """How many moving parts are of a kind: their label has its words, as ``temple_left`` has ``temple``."""
    return sum(f"_{kind}_" in f"_{part.label}_" for part in obj.parts[1:])


def measured(obj: ArticulatedObject, name: str) -> float | bool | frozenset[str]:
    """The value of an object that a constraint of this name is about."""
    if name == "joints":
        return len(obj) - 1
    if name == "joint_types":
        return frozenset(obj.tree.types[1:])
    if name in LENGTHS:
        extents = obj.bounds[1] - obj.bounds[0]
        return obj.diagonal if name == "size" else float(extents[{"height": 2, "width": 1, "depth": 0}[name]])
    if name in FEATURES:
        return name in obj.features or count_parts(obj, name.removesuffix("s")) > 0
    return count_parts(obj, name)


def _meets(value: float | bool | frozenset[str], name: str, wanted: Wanted) -> bool:
    if isinstance(wanted, tuple):
        assert not isinstance(value, frozenset)
        slack = TOLERANCE if name in LENGTHS and wanted[0] == wanted[1] else 0.0
        return wanted[0] * (1.0 - slack) <= value <= wanted[1] * (1.0 + slack)
    return value == wanted


def _name(name: str) -> str:
    """The name of a constraint; a kind of part may stand in the plural."""
    if name in NAMES:
        return name
    single = name.removesuffix("s") if not name.endswith("ss") else name
    if not _KIND.fullmatch(single):
        raise ConfigError(
            f"{name!r} is no constraint", fix=f"use {', '.join(NAMES)}, or a kind of part such as door or drawer"
        )
    return single


def _wanted(name: str, value: Given) -> Wanted:
    """A value in the form that it is compared in.

    Raises
    ------
    ConfigError
    """
    if name in FEATURES:
        if not isinstance(value, (bool, np.bool_)):
            raise ConfigError(f"{name} is {value!r}", fix=f"write {name}=True or {name}=False (yes or no)")
        return bool(value)
    if name == "joint_types":
        types = frozenset([value] if isinstance(value, str) else value)  # type: ignore[arg-type]
        if not types or not types <= set(JOINT_TYPES[1:]):
            raise ConfigError(
                f"joint_types is {'+'.join(map(str, types)) or 'empty'}",
                fix=f"use some of {', '.join(JOINT_TYPES[1:])}",
            )
        return types  # type: ignore[return-value]
    ends = value if isinstance(value, (tuple, list)) else (value, value)
    if len(ends) != 2 or any(isinstance(end, (bool, str)) for end in ends):
        raise ConfigError(f"{name} is {value!r}", fix=f"write {name}=2, or a range: {name}=(1, 3)")
    try:
        low, high = (float(limit if end is None else end) for end, limit in zip(ends, (0.0, np.inf), strict=True))
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{name} is {value!r}", fix=f"write {name}=2, or a range: {name}=(1, 3)") from error
    if not 0.0 <= low <= high:
        raise ConfigError(f"{name} from {low:g} to {high:g} is no range", fix="write the smaller number, from 0, first")
    if name not in LENGTHS and not all(end == round(end) for end in (low, high) if np.isfinite(end)):
        raise ConfigError(f"{name} is {value!r}", fix=f"a number of {name}s is whole")
    return low, high


def _value(name: str, text: str) -> Given:
    """The value that a text stands for."""
    if name in FEATURES:
        if text.lower() not in _YES + _NO:
            raise ConfigError(f"{name} is {text!r}", "having", f"write {name}=yes or {name}=no")
        return text.lower() in _YES
    if name == "joint_types":
        return text.split("+")
    ends = text.split("..")
    try:
        numbers = [float(end) if end else None for end in ends]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 2 or numbers == [None]:
        raise ConfigError(f"{name} is {text!r}", "having", f"write {name}=2, or a range: {name}=1..3, {name}=1..")
    return numbers if len(numbers) == 2 else numbers[0]  # type: ignore[return-value]


def _text(value: float | Wanted) -> str:
    """A value as :meth:`Constraints.parse` reads it."""
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    if isinstance(value, frozenset):
        return "+".join(sorted(value))
    if isinstance(value, tuple):
        low, high = value
        return _text(low) if low == high else f"{_text(low)}..{_text(high) if np.isfinite(high) else ''}"
    return str(int(value)) if value == round(value) else repr(float(value))


def _reached(name: str, values: Sequence[float | bool | frozenset[str]]) -> str:
    """What values were drawn, and how often."""
    if name in LENGTHS:
        return f"{name} {min(values):.3g} to {max(values):.3g} m"
    counts = Counter(values)
    by_number = sorted(counts, key=lambda value: -counts[value])[:_SHOWN]
    if not isinstance(values[0], frozenset):
        by_number = sorted(by_number)
    listed = ", ".join(f"{_text(value)} ({counts[value]} times)" for value in by_number)
    return f"{name} {listed}" + (f" and {len(counts) - _SHOWN} more" if len(counts) > _SHOWN else "")
