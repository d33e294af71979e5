"""Procedural objects: one file for each category, one line in the registry.

A family is a function ``build(rng) -> Assembly`` that draws a new, plausible object from an explicit generator. It
draws proportions, details and the shape of the kinematic tree, in metres, with Z up and the front towards -X, and
leaves a gap between parts in every joint state. ``README.md`` shows how to add one.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable

import numpy as np

from artsim.assembly import Assembly
from artsim.errors import ConfigError
from artsim.families import (
    box,
    bucket,
    coffee_machine,
    cutter,
    desk_lamp,
    dishwasher,
    door,
    drawer,
    eyeglasses,
    fan,
    faucet,
    folding_knife,
    globe,
    kitchen_pot,
    laptop,
    microwave,
    oven,
    pliers,
    random_tree,
    refrigerator,
    robot_arm,
    safe,
    scissors,
    stapler,
    storage_furniture,
    suitcase,
    switch,
    swivel_chair,
    toaster,
    trash_can,
    valve,
    washing_machine,
    window,
)
from artsim.objects import ArticulatedObject

Family = Callable[[np.random.Generator], Assembly]

FAMILIES: dict[str, Family] = {
    "box": box.build,
    "bucket": bucket.build,
    "coffee_machine": coffee_machine.build,
    "cutter": cutter.build,
    "desk_lamp": desk_lamp.build,
    "dishwasher": dishwasher.build,
    "door": door.build,
    "drawer": drawer.build,
    "eyeglasses": eyeglasses.build,
    "fan": fan.build,
    "faucet": faucet.build,
    "folding_knife": folding_knife.build,
    "globe": globe.build,
    "kitchen_pot": kitchen_pot.build,
    "laptop": laptop.build,
    "microwave": microwave.build,
    "oven": oven.build,
    "pliers": pliers.build,
    "random_tree": random_tree.build,
    "refrigerator": refrigerator.build,
    "robot_arm": robot_arm.build,
    "safe": safe.build,
    "scissors": scissors.build,
    "stapler": stapler.build,
    "storage_furniture": storage_furniture.build,
    "suitcase": suitcase.build,
    "switch": switch.build,
    "swivel_chair": swivel_chair.build,
    "toaster": toaster.build,
    "trash_can": trash_can.build,
    "valve": valve.build,
    "washing_machine": washing_machine.build,
    "window": window.build,
}
"""Every category that :func:`make` knows."""


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
        raise ConfigError(f"there is no category {category!r}", mend=f"use one of {', '.join(sorted(FAMILIES))}")
    if seed < 0:
        raise ConfigError(f"seed {seed} is negative", mend="use 0 or more")
    rng = np.random.default_rng([zlib.crc32(category.encode()), seed])
    return FAMILIES[category](rng).build(category, str(seed))
