"""The batch of fitting environments as Stable-Baselines3 wants it.

``PPO("MultiInputPolicy", StableBaselinesEnvs(gymnasium.make_vec("artperl/PoseFitting-v0", 64)))`` learns from all.
"""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.extras import require_extra

with require_extra("artperl.training.stable_baselines", extra="dev"):
    from stable_baselines3.common.vec_env import VecEnv

from gymnasium.vector import AutoresetMode, VectorEnv

Array = NDArray[Any]


class StableBaselinesEnvs(VecEnv):
    """Gymnasium's environments that are reset in the step that ends them, or that all end together, as a ``VecEnv``.

    Parameters
    ----------
    envs : gymnasium.vector.VectorEnv
        With dictionaries as observations.
    """

    def __init__(self, envs: VectorEnv[Any, Any, Any]):
        self.envs = envs
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)
        self._actions: Array | None = None

    def reset(self) -> dict[str, Array]:
        """Draw new problems, by the seed that was set."""
        observed, _ = self.envs.reset(seed=self._seeds[0])
        self._reset_seeds()
        return observed

    def step_async(self, actions: Array) -> None:
        """Keep the actions for :meth:`step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[dict[str, Array], Array, Array, list[dict[str, Any]]]:
        """Take them."""
        observed, reward, ended, truncated, info = self.envs.step(self._actions)
        done = ended | truncated
        if done.all() and self.envs.metadata["autoreset_mode"] is AutoresetMode.DISABLED:
            info["final_obs"], (observed, _) = observed, self.envs.reset()
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for i in np.flatnonzero(done):
            last = {name: values[i] for name, values in info["final_obs"].items()}
            infos[i] = {"terminal_observation": last, "TimeLimit.truncated": bool(truncated[i] and not ended[i])}
        return observed, reward.astype(np.float32), done, infos

    def close(self) -> None:
        """Nothing is to be closed but what is inside."""
        self.envs.close()

    def get_attr(self, attr_name: str, indices: int | Iterable[int] | None = None) -> list[Any]:
        """The attribute that all environments share, once for each."""
        return [getattr(self.envs, attr_name)] * len(list(self._get_indices(indices)))

    def set_attr(self, attr_name: str, value: Any, indices: int | Iterable[int] | None = None) -> None:
        """Refused: what all environments share is not set for some."""
        raise AttributeError(f"{attr_name} is shared by all environments. Fix: make them with other options")

    def env_method(
        self, method_name: str, *args: Any, indices: int | Iterable[int] | None = None, **kwargs: Any
    ) -> list[Any]:
        """Call a method of the batch, once."""
        return [getattr(self.envs, method_name)(*args, **kwargs)] * len(list(self._get_indices(indices)))

    def env_is_wrapped(self, wrapper_class: type, indices: int | Iterable[int] | None = None) -> list[bool]:
        """None is."""
        return [False] * len(list(self._get_indices(indices)))
