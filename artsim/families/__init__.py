"""Procedural objects: one file for each category, one line in the registry.

A family is a function ``build(draws) -> Assembly`` that draws a new, plausible object: each number and choice by name.
It draws proportions, details and the shape of the kinematic tree, in metres, with Z up and the front towards -X, and
leaves a gap between parts in every joint state. ``CONTRIBUTING.md`` shows how to add one.
"""

import zlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from importlib import import_module

import numpy as np

from artsim.common.names import name_fix
from artsim.errors import AssetError, ConfigError
from artsim.families.constraints import Constraints, Given
from artsim.families.physical import with_physics
from artsim.families.searching import Search
from artsim.making.assembly import Assembly
from artsim.making.draws import Draws, UnmetError, Wanted, ranges, values_of
from artsim.model.objects import ArticulatedObject
from artsim.model.params import Params, Value

Family = Callable[[Draws], Assembly]

CATEGORIES = (
    "bottle", "box", "bucket", "camera", "cart", "chair", "clock", "coffee_machine", "cutter", "dishwasher",
    "dispenser", "display", "door", "drawer", "eyeglasses", "fan", "faucet", "folding_chair", "folding_knife", "globe",
    "kettle", "keyboard", "kitchen_pot", "lamp", "laptop", "lighter", "microwave", "mouse", "oven", "pen", "phone",
    "pliers", "printer", "random_tree", "refrigerator", "remote", "robot_arm", "safe", "scissors", "stapler",
    "storage_furniture", "suitcase", "switch", "table", "toaster", "toilet", "trash_can", "usb", "valve",
    "washing_machine", "window",
)  # fmt: skip
"""The registry: each category's name is that of its module."""


def _family(category: str) -> Family:
    """A category's ``build``; its module is imported when it is first called."""
    return lambda draws: import_module(f"artsim.families.{category}").build(draws)


FAMILIES: Mapping[str, Family] = {category: _family(category) for category in CATEGORIES}
"""Every category that :func:`make` knows."""

_NAMED_OTHERWISE = ("cutter", "drawer", "folding_knife", "random_tree", "robot_arm", "usb", "valve")
PARTNET_MOBILITY: dict[str, tuple[str, ...]] = {
    **{name.title().replace("_", ""): (name,) for name in CATEGORIES if name not in _NAMED_OTHERWISE},
    "Knife": ("cutter", "folding_knife"),
    "StorageFurniture": ("storage_furniture", "drawer"),
    "Table": ("table", "drawer"),
    "USB": ("usb",),
}
"""The families that stand for each category of PartNet-Mobility, the nearest first."""

DRAWS = 300
"""Draws at most until one meets the constraints: what one in a hundred has is found 19 times of 20."""


def make(category: str | Params, seed: int = 0, **constraints: Given) -> ArticulatedObject:
    """A new procedural object: the same for the same category, seed and constraints, different for every other seed.

    Without constraints, the object that the seed stands for. With some, that object as far as it meets them: a
    parameter that is asked for takes the place of the one that is drawn. Where that is not enough, others are drawn,
    which depend on the category and the seed alone. Whatever is asked, one object is built.

    Parameters
    ----------
    category : str or Params
        A key of ``FAMILIES``; or the parameters of an object (``obj.params``), which is made again.
    seed : int
        Not negative.
    **constraints
        A number, or a range (least, greatest) in which None leaves an end open:

        - ``joints``: how many joints; ``joint_types``: exactly which types, such as ``{"revolute"}``;
        - ``size`` (the diagonal), ``height``, ``width``, ``depth``: metres at rest; a single number is met within 5 %;
        - ``handles``, ``legs``: True or False;
        - any kind of moving part: ``doors=2``, ``drawers=(1, 3)``, ``buttons=0``;
        - any other parameter of the family: a number, a range, True or False, an option or a set of options.
          ``artsim families NAME`` lists them.

    Returns
    -------
    ArticulatedObject
        In its rest state at q = 0, metric, with collision geometry and densities in ``parts[k].body``, and all that was
        drawn in ``params``.

    Raises
    ------
    ConfigError
        When there is no such category, the seed is negative, a constraint makes no sense, or no object of ``DRAWS``
        that are drawn meets the constraints: the error tells what values are drawn.

    Examples
    --------
    >>> artsim.make("storage_furniture", 7, doors=2, drawers=(1, 3), handles=False)
    """
    if isinstance(category, Params):
        return _made_again(category, seed, constraints)
    return make_constrained(category, seed, Constraints.of(constraints))


def make_constrained(category: str, seed: int, constraints: Constraints) -> ArticulatedObject:
    """The object that :func:`make` makes under constraints; see there."""
    _check(category, seed)

    def plan(draw: int, wanted: Mapping[str, Wanted]) -> tuple[Assembly, Draws]:
        draws = Draws(_generator(category, seed, draw), wanted)
        return FAMILIES[category](draws), draws

    search = Search(plan, constraints)
    for draw in range(DRAWS):
        found = search.at(draw)
        if found is not None:
            made, draws = found
            params = Params(category, seed, draw, values_of(draws.drawn))
            source = source_name(category, seed, constraints)
            return replace(with_physics(made.build(category, str(seed))), source=source, params=params)
    raise constraints.refusal(category, search.reached, ranges(search.seen), search.outside)


def _made_again(params: Params, seed: int, constraints: Mapping[str, Given]) -> ArticulatedObject:
    if seed or constraints:
        raise ConfigError("parameters say all of an object", "artsim.make", "change them: params.having(width=0.5)")
    _check(params.category, params.seed, params.draw)
    draws = Draws(_generator(params.category, params.seed, params.draw), params.values, lenient=True)
    try:
        made = FAMILIES[params.category](draws).build(params.category, str(params.seed))
    except UnmetError as problem:
        what = f"its parameters do not fit each other ({problem.name})"
        raise AssetError(what, f"{params.category} {params.seed}", "change fewer of them") from problem
    source = f"parameters of {params.category}:{params.seed}"
    return replace(with_physics(made), source=source, params=replace(params, values=values_of(draws.drawn)))


def varied(params: Params, rng: np.random.Generator, strength: float) -> Params:
    """Parameters near others: numbers move by ``strength`` of their ranges or so, choices change as seldom."""
    draws = Draws(_generator(params.category, params.seed, params.draw), params.values, lenient=True)
    FAMILIES[params.category](draws)
    values: dict[str, Value] = {}
    for name, draw in draws.drawn.items():
        value, far, other = draw.value, strength * float(rng.standard_normal()), rng.random() < _OTHER * strength
        if draw.kind == "number":
            value = min(max(float(value) + far * (draw.high - draw.low), draw.low), draw.high)
        elif draw.kind == "choice" and other:
            value = draw.options[rng.integers(len(draw.options))]
        elif draw.kind == "yes or no" and other:
            value = not value
        elif draw.kind in ("integer", "seed") and other:
            value = int(rng.integers(int(draw.low), int(draw.high) + 1))
        values[name] = value
    return replace(params, values=values)


_OTHER = 0.3
"""Chance that a choice, a count or a seed of details is drawn again, at strength 1."""


def _check(category: str, seed: int, draw: int = 0) -> None:
    if category not in FAMILIES:
        raise ConfigError(f"there is no category {category!r}", fix=name_fix(category, sorted(FAMILIES)))
    if min(seed, draw) < 0:
        raise ConfigError(f"seed {min(seed, draw)} is negative", fix="use 0 or more")


def assembly_of(category: str, seed: int) -> Assembly:
    """Parts and joints of the object of a seed before its solids are made, which takes most of the time."""
    return FAMILIES[category](draws_of(category, seed))


def draws_of(category: str, seed: int) -> Draws:
    """What the object of a seed is drawn from, before anything is drawn."""
    return Draws(_generator(category, seed, 0))


def source_name(category: str, seed: int, constraints: Constraints) -> str:
    """What names an object among all procedural ones: ``laptop:3``, ``drawer[drawer=2..4]:3``."""
    return f"{category}[{constraints}]:{seed}" if constraints else f"{category}:{seed}"


def _generator(category: str, seed: int, draw: int) -> np.random.Generator:
    """Of a draw for a seed; the first is that of the seed's own object."""
    own = zlib.crc32(category.encode())
    return np.random.default_rng([own, seed] if draw == 0 else [own, _FURTHER, draw, seed])


_FURTHER = zlib.crc32(b"further draws")
"""Keeps the generators of further draws apart from those of seeds."""
