"""What each procedural category is: its family's own words, and what its first objects are like."""

import inspect
from collections import Counter
from collections.abc import Sequence
from importlib import import_module
from textwrap import wrap

from artsim.common.names import name_fix
from artsim.errors import ConfigError
from artsim.families import FAMILIES, draws_of
from artsim.families.constraints import FEATURES, LENGTHS, described, measured, measured_length
from artsim.making.assembly import Assembly
from artsim.making.draws import Draws, ranges

_WIDTH = 120


def parameters(category: str) -> str:
    """What a category is, and what varies, as its family says.

    Raises
    ------
    ConfigError
        When there is no such category.
    """
    if category not in FAMILIES:
        raise ConfigError(f"there is no category {category!r}", fix=name_fix(category, sorted(FAMILIES)))
    return inspect.cleandoc(import_module(f"artsim.families.{category}").__doc__ or "")


def describe_family(category: str, count: int = 20) -> str:
    """Several lines: what varies, and what is seen over the first ``count`` seeds of a category.

    Raises
    ------
    ConfigError
        When there is no such category, or nothing to look at.
    """
    if count < 1:
        raise ConfigError(f"{count} is not a count", "objects", "use 1 or more")
    text = parameters(category)
    traces, made = seen_of(category, count)
    types = Counter(kind for assembly in made for kind in set(assembly.joint_types[1:]))
    kinds = sorted({label for assembly in made for label in assembly.labels[1:]})
    moving = [f"{kind} {_range([assembly.labels[1:].count(kind) for assembly in made])}" for kind in kinds]
    lines = [
        ("parts", _range([len(assembly) for assembly in made])),
        ("joint types", ", ".join(f"{kind} ({number})" for kind, number in sorted(types.items()))),
        ("moving parts", ", ".join(moving)),
    ]
    for name in LENGTHS:
        values = [measured_length(assembly, name) for assembly in made]
        lines.append((name, f"{min(values):.3g} to {max(values):.3g} m"))
    lines += [(name, f"{sum(bool(measured(assembly, name)) for assembly in made)} have some") for name in FEATURES]
    return "\n".join([category, text, "", f"  of {count} objects:", *_rows(lines), "",
                      f"  parameters, as {count} objects draw them:", *_rows(_parameters(traces)), ""])  # fmt: skip


def _parameters(traces: Sequence[Draws]) -> list[tuple[str, str]]:
    """What draws may give, by name; draws of one name that are numbered are told as one."""
    first = {name for trace in traces for name in trace.drawn}

    def base(name: str) -> str:
        stem, _, number = name.rpartition("_")
        return stem if number.isdigit() and stem in first else name

    seen = Counter(name for trace in traces for name in {base(name) for name in trace.drawn})
    drawn = ranges({base(name): draw} for trace in traces for name, draw in trace.drawn.items())
    alike = Counter(base(name) for name in first)
    told = []
    for name, draw in drawn.items():
        notes = [f"{seen[name]} have it"] if seen[name] < len(traces) else []
        notes += [f"and {alike[name] - 1} more alike"] if alike[name] > 1 else []
        if draw.kind != "seed":
            told.append((name, described(draw) + (f" ({', '.join(notes)})" if notes else "")))
    return told


def seen_of(category: str, count: int) -> tuple[list[Draws], list[Assembly]]:
    """Draws and plans of the first objects of a category."""
    traces = [draws_of(category, seed) for seed in range(count)]
    return traces, [FAMILIES[category](draws) for draws in traces]


def _rows(pairs: list[tuple[str, str]]) -> list[str]:
    """Lines of a name and what it says, one below the other, none wider than ``_WIDTH``."""
    wide = max((len(name) for name, _ in pairs), default=0)
    indent = " " * (wide + 3)
    lines = (wrap(f"  {name:{wide}s} {value}", _WIDTH, subsequent_indent=indent) for name, value in pairs)
    return [line for several in lines for line in several]


def _range(numbers: list[int]) -> str:
    low, high = min(numbers), max(numbers)
    return str(low) if low == high else f"{low} to {high}"
