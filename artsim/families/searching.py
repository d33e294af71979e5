"""The search for an object that meets constraints: draws of a category are planned until one does, and none is built.

A plan that misses a number of parts, handles or legs is planned again with another count or choice of a fitting name;
one that misses a length, with other lengths. Only then is another one drawn.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from itertools import islice

from artsim.common.elementary import exp, log
from artsim.families.constraints import AXES, LENGTHS, Constraints, measured, measured_length, meets
from artsim.making.assembly import Assembly
from artsim.making.draws import Draw, Draws, UnmetError, Wanted, key_of
from artsim.model.params import Value

Plan = Callable[[int, Mapping[str, Wanted]], tuple[Assembly, Draws]]
"""What a category's draw of a number is, with some values that are asked for."""
Found = tuple[Assembly, Draws]

_CHANGED, _RESIZED = 4, 5
"""Times that one draw is planned again: with other counts and choices, and with other lengths."""
_OVERALL = ("length", "diameter", "scale", "key_pitch", "width")
"""Parameters that others are shares of."""
_LARGEST, _PART = 2, 0.2
"""Parameters without a fitting name that are tried, the longest of all; and the least share of a length that one is."""
_VAIN = 3
"""Draws in which a parameter changes nothing until it is left alone."""
_NEAR = 0.03
"""What is left of a length's logarithm for the next step."""


class Search:
    """Draws of one category and seed, one after the other, and what they taught."""

    def __init__(self, plan: Plan, constraints: Constraints) -> None:
        self.plan, self.constraints = plan, constraints
        self.reached: list[Assembly] = []
        """Plans that do not meet the constraints."""
        self.seen: list[Mapping[str, Draw]] = []
        """Their draws, and those that what is asked for lies outside of."""
        self.outside: set[str] = set()
        """Names of the latter."""
        self._vain: Counter[tuple[str, str]] = Counter()

    def at(self, draw: int) -> Found | None:
        """The plan of a draw that meets the constraints, if it comes to that."""
        planned = self._planned(draw)
        if planned is None:
            return None
        made, draws = planned
        self.reached.append(made)
        self.seen.append(draws.drawn)
        changed = self._changed(draw, made, draws)
        return None if changed is None else self._resized(draw, *changed)

    def _planned(self, draw: int) -> Found | None:
        try:
            return self.plan(draw, self.constraints.of_draws)
        except UnmetError as problem:
            self.seen.append({problem.name: problem.draw})
            self.outside.add(key_of(problem.name))
        return None

    def _unmet(self, made: Assembly, draws: Draws) -> list[str]:
        """Lengths left out: they cost the most to know."""
        return self.constraints.without(LENGTHS).unmet_by(made, draws.drawn)

    def _changed(self, draw: int, made: Assembly, draws: Draws) -> tuple[Assembly, Draws, dict[str, Wanted]] | None:
        """With another count or choice where it has to be."""
        missing, asked = self._unmet(made, draws), dict[str, Wanted](self.constraints.of_draws)
        if not missing:
            return made, draws, asked
        if len(missing) > 1:
            return None
        for name, value in islice(self._changes(missing[0], made, draws), _CHANGED):
            try:
                again = self.plan(draw, {**asked, name: value})
            except UnmetError:
                continue
            if not self._unmet(*again):
                return (*again, {**asked, name: value})
            same = measured(again[0], missing[0]) == measured(made, missing[0])
            self._vain[missing[0], name] += _VAIN if same else 1
        return None

    def _changes(self, missing: str, made: Assembly, draws: Draws) -> Iterator[tuple[str, Value]]:
        """Values of parameters that may bring what is missing, those whose names speak of it first."""
        word, wanted = key_of(missing), dict(self.constraints.wanted)[missing]
        free = [(n, d) for n, d in self._free(draws).items() if self._vain[missing, n] < _VAIN]

        def strange(name: str) -> tuple[bool, bool]:
            return f"_{word}" not in f"_{name}", key_of(name) not in made.labels

        for name, one in sorted(free, key=lambda pair: strange(pair[0])):
            if one.kind == "integer" and isinstance(wanted, tuple):
                now = float(measured(made, missing))  # type: ignore[arg-type]
                value = round(float(one.value) + min(max(now, wanted[0]), wanted[1]) - now)
                if one.low <= value <= one.high:
                    yield name, value
            elif f"_{word}" not in f"_{name}":
                continue
            elif one.kind == "yes or no":
                yield name, not one.value
            elif one.kind == "choice":
                yield from ((name, option) for option in one.options if option != one.value)

    def _free(self, draws: Draws) -> dict[str, Draw]:
        """Draws that nothing is asked of."""
        asked = self.constraints.of_draws
        return {name: one for name, one in draws.drawn.items() if name not in asked and key_of(name) not in asked}

    def _resized(self, draw: int, made: Assembly, draws: Draws, asked: Mapping[str, Wanted]) -> Found | None:
        """With other lengths among its parameters, so that its box at rest has those that are asked for."""
        wanted = [(n, ends) for n, ends in self.constraints.wanted if n in LENGTHS and isinstance(ends, tuple)]
        lengths: dict[str, Wanted] = {}
        steep = dict.fromkeys(LENGTHS, 1.0)
        vain: set[str] = set()
        steps: dict[str, tuple[float, list[str], float]] = {}
        for step in range(_RESIZED + 1):
            now = {name: measured_length(made, name) for name, _ in wanted}
            for name, (before, moved, meant) in steps.items():
                share = float(log(now[name] / before)) / meant
                if len(moved) == 1 and steep[name] * share < 0.1:
                    vain.add(moved[0])
                    lengths.pop(moved[0], None)
                    self._vain[name, moved[0]] += 1
                    share = 1.0 / steep[name]
                steep[name] = min(max(steep[name] * share, 0.3), 3.0)
            missing = [(name, ends) for name, ends in wanted if not meets(now[name], name, ends)]
            if not missing:
                return made, draws
            if step == _RESIZED:
                break
            steps = {}
            for name, (low, high) in missing:
                if high > 1.04 * low:  # a length at the very end of a range may lie beyond it once it is rounded
                    low, high = 1.02 * low, 0.98 * high
                far = float(log(min(max(now[name], low), high) / now[name]))
                moved, meant = self._move(name, now[name], far, steep[name], draws, lengths, vain)
                if not moved:
                    return None
                steps[name] = now[name], moved, meant
            try:
                made, draws = self.plan(draw, {**asked, **lengths})
            except UnmetError:
                break
            if self._unmet(made, draws):
                break
        return None

    def _move(
        self, name: str, now: float, far: float, steep: float, draws: Draws, lengths: dict[str, Wanted], vain: set[str]
    ) -> tuple[list[str], float]:
        """Change ``lengths`` so that a length's logarithm moves by ``far``: which parameters, and how far it comes.

        None where their ranges end long before. ``steep`` is what a parameter's logarithm does to the length's.
        """
        numbers = {n: (d, float(d.value)) for n, d in self._free(draws).items() if d.kind == "number" and d.low >= 0}
        long = [n for n, (d, value) in numbers.items() if d.unit == "m" and value > _PART * now]
        largest = sorted(long, key=lambda n: -numbers[n][1])[:_LARGEST]
        moved: list[str] = []
        left: dict[str, float] = {}
        for side in AXES if name == "size" else (name,):
            left[side] = far
            for one in dict.fromkeys((side, *_OVERALL, *(n for n in long if n.endswith(f"_{side}")), *largest)):
                if one in moved:  # by another side: it moves all
                    left[side] = min(left.values(), key=abs)
                if one in moved or abs(left[side]) < _NEAR:
                    break
                d, value = numbers.get(one, (_NONE, 0.0))
                if (
                    value <= 0
                    or (d.unit != "m" and one not in (side, "scale"))
                    or one in vain
                    or self._vain[name, one] >= _VAIN
                ):
                    continue
                new = min(max(value * float(exp(left[side] / steep)), d.low), d.high)
                if new > 0 and abs(new / value - 1.0) > 1e-6:
                    lengths[one] = new
                    moved.append(one)
                    left[side] -= steep * float(log(new / value))
        if not moved or min(map(abs, left.values())) > max(2.0 * _NEAR, 0.3 * abs(far) if name == "size" else 0.0):
            return [], 0.0
        return moved, far - sum(left.values()) / len(left)


_NONE = Draw(0.0, "number")
