"""A procedural object by its name, such as ``drawer[drawer=2..4]:3``."""

from __future__ import annotations

import hashlib
import re
from dataclasses import dataclass

from artsim.errors import ConfigError
from artsim.families import FAMILIES, make_constrained, source_name
from artsim.families.constraints import NO_CONSTRAINTS, Constraints
from artsim.model.objects import ArticulatedObject


@dataclass(frozen=True)
class FamilySource:
    """A procedural object to make."""

    category: str
    seed: int
    constraints: Constraints = NO_CONSTRAINTS
    """Of :func:`artsim.make`."""

    @staticmethod
    def named(name: str) -> FamilySource | None:
        """The source of this name; None where it is none of a procedural object."""
        found = _NAME.fullmatch(name)
        if found is None or found["category"] not in FAMILIES:
            return None
        try:
            source = FamilySource(
                found["category"],
                int(found["seed"]),
                Constraints.parse(found["constraints"].split(",") if found["constraints"] else []),
            )
        except ConfigError:
            return None
        return source if source.name == name else None

    @property
    def name(self) -> str:
        """Category, constraints and seed."""
        return source_name(self.category, self.seed, self.constraints)

    @property
    def sha256(self) -> str:
        """Digest of the name: the version of artsim, which a plan holds too, decides on the rest."""
        return hashlib.sha256(self.name.encode()).hexdigest()

    def load(self) -> ArticulatedObject:
        """The object."""
        return make_constrained(self.category, self.seed, self.constraints)


_NAME = re.compile(r"(?P<category>[a-z_]+)(\[(?P<constraints>[^\[\]]{1,1000})\])?:(?P<seed>[0-9]{1,19})")
