"""The fitting process for gymnasium: ``artperl/PoseFitting-v0``, for any reinforcement-learning library.

One environment fits one object; what it does and what is seen are :class:`artperl.agent.decision_process.Fitting`'s.
``gymnasium.make_vec("artperl/PoseFitting-v0", 64)`` makes many that step as one batch: :class:`PoseFittingVectorEnv`.
One object at a time, Python's own work takes most of a step. A batch does it once for all.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from artsim.common.extras import require_extra

with require_extra("artperl.training.gym_env", extra="train"):
    import gymnasium as gym
    import torch
    from gymnasium import spaces
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space

from artperl.agent.actions import NOTHING, NUM_AXES, NUM_BINS
from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.core.trees import KINDS
from artperl.data.categories import objects_of
from artperl.data.sources import DataOptions
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.fitting_problems import Problem, Problems

ENV_ID = "artperl/PoseFitting-v0"
_FAR = np.float32(1e3)
"""Bound of what is observed: far beyond any episode."""
SEEDS = 2_000_000
"""Seed of the first object that references are chosen from."""


Array = NDArray[Any]


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


class PoseFittingVectorEnv(VectorEnv[Any, Any, Any]):
    """Environments of :class:`PoseFittingEnv`, each with an object of its own.

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


gym.register(
    ENV_ID,
    entry_point=f"{__name__}:PoseFittingEnv",
    vector_entry_point=f"{__name__}:PoseFittingVectorEnv",
)
