"""Options of verbs that make objects: which categories, and what every object has."""

from __future__ import annotations

from typing import Annotated

import tyro

Having = Annotated[
    tuple[str, ...],
    tyro.conf.arg(
        metavar="NAME=VALUE",
        help="What every procedural object must have: a number or a range of parts (doors=2 drawers=1..3), of joints "
        "(joints=2..), of metres (size height width depth: size=0.4..0.8), joint types (joint_types=revolute), "
        "handles and legs (handles=no).",
    ),
]
"""Constraints of :func:`artsim.make`."""


def categories_named(named: tuple[str, ...]) -> tuple[str, ...]:
    """Categories by name; 'all' stands for every one."""
    from artsim.families import FAMILIES

    return tuple(sorted(FAMILIES)) if "all" in named else named
