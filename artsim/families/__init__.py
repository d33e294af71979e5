"""Procedural objects: one file for each category, one line in the registry.

A family is a function ``build(rng) -> Assembly`` that draws a new, plausible object from an explicit generator. It
draws proportions, details and the shape of the kinematic tree, in metres, with Z up and the front towards -X, and
leaves a gap between parts in every joint state. ``CONTRIBUTING.md`` shows how to add one.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from importlib import import_module

import numpy as np

from artsim.errors import ConfigError
from artsim.making.assembly import Assembly
from artsim.model.objects import ArticulatedObject

Family = Callable[[np.random.Generator], Assembly]

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

FAMILIES: dict[str, Family] = {name: import_module(f"artsim.families.{name}").build for name in CATEGORIES}
"""Every category that :func:`make` knows."""


PARTNET_MOBILITY: dict[str, tuple[str, ...]] = {
    "Bottle": ("bottle",),
    "Box": ("box",),
    "Bucket": ("bucket",),
    "Camera": ("camera",),
    "Cart": ("cart",),
    "Chair": ("chair",),
    "Clock": ("clock",),
    "CoffeeMachine": ("coffee_machine",),
    "Dishwasher": ("dishwasher",),
    "Dispenser": ("dispenser",),
    "Display": ("display",),
    "Door": ("door",),
    "Eyeglasses": ("eyeglasses",),
    "Fan": ("fan",),
    "Faucet": ("faucet",),
    "FoldingChair": ("folding_chair",),
    "Globe": ("globe",),
    "Kettle": ("kettle",),
    "Keyboard": ("keyboard",),
    "KitchenPot": ("kitchen_pot",),
    "Knife": ("cutter", "folding_knife"),
    "Lamp": ("lamp",),
    "Laptop": ("laptop",),
    "Lighter": ("lighter",),
    "Microwave": ("microwave",),
    "Mouse": ("mouse",),
    "Oven": ("oven",),
    "Pen": ("pen",),
    "Phone": ("phone",),
    "Pliers": ("pliers",),
    "Printer": ("printer",),
    "Refrigerator": ("refrigerator",),
    "Remote": ("remote",),
    "Safe": ("safe",),
    "Scissors": ("scissors",),
    "Stapler": ("stapler",),
    "StorageFurniture": ("storage_furniture", "drawer"),
    "Suitcase": ("suitcase",),
    "Switch": ("switch",),
    "Table": ("table", "drawer"),
    "Toaster": ("toaster",),
    "Toilet": ("toilet",),
    "TrashCan": ("trash_can",),
    "USB": ("usb",),
    "WashingMachine": ("washing_machine",),
    "Window": ("window",),
}
"""The families that stand for each category of PartNet-Mobility, the nearest first."""


def make(category: str, seed: int = 0) -> ArticulatedObject:
    """A new procedural object: the same for the same category and seed, different for every other seed.

    Parameters
    ----------
    category : str
        A key of ``FAMILIES``.
    seed : int
        Not negative.

    Returns
    -------
    ArticulatedObject
        In its rest state at q = 0, metric, with collision geometry and densities in ``parts[k].body``.

    Raises
    ------
    ConfigError
        When there is no such category, or the seed is negative.
    """
    if category not in FAMILIES:
        raise ConfigError(f"there is no category {category!r}", fix=f"use one of {', '.join(sorted(FAMILIES))}")
    if seed < 0:
        raise ConfigError(f"seed {seed} is negative", fix="use 0 or more")
    rng = np.random.default_rng([zlib.crc32(category.encode()), seed])
    return FAMILIES[category](rng).build(category, str(seed))
