"""Environments for reinforcement learning, registered when this package is imported.

``artsim/Articulated-v0`` (gymnasium): :class:`artsim.envs.articulated.ArticulatedEnv`.
``artsim/Opening-v0`` (gymnasium, vectors): :class:`artsim.envs.opening.OpeningVectorEnv`.
``ArtSimArticulated-v1`` (ManiSkill 3): :mod:`artsim.envs.maniskill`, of which nothing heavy is imported before use.
"""

from typing import Any

from artsim.common.extras import require_extra
from artsim.envs.maniskill import ENV_ID, EPISODE_LENGTH

with require_extra("artsim.envs"):
    import gymnasium
    from gymnasium.envs.registration import WrapperSpec

    from artsim.envs.articulated import EnvOptions


def make_maniskill(**options: Any) -> Any:
    """What ``gymnasium.make("ArtSimArticulated-v1")`` calls.

    Raises
    ------
    ConfigError
        When ManiSkill is not installed, or an option makes no sense.
    """
    with require_extra(ENV_ID, extra="maniskill"):
        from artsim.envs.maniskill.task import ArticulatedTask
    return ArticulatedTask(**options)


gymnasium.register(
    id="artsim/Articulated-v0",
    entry_point="artsim.envs.articulated:ArticulatedEnv",
    additional_wrappers=(WrapperSpec("ObeyTimeLimit", "artsim.envs.articulated:ObeyTimeLimit", {}),),
)
gymnasium.register(
    id="artsim/Opening-v0",
    entry_point="artsim.envs.opening:OpeningEnv",
    vector_entry_point="artsim.envs.opening:OpeningVectorEnv",
)
# As ManiSkill's register_env does, which would have to import it: its own time limit knows batches.
_TIME_LIMIT = WrapperSpec(
    "MSTimeLimit", "mani_skill.utils.registration:TimeLimitWrapper", {"max_episode_steps": EPISODE_LENGTH}
)
gymnasium.register(
    id=ENV_ID,
    entry_point="artsim.envs:make_maniskill",
    max_episode_steps=EPISODE_LENGTH,
    disable_env_checker=True,
    additional_wrappers=(_TIME_LIMIT,),
)

__all__ = ["EnvOptions"]
