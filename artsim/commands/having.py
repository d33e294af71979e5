"""Options of several verbs: which categories, what every object has, and how many processes do the work."""

from dataclasses import dataclass, field
from typing import Annotated

import tyro

from artsim.common.program import cores

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


@dataclass(frozen=True, kw_only=True)
class Workers:
    """Options of verbs that work in several processes."""

    workers: int = field(default_factory=cores)
    """Worker processes; by default one for each core."""


def categories_named(named: tuple[str, ...]) -> tuple[str, ...]:
    """Categories by name; 'all' stands for every one."""
    from artsim.families import FAMILIES

    return tuple(sorted(FAMILIES)) if "all" in named else named
