"""Procedural objects: one file for each category, one line in the registry.

A family is a function ``build(rng) -> Assembly`` that draws a new, plausible object from an explicit generator. It
draws proportions, details and the shape of the kinematic tree, in metres, with Z up and the front towards -X, and
leaves a gap between parts in every joint state. ``CONTRIBUTING.md`` shows how to add one.
"""

import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from importlib import import_module

import numpy as np

from artsim.errors import ConfigError
from artsim.families.constraints import Constraints, Given
from artsim.making.assembly import Assembly, Rng
from artsim.model.objects import ArticulatedObject

Family = Callable[[Rng], Assembly]

CATEGORIES = (
    "bottle",
    "box",
    "bucket",
    "camera",
    "cart",
    "chair",
    "clock",
    "coffee_machine",
    "cutter",
    "dishwasher",
    "dispenser",
    "display",
    "door",
    "drawer",
    "eyeglasses",
    "fan",
    "faucet",
    "folding_chair",
    "folding_knife",
    "globe",
    "kettle",
    "keyboard",
    "kitchen_pot",
    "lamp",
    "laptop",
    "lighter",
    "microwave",
    "mouse",
    "oven",
    "pen",
    "phone",
    "pliers",
    "printer",
    "random_tree",
    "refrigerator",
    "remote",
    "robot_arm",
    "safe",
    "scissors",
    "stapler",
    "storage_furniture",
    "suitcase",
    "switch",
    "table",
    "toaster",
    "toilet",
    "trash_can",
    "usb",
    "valve",
    "washing_machine",
    "window",
)
"""The registry: each category's name is that of its module."""


class _Registry(Mapping[str, Family]):
    """Families by category; the module of one is imported when it is first asked for."""

    def __getitem__(self, category: str) -> Family:
        if category not in self:
            raise KeyError(category)
        family: Family = import_module(f"artsim.families.{category}").build
        return family

    def __contains__(self, category: object) -> bool:
        return category in CATEGORIES

    def __iter__(self) -> Iterator[str]:
        return iter(CATEGORIES)

    def __len__(self) -> int:
        return len(CATEGORIES)


FAMILIES: Mapping[str, Family] = _Registry()
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
"""Objects that are drawn at most until one meets the constraints: what one in a hundred has is found 19 times of 20."""


def make(category: str, seed: int = 0, **constraints: Given) -> ArticulatedObject:
    """A new procedural object: the same for the same category, seed and constraints, different for every other seed.

    Without constraints, the object that the seed stands for. With some, that object if it meets them; else the first
    that does of others, which depend on the category and the seed alone.

    Parameters
    ----------
    category : str
        A key of ``FAMILIES``.
    seed : int
        Not negative.
    **constraints
        A number, or a range (least, greatest) in which None leaves an end open:

        - ``joints``: how many joints; ``joint_types``: exactly which types, such as ``{"revolute"}``;
        - ``size`` (the diagonal), ``height``, ``width``, ``depth``: metres at rest; a single number is met within 5 %;
        - ``handles``, ``legs``: True or False;
        - any kind of moving part: ``doors=2``, ``drawers=(1, 3)``, ``buttons=0``.

    Returns
    -------
    ArticulatedObject
        In its rest state at q = 0, metric, with collision geometry and densities in ``parts[k].body``.

    Raises
    ------
    ConfigError
        When there is no such category, the seed is negative, a constraint makes no sense, or no object of ``DRAWS``
        that are drawn meets the constraints: the error tells what values are drawn.

    Examples
    --------
    >>> artsim.make("storage_furniture", 7, doors=2, drawers=(1, 3), handles=False)
    """
    return make_constrained(category, seed, Constraints.of(constraints))


def make_constrained(category: str, seed: int, constraints: Constraints) -> ArticulatedObject:
    """The object that :func:`make` makes under constraints; see there."""
    if category not in FAMILIES:
        raise ConfigError(f"there is no category {category!r}", fix=f"use one of {', '.join(sorted(FAMILIES))}")
    if seed < 0:
        raise ConfigError(f"seed {seed} is negative", fix="use 0 or more")
    drawn = []
    for draw in range(DRAWS):
        drawn.append(FAMILIES[category](_generator(category, seed, draw)).build(category, str(seed)))
        if constraints.met_by(drawn[-1]):
            return replace(drawn[-1], source=source_name(category, seed, constraints))
    raise constraints.refusal(category, drawn)


def assembly_of(category: str, seed: int) -> Assembly:
    """Parts and joints of the object of a seed before its solids are united, which takes most of the time."""
    return FAMILIES[category](_generator(category, seed, 0))


def source_name(category: str, seed: int, constraints: Constraints) -> str:
    """What names an object among all procedural ones: ``laptop:3``, ``drawer[drawer=2..4]:3``."""
    return f"{category}[{constraints}]:{seed}" if constraints else f"{category}:{seed}"


def _generator(category: str, seed: int, draw: int) -> Rng:
    """Of a draw for a seed; the first is that of the seed's own object."""
    own = zlib.crc32(category.encode())
    return np.random.default_rng([own, seed] if draw == 0 else [own, _FURTHER, draw, seed])


_FURTHER = zlib.crc32(b"further draws")
"""Keeps the generators of further draws apart from those of seeds."""
