"""Parameters of a procedural object: what its family drew, by name."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import Any

from artsim.errors import ConfigError

Value = float | int | bool | str


@dataclass(frozen=True)
class Params:
    """All that makes a procedural object: :func:`artsim.make` makes it from them again, byte by byte.

    ``replace`` of :mod:`dataclasses`, or :meth:`having`, changes some: the object is made with them, and what they do
    not say is drawn as the seed has it. A number outside the range that its family draws is moved into it.
    """

    category: str
    seed: int
    draw: int = 0
    """Which of the seed's draws it is: 0, unless constraints had to be met."""
    values: Mapping[str, Value] = field(default_factory=dict)
    """Every number, choice and seed of details by name, in metres, radians or the unit of the name's draw."""

    def __getitem__(self, name: str) -> Value:
        return self.values[name]

    def having(self, **values: Value) -> Params:
        """The same parameters with other values.

        Raises
        ------
        ConfigError
            When a name is none of theirs.
        """
        unknown = sorted(values.keys() - self.values.keys())
        if unknown:
            fix = f"use one of {', '.join(self.values)}"
            raise ConfigError(f"{self.category} {self.seed} has no parameter {', '.join(unknown)}", "Params", fix)
        return replace(self, values={**self.values, **values})

    def between(self, other: Params, share: float) -> Params:
        """Parameters on the way from these (0) to others of the same category (1).

        Numbers are in between. Choices, and all that only one of the two has, are those of the nearer one.

        Raises
        ------
        ConfigError
            When the other ones are of another category.
        """
        if other.category != self.category:
            raise ConfigError(f"there is nothing between a {self.category} and a {other.category}", "Params")
        near, far = (self, other) if share < 0.5 else (other, self)
        mixed = dict(near.values)
        for name, value in self.values.items():
            towards = other.values.get(name)
            if type(value) is float and type(towards) is float:
                mixed[name] = value + share * (towards - value)
            elif name in far.values and type(value) is int and type(towards) is int and abs(value) < _COUNTS > towards:
                mixed[name] = round(value + share * (towards - value))
        return replace(near, values=mixed)

    def to_json(self) -> str:
        """As :meth:`from_json` reads it."""
        return json.dumps(asdict(self), indent=1)

    @staticmethod
    def from_json(text: str, where: str = "Params") -> Params:
        """Parameters out of what :meth:`to_json` wrote.

        Raises
        ------
        ConfigError
            When the text holds none.
        """
        try:
            found: Any = json.loads(text)
            values = found["values"]
            if not all(isinstance(value, str) or abs(value) < _LARGEST for value in values.values()):
                raise TypeError("a value is no finite number, text, true or false")
            seed, draw = (int(found[name]) for name in ("seed", "draw"))
            return Params(str(found["category"]), seed, draw, dict(values))
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
            raise ConfigError(f"no parameters of a procedural object ({error})", where, "use Params.to_json") from error


_LARGEST = 1e300
_COUNTS = 1000
"""Whole numbers below are counts; seeds are larger."""
