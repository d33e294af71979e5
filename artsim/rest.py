"""The rest state of each category: laptops and boxes closed, eyeglasses open, everything else at its own zero."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from artsim.kinematics import Array, KinematicTree
from artsim.objects import Part, Repair


def canonical_category(name: str) -> str:
    """``StorageFurniture`` and ``storage furniture`` are both ``storage_furniture``."""
    words = "".join(f"_{c.lower()}" if c.isupper() else c for c in name.strip()).replace(" ", "_").replace("-", "_")
    return "_".join(word for word in words.split("_") if word)


def rest_state(tree: KinematicTree, parts: Sequence[Part], category: str) -> tuple[Array, list[Repair]]:
    """State that every instance of a category is aligned at, and the reasons where it is not the file's zero.

    Parameters
    ----------
    tree : KinematicTree
        With rest state 0, in the base link's frame.
    parts : sequence of Part
        In the same frame, at the file's zero state.
    category : str

    Returns
    -------
    rest : (K,) float
    reasons : list of Repair
    """
    rest = np.clip(0.0, tree.limits[:, 0], tree.limits[:, 1])
    reasons = [
        Repair(f"joint {tree.joints[k].name!r}", f"0 is outside its limits: rest state {rest[k]:.6g}")
        for k in np.flatnonzero(rest)
    ]
    return rest, reasons
