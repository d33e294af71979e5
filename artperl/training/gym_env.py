"""The fitting process for gymnasium: ``artperl/PoseFitting-v0``, for any reinforcement-learning library.

One environment fits one object; what it does and what is seen are :class:`artperl.agent.decision_process.Fitting`'s.
``gymnasium.make_vec("artperl/PoseFitting-v0", 64)`` makes many that step as one batch: :class:`PoseFittingVectorEnv`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.extras import needs

with needs("artperl.training.gym_env", extra="train"):
    import gymnasium as gym
    import torch
    from gymnasium import spaces

from artperl.agent.actions import NOTHING, NUM_AXES, NUM_BINS
from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.core.trees import KINDS
from artperl.data.categories import objects_of
from artperl.data.fitting_problems import Problem, Problems
from artperl.data.sources import DataOptions
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase

ENV_ID = "artperl/PoseFitting-v0"
_FAR = np.float32(1e3)
"""Bound of what is observed: far beyond any episode."""
SEEDS = 2_000_000
"""Seed of the first object that references are chosen from."""


class PoseFittingEnv(gym.Env[Any, NDArray[np.int64]]):
    """Move a reference onto the cloud of an object that has never been seen before.

    Observations are the fields of :class:`artperl.agent.decision_process.View` of one object. An action names a bin for
    each of 9 axes of each part. Only parts of the tree's level whose turn it is act, along the axes that they have. The
    reward is that of equation 3; episodes are truncated when each level has had its turn ``options.steps`` times. Whose
    turn it is and the share of steps that are left are observed, so that the process is Markov's.
    ``info`` holds the chamfer distance and the action of the expert, for imitation.

    Parameters
    ----------
    category : str
        Procedural category.
    references : int
        Objects to choose references from.
    options : FittingOptions, optional
    """

    def __init__(self, category: str = "laptop", references: int = 16, options: FittingOptions | None = None):
        self.options = options or FittingOptions()
        self.base = by_boxes(ShapeBase.of(objects_of([category], references, SEEDS), self.options.reference_points))
        self.category = category
        P = self.base.shapes.trees.num_rows
        self._shape = (P, NUM_AXES)
        self.action_space: spaces.MultiDiscrete = action_space(P)
        self.observation_space = observation_space(P, self.options)
        self._problem: Problem | None = None
        self._fitting: Fitting | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
        """Draw a new problem; the same seed draws the same one."""
        super().reset(seed=seed)
        drawn = int(self.np_random.integers(1 << 31))
        problems = Problems(DataOptions([self.category]), self.base, 1, self.options.observed_points, drawn)
        self._problem = problem = problems[0]
        self._fitting = Fitting(problem.shapes, problem.observed, problem.start, self.options)
        return self._observation(), self._info()

    def step(self, action: NDArray[np.int64]) -> tuple[dict[str, NDArray[Any]], float, bool, bool, dict[str, Any]]:
        """Take an action: bins, part after part."""
        fitting = self._running()
        chosen = torch.as_tensor(np.asarray(action), dtype=torch.int64).reshape(1, *self._shape)
        reward = float(fitting.step(chosen)[0])
        return self._observation(), reward, False, fitting.done, self._info()

    def _observation(self) -> dict[str, NDArray[Any]]:
        return {name: values[0] for name, values in observations(self._running()).items()}

    def _info(self) -> dict[str, Any]:
        fitting, problem = self._running(), self._problem
        assert problem is not None
        expert = fitting.expert(problem.goal).flatten().numpy()
        return {"chamfer": float(fitting.distance[0]), "expert": expert}

    def _running(self) -> Fitting:
        if self._fitting is None:
            raise gym.error.ResetNeeded("reset the environment before its first step")
        return self._fitting


def action_space(rows: int) -> spaces.MultiDiscrete:
    """A bin for each axis of each of P rows for parts."""
    return spaces.MultiDiscrete(np.full(rows * NUM_AXES, NUM_BINS), dtype=np.int64)


def observation_space(rows: int, options: FittingOptions) -> spaces.Dict:
    """Fields of :class:`artperl.agent.decision_process.View`, of P rows for parts."""
    N = min(options.observed_points, options.seen_points)
    M = min(options.reference_points, options.seen_reference)
    return spaces.Dict(
        {
            "observed": _anything(N, 3),
            "part": spaces.MultiDiscrete(np.full(N, rows), dtype=np.int64),
            "gap": _anything(N, 3),
            "gap_normal": _anything(N, 3),
            "reference": _anything(rows, M, 3),
            "normal": _anything(rows, M, 3),
            "shown": spaces.MultiBinary((rows, M)),
            "reference_gap": _anything(rows, M, 3),
            "frame": _anything(rows, 3, 3),
            "axis": _anything(rows, 3),
            "anchor": _anything(rows, 3),
            "sight": _anything(3),
            "kind": spaces.MultiDiscrete(np.full(rows, len(KINDS)), dtype=np.int64),
            "parent": spaces.MultiDiscrete(np.full(rows, rows), dtype=np.int64),
            "valid": spaces.MultiBinary(rows),
            "state": _anything(rows, 2),
            "turn": spaces.MultiBinary(rows),
            "left": _anything(1),
        }
    )


def observations(fitting: Fitting) -> dict[str, NDArray[Any]]:
    """What is seen of each environment, as :func:`observation_space` has it; the arrays are the caller's."""
    fields: dict[str, NDArray[Any]] = {name: tensor.numpy().copy() for name, tensor in vars(fitting.view()).items()}
    fields = {k: np.clip(v, -_FAR, _FAR) if v.dtype == np.float32 else v for k, v in fields.items()}
    return fields | {name: fields[name].astype(np.int8) for name in ("valid", "shown", "turn")}


def nothing(env: PoseFittingEnv) -> NDArray[np.int64]:
    """The action that changes nothing."""
    return np.full(len(env.action_space.nvec), NOTHING, dtype=np.int64)


def _anything(*shape: int) -> spaces.Box:
    return spaces.Box(-_FAR, _FAR, shape, np.float32)


gym.register(
    ENV_ID,
    entry_point=f"{__name__}:PoseFittingEnv",
    vector_entry_point="artperl.training.gym_vector_env:PoseFittingVectorEnv",
)
