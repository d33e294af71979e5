"""Many fitting environments that step as one batch, for gymnasium and for Stable-Baselines3.

One object at a time, Python's own work takes most of a step. A batch does it once for all.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.extras import needs

with needs("artperl.training.gym_vector_env", extra="train"):
    import gymnasium as gym
    import torch
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space

from artperl.agent.actions import NUM_AXES
from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.data.categories import objects_of
from artperl.data.fitting_problems import Problem, Problems
from artperl.data.sources import DataOptions
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.gym_env import SEEDS, action_space, observation_space, observations

Array = NDArray[Any]


class PoseFittingVectorEnv(VectorEnv[Any, Any, Any]):
    """Environments of :class:`artperl.training.gym_env.PoseFittingEnv`, each with an object of its own.

    Their episodes have the same length. So all end with one step, which also draws the next objects: observations are
    those of the new episodes, and ``info["final_obs"]`` and ``info["final_info"]`` are the last of the old ones.

    Parameters
    ----------
    num_envs : int
    category : str
        Procedural category.
    references : int
        Objects to choose references from.
    options : FittingOptions, optional
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP}  # noqa: RUF012 (as gymnasium has it)

    def __init__(
        self, num_envs: int = 64, category: str = "laptop", references: int = 16, options: FittingOptions | None = None
    ):
        self.num_envs, self.category, self.options = num_envs, category, options or FittingOptions()
        self.base = by_boxes(ShapeBase.of(objects_of([category], references, SEEDS), self.options.reference_points))
        rows = self.base.shapes.trees.num_rows
        self.single_action_space, self.single_observation_space = (
            action_space(rows), observation_space(rows, self.options),
        )  # fmt: skip
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._problems: Problems | None = None
        self._drawn = 0
        self._problem: Problem | None = None
        self._fitting: Fitting | None = None

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Draw new problems; the same seed (of a list, the first) draws the same ones.

        Without a seed, those that follow the last ones.
        """
        first = seed[0] if isinstance(seed, list) else seed
        super().reset(seed=first)
        if first is not None or self._problems is None:
            drawn, self._drawn = int(self.np_random.integers(1 << 31)), 0
            points = self.options.observed_points
            self._problems = Problems(DataOptions([self.category]), self.base, self.num_envs, points, drawn)
        self._draw()
        return observations(self._running()), self._info()

    def step(self, actions: Array) -> tuple[dict[str, Array], Array, Array, Array, dict[str, Any]]:
        """Take an action in each environment: bins (B, 9 P), part after part."""
        fitting = self._running()
        chosen = torch.as_tensor(np.asarray(actions), dtype=torch.int64).reshape(self.num_envs, -1, NUM_AXES)
        reward = fitting.step(chosen).double().numpy()
        ended = np.zeros(self.num_envs, dtype=np.bool_)
        if not fitting.done:
            return observations(fitting), reward, ended, ended.copy(), self._info()
        last, last_info = observations(fitting), self._info()
        self._draw()
        info = {**self._info(), "final_obs": last, "_final_obs": ~ended, "final_info": last_info, "_final_info": ~ended}
        return observations(self._running()), reward, ended, ~ended, info

    def _draw(self) -> None:
        assert self._problems is not None
        self._problem = problem = self._problems[self._drawn]
        self._drawn += 1
        self._fitting = Fitting(problem.shapes, problem.observed, problem.start, self.options)

    def _info(self) -> dict[str, Any]:
        fitting, problem, known = self._running(), self._problem, np.ones(self.num_envs, dtype=np.bool_)
        assert problem is not None
        expert = fitting.expert(problem.goal).flatten(1).numpy()
        return {"chamfer": fitting.distance.numpy(), "_chamfer": known, "expert": expert, "_expert": known}

    def _running(self) -> Fitting:
        if self._fitting is None:
            raise gym.error.ResetNeeded("reset the environments before their first step")
        return self._fitting
