"""How an object stands and is driven in a simulator's file."""

from dataclasses import dataclass
from typing import Literal, get_args

from artsim.errors import ConfigError

Base = Literal["fixed", "free"]
Actuators = Literal["none", "motor", "position"]


@dataclass(frozen=True)
class ExportOptions:
    """How an object stands and is driven. URDF says neither: there the simulator is told when it loads the file.

    Raises
    ------
    ConfigError
        When a value is unknown.
    """

    base: Base = "fixed"
    """fixed: the root is fixed to the world; free: it falls (MJCF, USD)."""
    actuators: Actuators = "none"
    """Of the joints that can be chosen, in MJCF. motor: a control of 1 is the joint's effort limit, less what its speed
    takes away: at full control it does not exceed its velocity limit. position: a control is where the joint shall be.
    USD has drives in any case."""

    materials: bool = False
    """Write finishes, as renderers draw them for the category: colours and textures, with where they lie."""

    def __post_init__(self) -> None:
        for name, kind in (("base", Base), ("actuators", Actuators)):
            if getattr(self, name) not in get_args(kind):
                raise ConfigError(
                    f"there is no {name} {getattr(self, name)!r}", name, f"use {', '.join(get_args(kind))}"
                )
