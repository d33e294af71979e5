"""What a user may ask of a procedural object: its parameters, and what it has: parts, joints, a size, handles, legs.

A constraint has a name and a wanted value. The names are those of ``NAMES``; any other is a parameter of the family,
such as ``handle_length``, or a kind of moving part, such as ``door``: words of a part's label. The same names serve
:func:`artsim.make`, the command line and the names of sources: ``door=2,drawer=1..3,handles=no``.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from artsim.common.products import norm
from artsim.errors import ConfigError
from artsim.making.assembly import Assembly
from artsim.making.draws import Draw, Interval, key_of
from artsim.model.joints import JOINT_TYPES

Wanted = Interval | bool | frozenset[str]
"""Least and greatest value, yes or no, or options such as joint types."""
Given = int | float | bool | str | Sequence[int | float | None] | Collection[str]
"""What :func:`artsim.make` takes for one constraint."""

LENGTHS = ("size", "height", "width", "depth")
"""The diagonal of the object's box at rest, and its extents along Z, Y and X, metres."""
AXES = {"depth": 0, "width": 1, "height": 2}
FEATURES = ("handles", "legs")
"""What families record of an object besides its parts; see :meth:`artsim.making.assembly.Assembly.record`."""
NAMES = ("joints", "joint_types", *LENGTHS, *FEATURES)
TOLERANCE = 0.05
"""Share by which a length may miss a single number that is asked for: hardly any draw meets it exactly."""
_SHOWN = 8
_KIND = re.compile(r"[a-z]+(_[a-z0-9]+)*")
_OPTION = re.compile(r"[A-Za-z][\w -]*")
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

    @property
    def of_draws(self) -> dict[str, Wanted]:
        """What is asked of draws by their names."""
        return {name: value for name, value in self.wanted if name not in NAMES}

    def without(self, names: Collection[str]) -> Constraints:
        """All but some."""
        return Constraints(tuple((name, wanted) for name, wanted in self.wanted if name not in names))

    def unmet_by(self, made: Assembly, drawn: Mapping[str, Draw]) -> list[str]:
        """Names of those that an object does not meet, whose draws are in ``drawn``."""
        parameters = {key_of(name) for name in drawn}
        return [name for name, wanted in self.wanted if not _met(made, name, wanted, name in parameters)]

    def refusal(
        self, category: str, reached: Sequence[Assembly], drawn: Mapping[str, Draw], outside: Collection[str]
    ) -> ConfigError:
        """The error that says what objects of a category reach, where none of them meets the constraints.

        ``drawn`` has its parameters, ``outside`` those that cannot have what is asked for.
        """
        draws = {key_of(name): draw for name, draw in drawn.items()}
        kinds = sorted({label for made in reached for label in made.labels[1:]})
        apart, strange, shown = [], [], []
        for name, wanted in self.wanted:
            counted = name in NAMES or any(count_parts(made, name) for made in reached)
            if not (counted or name in draws):
                strange.append(name)
            elif name in outside or (reached and not any(_met(made, name, wanted, name in draws) for made in reached)):
                apart.append(name)
        for name in apart if apart or strange else [name for name, _ in self.wanted]:
            if name in draws and (name in outside or not any(count_parts(made, name) for made in reached)):
                shown.append(f"{name} is {described(draws[name])}")
            elif reached:
                shown.append(_reached(name, [measured(made, name) for made in reached]))
        shown += [f"it has no parameter and no part {name}" for name in strange if reached]
        alike = [found for name in strange for found in get_close_matches(name, [*drawn, *kinds], 3)]
        together = "" if apart or strange else ", each is met, but not all of them at once"
        names = ", ".join((*NAMES, *kinds))
        return ConfigError(
            f"no object drawn has {self}{together}: {'; '.join(shown)}",
            category,
            (f"did you mean {' or '.join(alike)}? Else " if alike else "")
            + f"ask for values that are drawn of {names}, or of other parameters "
            f"('artsim families {category}' lists them); or leave a constraint out",
        )


NO_CONSTRAINTS = Constraints()


def count_parts(made: Assembly, kind: str) -> int:
    """How many moving parts are of a kind: their label has its words, as ``temple_left`` has ``temple``."""
    return sum(f"_{kind}_" in f"_{label}_" for label in made.labels[1:])


def measured(made: Assembly, name: str) -> float | bool | frozenset[str]:
    """The value of an object that a constraint of this name is about; a number of parts, unless it is of ``NAMES``."""
    if name == "joints":
        return len(made) - 1
    if name == "joint_types":
        return frozenset(made.joint_types[1:])
    if name in LENGTHS:
        return measured_length(made, name)
    if name in FEATURES:
        return name in made.features or count_parts(made, name.removesuffix("s")) > 0
    return count_parts(made, name)


def measured_length(made: Assembly, name: str) -> float:
    """One of ``LENGTHS`` of an object at rest, metres."""
    extents = made.extents()
    return float(norm(extents) if name == "size" else extents[AXES[name]])


def described(draw: Draw) -> str:
    """What a draw may give, as text: "0.4 to 0.6 m", "bar, bow or none"."""
    if draw.kind == "choice":
        return " or ".join(filter(None, (", ".join(draw.options[:-1]), draw.options[-1])))
    if draw.kind == "yes or no":
        return f"{draw.kind}, yes in {100 * draw.high:.3g} %"
    return "a seed of details" if draw.kind == "seed" else f"{draw.low:.4g} to {draw.high:.4g} {draw.unit}".rstrip()


def _met(made: Assembly, name: str, wanted: Wanted, drawn: bool) -> bool:
    """Whether an object meets a constraint; a parameter that is ``drawn`` has the value that is asked for."""
    if name in NAMES:
        return meets(measured(made, name), name, wanted)
    if drawn and (not isinstance(wanted, tuple) or count_parts(made, name) == 0):
        return True
    return isinstance(wanted, tuple) and meets(measured(made, name), name, wanted)


def meets(value: float | bool | frozenset[str], name: str, wanted: Wanted) -> bool:
    """Whether a value is what is asked for."""
    if isinstance(wanted, tuple):
        assert not isinstance(value, frozenset)
        slack = TOLERANCE if name in LENGTHS and wanted[0] == wanted[1] else 0.0
        return wanted[0] * (1.0 - slack) <= value <= wanted[1] * (1.0 + slack)
    return value == wanted


def _name(name: str) -> str:
    """The name of a constraint; a kind of part may stand in the plural."""
    if name in NAMES:
        return name
    if not _KIND.fullmatch(name):
        raise ConfigError(
            f"{name!r} is no constraint", fix=f"use {', '.join(NAMES)}, a parameter, or a kind of part such as door"
        )
    return key_of(name)


def _wanted(name: str, value: Given) -> Wanted:
    """A value in the form that it is compared in.

    Raises
    ------
    ConfigError
    """
    if isinstance(value, (bool, np.bool_)) and name not in ("joints", "joint_types", *LENGTHS):
        return bool(value)
    if name in FEATURES:
        raise ConfigError(f"{name} is {value!r}", fix=f"write {name}=True or {name}=False (yes or no)")
    if name == "joint_types" or isinstance(value, (str, set, frozenset)):
        options = frozenset([value] if isinstance(value, str) else value)  # type: ignore[arg-type]
        if name in ("joints", *LENGTHS):
            raise ConfigError(f"{name} is {value!r}", fix=f"write {name}=2, or a range: {name}=(1, 3)")
        if not options or (name == "joint_types" and not options <= set(JOINT_TYPES[1:])):
            known = f"some of {', '.join(JOINT_TYPES[1:])}" if name == "joint_types" else "an option"
            raise ConfigError(f"{name} is {'+'.join(map(str, options)) or 'empty'}", fix=f"use {known}")
        return options  # type: ignore[return-value]
    ends = value if isinstance(value, (tuple, list)) else (value, value)
    if len(ends) != 2 or any(isinstance(end, (bool, str)) for end in ends):
        raise ConfigError(f"{name} is {value!r}", fix=f"write {name}=2, or a range: {name}=(1, 3)")
    least = 0.0 if name in NAMES else -np.inf
    try:
        low, high = (float(limit if end is None else end) for end, limit in zip(ends, (least, np.inf), strict=True))
    except (TypeError, ValueError) as error:
        raise ConfigError(f"{name} is {value!r}", fix=f"write {name}=2, or a range: {name}=(1, 3)") from error
    if not least <= low <= high:
        raise ConfigError(f"{name} from {low:g} to {high:g} is no range", fix="write the smaller number first")
    if name == "joints" and not all(end == round(end) for end in (low, high) if np.isfinite(end)):
        raise ConfigError(f"{name} is {value!r}", fix=f"a number of {name}s is whole")
    return low, high


def _value(name: str, text: str) -> Given:
    """The value that a text stands for."""
    if text.lower() in _YES + _NO and name not in ("joints", "joint_types", *LENGTHS):
        return text.lower() in _YES
    if name in FEATURES:
        raise ConfigError(f"{name} is {text!r}", "having", f"write {name}=yes or {name}=no")
    if name == "joint_types":
        return text.split("+")
    ends = text.split("..")
    try:
        numbers = [float(end) if end else None for end in ends]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 2 or numbers == [None]:
        if name not in NAMES and all(_OPTION.fullmatch(option) for option in text.split("+")):
            return set(text.split("+"))
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
        return _text(low) if low == high else "..".join(_text(end) if np.isfinite(end) else "" for end in value)
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
