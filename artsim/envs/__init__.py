"""Environments for reinforcement learning, registered when this package is imported.

``artsim/Articulated-v0`` (gymnasium): :class:`artsim.envs.articulated.ArticulatedEnv`.
"""

from __future__ import annotations

from artsim.errors import ArtsimError

try:
    import gymnasium
except ImportError as error:
    raise ArtsimError("gymnasium is not installed", "artsim.envs", "pip install 'artsim[envs]'") from error

gymnasium.register(id="artsim/Articulated-v0", entry_point="artsim.envs.articulated:ArticulatedEnv")
