"""Named draws: every number and choice that a family draws has a name, a range and a unit.

A family asks for what it needs by name: ``draws.number("width", (0.4, 0.6), unit="m")``. What is drawn is recorded, so
that an object's parameters can be listed, stored, changed and drawn again. A value that is asked for takes the place of
the one that is drawn; the generator moves on as if nothing had been asked, so that all else stays as it is.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, TypeVar

import numpy as np

from artsim.common.elementary import exp
from artsim.common.names import is_number
from artsim.model.kinematics import Array
from artsim.model.params import Value

Rng = np.random.Generator
"""An explicit generator, never a global one."""
Interval = tuple[float, float]
Wanted = Value | Interval | frozenset[str]
"""What is asked for: one value, a range, or one of several options."""
Choice = TypeVar("Choice")
_SEEDS = 2**31
_TRIES = 1000


@dataclass(frozen=True)
class Draw:
    """One draw: its value, and what could have been drawn."""

    value: Value
    kind: str
    """"number", "integer", "yes or no", "choice" or "seed"."""
    low: float = 0.0
    high: float = 1.0
    unit: str = ""
    options: tuple[str, ...] = ()


class UnmetError(Exception):
    """What is asked for lies outside what is drawn here: the family draws again."""

    def __init__(self, name: str, draw: Draw) -> None:
        super().__init__(name)
        self.name, self.draw = name, draw


@dataclass
class _Trace:
    wanted: Mapping[str, Wanted]
    lenient: bool
    drawn: dict[str, Draw] = field(default_factory=dict)
    counts: dict[str, int] = field(default_factory=dict)


class Draws:
    """What a family draws from.

    A name that is drawn again is numbered: ``width``, ``width_2``. What is asked of ``width`` counts for both, unless
    it is a whole number: a count.

    Parameters
    ----------
    rng : numpy.random.Generator
    wanted : mapping, optional
        Values, ranges and options by the names of draws; see :func:`key_of`.
    lenient : bool
        Move a wanted number into the range of its draw and ignore an unknown option; else raise :class:`UnmetError`.
    """

    def __init__(self, rng: Rng, wanted: Mapping[str, Wanted] | None = None, lenient: bool = False) -> None:
        self.rng = rng
        """The generator, for what is no parameter: an order, noise."""
        self._trace = _Trace(wanted or {}, lenient)
        self._prefix = ""

    def within(self, name: str) -> Draws:
        """The same draws for a piece of the object, whose names begin with its own: ``door_width``."""
        return self._child(self.rng, name)

    def fork(self, name: str, seed: int | Sequence[int] | Rng) -> Draws:
        """Draws of a piece from a generator of its own, which is given or made: equal seeds make equal pieces."""
        return self._child(np.random.default_rng(seed), name)

    def tries(self) -> Iterator[Draws]:
        """These draws until what is drawn fits: the draws of each try take the place of those of the one before.

        Raises
        ------
        UnmetError
            After a thousand: what is asked for never fits.
        """
        counts, drawn = dict(self._trace.counts), dict(self._trace.drawn)
        for _ in range(_TRIES):
            self._trace.counts, self._trace.drawn = dict(counts), dict(drawn)
            yield self
        raise UnmetError(*list(self._trace.drawn.items())[-1])

    def _child(self, rng: Rng, name: str) -> Draws:
        child = Draws.__new__(Draws)
        child.rng, child._trace, child._prefix = rng, self._trace, f"{self._prefix}{name}_" if name else self._prefix
        return child

    @property
    def drawn(self) -> Mapping[str, Draw]:
        """Every draw so far, by name."""
        return self._trace.drawn

    def number(
        self, name: str, usual: Interval, widest: Interval | None = None, *, tails: float = 0.25, unit: str = "",
        of: float = 1.0,
    ) -> float:  # fmt: skip
        """A number from the usual range, or with chance ``tails`` from what the widest range has beyond it.

        A flat draw over all that a category holds makes most objects odd: tails are drawn seldom. The ranges are shares
        ``of`` a number.
        """
        low, high = usual
        if widest is not None:
            beyond = [t for t in ((widest[0], low), (high, widest[1])) if t[0] < t[1]]
            if beyond and self.rng.random() < tails:
                low, high = beyond[int(self.rng.integers(len(beyond)))]
        least, most = widest or usual
        return self._number(name, of * float(self.rng.uniform(low, high)), (of * least, of * most), unit)

    def length(
        self, name: str, usual: Interval, widest: Interval | None = None, *, tails: float = 0.25, of: float = 1.0
    ) -> float:
        """A :meth:`number` of metres; or a share ``of`` a length, which is kept in metres."""
        return self.number(name, usual, widest, tails=tails, unit="m", of=of)

    def lengths(self, *, of: float = 1.0, **usual: Interval) -> tuple[float, ...]:
        """Several :meth:`length` by name, in order: ``lengths(width=(0.4, 0.6), height=(0.1, 0.2))``."""
        return tuple(self.length(name, span, of=of) for name, span in usual.items())

    def angle(self, name: str, usual: Interval, widest: Interval | None = None, *, tails: float = 0.25) -> float:
        """A :meth:`number` of radians."""
        return self.number(name, usual, widest, tails=tails, unit="rad")

    def degrees(self, name: str, usual: Interval, widest: Interval | None = None, *, tails: float = 0.25) -> float:
        """A :meth:`number` of degrees."""
        return self.number(name, usual, widest, tails=tails, unit="deg")

    def turn(self, name: str, usual: Interval, widest: Interval | None = None, *, tails: float = 0.25) -> float:
        """Radians that are drawn in :meth:`degrees`."""
        return float(np.deg2rad(self.degrees(name, usual, widest, tails=tails)))

    def log_length(self, name: str, middle: float, low: float, high: float) -> float:
        """Metres whose logarithm is drawn evenly: from ``middle * exp(low)`` to ``middle * exp(high)``."""
        value = middle * exp(self.rng.uniform(low, high))
        return self._number(name, value, (middle * exp(low), middle * exp(high)), "m")

    def numbers(self, name: str, low: Any, high: Any, count: int | None = None, *, unit: str = "") -> Array:
        """(N,) numbers between ``low`` and ``high``, each of which may be an array; named ``name``, ``name_2``."""
        values = np.asarray(self.rng.uniform(low, high, count), dtype=np.float64)
        ends = np.broadcast_to(low, values.shape), np.broadcast_to(high, values.shape)
        found = [
            self._number(name, float(v), (float(a), float(b)), unit) for v, a, b in zip(values, *ends, strict=True)
        ]
        return np.array(found)

    def triangular(self, name: str, low: float, mode: float, high: float, *, unit: str = "", of: float = 1.0) -> float:
        """A number whose density rises from ``low`` to ``mode`` and falls to ``high``: shares ``of`` a number."""
        return self._number(name, of * float(self.rng.triangular(low, mode, high)), (of * low, of * high), unit)

    def integer(self, name: str, least: int, most: int) -> int:
        """A whole number from ``least`` to ``most``, both included."""
        value = int(self.rng.integers(least, most + 1))
        key, wanted = self._asked(name, each=False)  # three doors are three doors in all
        draw = Draw(value, "integer", least, most)
        if wanted is not None:
            low, high = self._range(key, wanted, draw)
            if not low <= value <= high:
                low, high = int(np.ceil(low)), int(np.floor(high))
                if low > high:
                    raise UnmetError(key, draw)
                value = low + (value - least) % (high - low + 1)
        return int(self._keep(key, Draw(value, "integer", least, most)))

    def chance(self, name: str, share: float, *, upper: bool = False) -> bool:
        """True with the chance ``share``: a flat number from 0 to 1 is below it, or, ``upper``, above the rest."""
        value = bool(self.rng.random() >= 1.0 - share if upper else self.rng.random() < share)
        key, wanted = self._asked(name)
        draw = Draw(value, "yes or no", high=share)
        asked = _yes_or_no(wanted)
        if isinstance(wanted, (str, frozenset)) or (asked is not None and share == float(not asked)):
            if not self._trace.lenient:
                raise UnmetError(key, draw)
        elif asked is not None:
            draw = replace(draw, value=asked)
        return bool(self._keep(key, draw))

    def pick(self, name: str, options: Mapping[Choice, float] | Sequence[Choice]) -> Choice:
        """One of several options, each with its chance, or all equally likely: ``{"bar": 0.6, "none": 0.4}``."""
        chances = list(options.values()) if isinstance(options, Mapping) else None
        every = list(options)
        chosen = every[int(self.rng.choice(len(every), p=chances))]
        key, wanted = self._asked(name)
        names = tuple(_text(option) for option in every)
        if wanted is not None and not _names(wanted, _text(chosen)):
            open_to = [o for k, o in enumerate(every) if chances is None or chances[k] > 0]
            fitting = [option for option in open_to if _names(wanted, _text(option))]
            countable = isinstance(wanted, tuple) and not any(is_number(option) for option in names)
            if not fitting and not self._trace.lenient and not countable:
                raise UnmetError(key, Draw(_text(chosen), "choice", options=names))
            if fitting:
                chosen = fitting[every.index(chosen) % len(fitting)]
        self._keep(key, Draw(_text(chosen), "choice", options=names))
        return chosen

    def one_of(self, name: str, options: Mapping[Any, Choice], chances: Sequence[float] | None = None) -> Choice:
        """What one of several names stands for: :meth:`pick` among the names, each with its chance."""
        return options[self.pick(name, dict(zip(options, chances, strict=True)) if chances else list(options))]

    def side(self, name: str) -> float:
        """1.0 for the left or -1.0 for the right of someone who looks at the front: a sign of Y."""
        return self.one_of(name, {"right": -1.0, "left": 1.0})

    def seed(self, name: str) -> int:
        """A seed for :meth:`fork`."""
        value = int(self.rng.integers(_SEEDS))
        key, wanted = self._asked(name, each=False)
        return int(self._keep(key, Draw(value if wanted is None else int(wanted), "seed", 0, _SEEDS - 1)))  # type: ignore[arg-type]

    def _asked(self, name: str, each: bool = True) -> tuple[str, Wanted | None]:
        """The draw's full name, and what is asked for: by this name, or, ``each``, by the name without its number."""
        first = key = self._prefix + name
        count = self._trace.counts.get(key, 0) + 1
        self._trace.counts[key] = count
        if count > 1:
            key = f"{key}_{count}"
        for asked in (key, key_of(key), *((first, key_of(first)) if each else ())) if self._trace.wanted else ():
            if asked in self._trace.wanted:
                return key, self._trace.wanted[asked]
        return key, None

    def _keep(self, key: str, draw: Draw) -> Value:
        self._trace.drawn[key] = draw
        return draw.value

    def _range(self, key: str, wanted: Wanted, draw: Draw) -> Interval:
        """The part of a draw's range that is asked for."""
        if isinstance(wanted, (str, frozenset)):
            if self._trace.lenient:
                return draw.low, draw.high
            raise UnmetError(key, draw)
        low, high = wanted if isinstance(wanted, tuple) else (wanted, wanted)
        if self._trace.lenient:
            low, high = (min(max(end, draw.low), draw.high) for end in (low, high))
        low, high = max(low, draw.low), min(high, draw.high)
        if low > high:
            raise UnmetError(key, draw)
        return low, high

    def _number(self, name: str, value: float, ends: Interval, unit: str) -> float:
        key, wanted = self._asked(name)
        if wanted is not None:
            low, high = self._range(key, wanted, Draw(value, "number", *ends, unit))
            if not low <= value <= high:
                share = (value - ends[0]) / (ends[1] - ends[0]) if ends[1] > ends[0] else 0.0
                value = low if low == high else low + share * (high - low)
        return float(self._keep(key, Draw(value, "number", *ends, unit)))


def key_of(name: str) -> str:
    """The name under which a value is asked for: that of the draw in the singular, so that ``doors`` is ``door``."""
    return name.removesuffix("s") if not name.endswith("ss") else name


def values_of(drawn: Mapping[str, Draw]) -> dict[str, Value]:
    """The values of draws, by name."""
    return {name: draw.value for name, draw in drawn.items()}


def _yes_or_no(wanted: Wanted | None) -> bool | None:
    """The answer that is asked for: a number of parts may be asked of a draw that says whether there is one."""
    low, high = wanted if isinstance(wanted, tuple) else (wanted, wanted)
    if not isinstance(low, (bool, int, float)) or not isinstance(high, (bool, int, float)) or (low <= 0 and high >= 1):
        return None
    return True if low <= 1 <= high else False if low <= 0 <= high else None


def _text(option: object) -> str:
    """An option as text; that of a function is its name."""
    if isinstance(option, float):
        return f"{option:g}"
    name = getattr(option, "__name__", None)
    return str(name if name is not None else option)


def _names(wanted: Wanted, option: str) -> bool:
    """Whether what is asked for is this option, as text."""
    if isinstance(wanted, (frozenset, set)):
        return option in wanted
    if isinstance(wanted, tuple):
        return is_number(option) and wanted[0] <= float(option) <= wanted[1]
    return option == _text(wanted)


def ranges(traces: Iterable[Mapping[str, Draw]]) -> dict[str, Draw]:
    """Of every draw in several traces: the widest range and all options, with the last value."""
    found: dict[str, Draw] = {}
    for trace in traces:
        for name, draw in trace.items():
            before = found.get(name, draw)
            options = tuple(dict.fromkeys(before.options + draw.options))
            low, high = min(before.low, draw.low), max(before.high, draw.high)
            found[name] = Draw(draw.value, draw.kind, low, high, draw.unit, options)
    return found
