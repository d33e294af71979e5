"""How objects move: what computes it, its step, and factors on what joints lose."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from artsim.errors import ConfigError
from artsim.model.robot import GRAVITY

Control = Literal["effort", "velocity"]
Engine = Literal["auto", "pybullet", "mujoco"]


@dataclass(frozen=True)
class PhysicsOptions:
    """How an object moves."""

    engine: Engine = "auto"
    """What computes accelerations: pybullet or mujoco; auto: PyBullet where it is installed, else MuJoCo."""
    time_step: float = 1 / 480
    """Seconds of one step of the integrator."""
    substeps: int = 24
    """Steps of the integrator for each control step: 24 make 20 control steps per second."""
    gravity: float = GRAVITY
    """m/s^2, downwards."""
    damping: float = 1.0
    """Factor on every joint's damping; 0 takes it away."""
    friction: float = 1.0
    """Factor on every joint's friction; 0 takes it away."""
    collision: Literal["hull", "pieces"] = "hull"
    """What other things in PyBullet's world collide with, of loaded parts: the convex hull, or convex pieces (CoACD,
    the extra sim), which leave drawers open."""

    def __post_init__(self) -> None:
        if self.engine not in ("auto", "pybullet", "mujoco"):
            raise ConfigError(f"there is no engine {self.engine!r}", "engine", "use auto, pybullet or mujoco")
        if not 0.0 < self.time_step <= 0.02:
            raise ConfigError(
                f"a step of {self.time_step} s is not stable", "time_step", "use up to 0.02, such as 1/480"
            )
        if self.substeps < 1:
            raise ConfigError(f"{self.substeps} steps do not move anything", "substeps", "use 1 or more")
        if self.collision not in ("hull", "pieces"):
            raise ConfigError(f"there is no {self.collision!r}", "collision", "use hull or pieces")
        for name in ("gravity", "damping", "friction"):
            value = getattr(self, name)
            if not (np.isfinite(value) and value >= 0):
                raise ConfigError(f"{value} is not 0 or more", name, "use 0 to leave it out")

    @property
    def control_step(self) -> float:
        """Seconds of one control step."""
        return self.time_step * self.substeps
