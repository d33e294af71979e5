"""Which objects of a category an estimator is for.

Procedural families vary the parts, too: a `drawer` has one to seven drawers, a `dishwasher` may have racks and buttons.
ArtImage and ReArtMix, which the paper reports, have a fixed kinematic structure in each category (Xue et al. 2021, Liu
et al. 2022).
"""

from collections.abc import Iterator, Sequence
from itertools import count, islice
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from artperl.core.part_order import sort_parts
from artsim.errors import AssetError, ConfigError
from artsim.loading.sources import FamilySource, family_sources
from artsim.model.objects import MAX_PARTS, ArticulatedObject

ARTIMAGE: dict[str, tuple[str, ...]] = {
    "laptop": ("revolute",),
    "eyeglasses": ("revolute", "revolute"),
    "dishwasher": ("revolute",),
    "scissors": ("revolute",),
    "drawer": ("prismatic", "prismatic", "prismatic"),
}
"""Joints of the moving parts of each category of ArtImage."""

JOINTS: dict[str, tuple[str, ...]] = {
    **ARTIMAGE,
    "box": ("revolute",),
    "stapler": ("revolute",),
    "cutter": ("prismatic",),
}
"""The same of ArtImage and of ReArtMix (Liu et al. 2022). Drawers of ReArtMix have one sliding part, or three."""

Parts = Literal["artimage", "any"]
"""artimage: objects with the joints that their category has in :data:`JOINTS` (any, for other categories), whose
drawers open to the front; any: all, with their parts in the order in which they are seen."""

_ATTEMPTS = 200
_BACKWARDS = 0.5
"""Sum of drawers' directions along x from which a table has its drawers at the back."""


def has_parts(category: str, joint_types: Sequence[str], joint_axes: ArrayLike, parts: Parts = "artimage") -> bool:
    """Whether an object with these joints, the root's among them, is one to learn from and to be tested on.

    Parameters
    ----------
    category : str
    joint_types : sequence of str
    joint_axes : (K, 3) float
        Rest frame.
    parts : Parts
    """
    if parts == "any" or category not in JOINTS:
        return True
    backwards = category == "drawer" and opens_to_the_back(joint_types, joint_axes)
    return tuple(joint_types[1:]) == JOINTS[category] and not backwards


def opens_to_the_back(joint_types: Sequence[str], joint_axes: ArrayLike) -> bool:
    """Whether its drawers are at the back of its frame: such a table is another one's, seen from behind."""
    slides = np.array(joint_types) == "prismatic"
    return bool(np.asarray(joint_axes)[slides, 0].sum() > _BACKWARDS)


def order_parts(obj: ArticulatedObject, parts: Parts) -> ArticulatedObject:
    """The object with its parts in the order that an estimator for such objects knows them in."""
    return sort_parts(obj) if parts == "any" else obj


def objects_of(
    categories: Sequence[str], number: int, first_seed: int, parts: Parts = "artimage", max_parts: int | None = None
) -> list[ArticulatedObject]:
    """Procedural objects with the parts asked for: for each category, those of the first seeds that have them.

    Parameters
    ----------
    categories : sequence of str
    number : int
        Objects of each category.
    first_seed : int
    parts : Parts
    max_parts : int, optional
        The most parts that an object may have.

    Raises
    ------
    ConfigError
        When a category is unknown, or hardly any object of it has these parts.
    """
    sources = family_sources(categories, 1, first_seed)
    return [obj for source in sources for obj in islice(_objects(source, parts, max_parts or MAX_PARTS), number)]


def _objects(first: FamilySource, parts: Parts, max_parts: int) -> Iterator[ArticulatedObject]:
    missed = 0
    for seed in count(first.seed):
        try:
            obj = FamilySource(first.category, seed).load()
        except AssetError:
            continue  # a rare fault of the family, which artsim's audit reports
        if len(obj) <= max_parts and has_parts(first.category, obj.tree.types, obj.tree.axes, parts):
            missed = 0
            yield order_parts(obj, parts)
        elif (missed := missed + 1) > _ATTEMPTS:
            raise ConfigError(f"no object of at most {max_parts} parts has those of {parts}", first.category)
