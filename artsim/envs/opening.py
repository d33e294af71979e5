"""``artsim/Opening-v0``: hands that open what they see, many episodes side by side.

::

    import gymnasium
    import artsim.envs

    envs = gymnasium.make_vec("artsim/Opening-v0", 8, task="grasp", categories=("drawer", "microwave"), count=2)
    seen, info = envs.reset(seed=0)
    seen, reward, terminated, truncated, info = envs.step(envs.action_space.sample())
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from artsim.common.sequences import wrap_singles
from artsim.envs.cached_rays import look_at_row
from artsim.envs.handles import Handle, HeldJoints, find_handles
from artsim.errors import ConfigError
from artsim.loading.sources import Source, family_sources, find_sources
from artsim.model.draws import ViewOptions
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import invert_transform

CONTROL_STEP = 0.05
"""Seconds."""
SPEED = 0.4
"""m/s that 1 of an action stands for: of a careful arm."""
LEAST_GOAL = 0.3
"""Share of a joint's reach that goals are away from rest at least."""
TOLERANCE = 0.1
"""Share of its reach within which a joint is at its goal."""
_AROUND = 0.01
"""Metres around a handle's box in which the middle of closing fingers takes it."""
_START = np.array([[0.10, 0.25], [-0.10, 0.10], [-0.10, 0.10]])
"""Metres from a handle, outwards and across, at which free hands begin."""
_LEAD = 0.08
"""Metres that the oracle's hand is ahead of what it pulls at most: it then exerts 48 N, which opens every latch."""
_GAIN = 3.0
"""Of the oracle: near the goal its hand is so many times the way left ahead, against friction."""

Observation = dict[str, NDArray[np.float32]]


@dataclass(frozen=True)
class OpeningOptions:
    """What is to be opened, by what, and what is seen of it."""

    task: Literal["pull", "grasp"] = "pull"
    """pull: hands hold a handle when an episode begins; grasp: open hands stand before it."""
    observe: tuple[Literal["cloud", "state"], ...] = ("cloud",)
    """cloud: points; state: where the handle is, where it goes, and how far."""
    categories: tuple[str, ...] = ("drawer",)
    """Procedural categories; those of objects to tell apart."""
    objects: tuple[Path, ...] = ()
    """URDF files, object folders, or folders of them, instead of procedural objects."""
    pool: int = 64
    """Procedural objects of each category, which all episodes share."""
    first_seed: int = 0
    """Of these objects."""
    count: int = 1
    """Objects in a row, each of another category, of which one is to be opened."""
    num_points: int = 64
    episode_length: int = 60
    """Control steps."""
    views: ViewOptions = field(
        default_factory=lambda: ViewOptions(azimuth=(-60.0, 60.0), elevation=(15.0, 45.0), width=96, height=72)
    )

    def __post_init__(self) -> None:
        wrap_singles(self)
        if self.task not in ("pull", "grasp"):
            raise ConfigError(f"there is no task {self.task!r}", "task", "use pull or grasp")
        unknown = set(self.observe) - {"cloud", "state"}
        if unknown or not self.observe:
            raise ConfigError(f"nothing is seen by {', '.join(sorted(unknown))!r}", "observe", "use cloud, state")
        for name in ("pool", "count", "num_points", "episode_length"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{getattr(self, name)} is not a count", name, "use 1 or more")
        if self.count > 1 and (self.objects or self.count > len(set(self.categories))):
            raise ConfigError(f"{self.count} objects are not of different categories", "count", "name more categories")


class OpeningVectorEnv(VectorEnv[Observation, NDArray[np.float32], NDArray[Any]]):
    """Hands that are to bring a joint of what they see to a goal, by its handle.

    Each of B episodes has another object and a camera before it. All begin and end together: call ``reset`` after the
    last step. The **level frame** has its origin at the hand, x away from the camera, z up, y to the left.

    An **action** (B, 3) in [-1, 1] is the hand's velocity over ``SPEED``, level frame; under ``task="grasp"`` a fourth
    number closes (> 0) or opens the fingers. They take a handle that is between them, and hold it by a spring; above
    ``GRIP`` newtons they slip off. A hand meets no other resistance: it may pass through objects. Latches and friction
    have to be overcome, and only a pull along the way of the handle does not slip.

    An **observation** holds

    - ``hand`` (5,): its way since the episode began (level frame, metres), fingers closed, something held;
    - ``goal`` (1 + C,): metres that the handle is to go, and which of ``categories`` is to be opened;
    - ``points`` (N, 3): where N rays of a depth camera, the same all episode, meet something; level frame, metres. A
      ray that meets nothing is at the hand;
    - ``state`` (9,): the way to the handle and the direction in which it opens, level frame; metres that it has gone
      and that it can go; 1 while it is held. This tells what a cloud has to be read for.

    The **reward** is the share of the way to the goal that a step went, and, for free hands, to the handle; and 1 at
    the end of a success. **info** has ``success`` (B,), whether the joint is within ``TOLERANCE`` of its reach from the
    goal, and ``opened`` (B,), the state over the reach.

    Parameters
    ----------
    num_envs : int
    render_mode : str, optional
        "rgb_array".
    **options
        Fields of :class:`OpeningOptions`.

    Raises
    ------
    ConfigError
        When an option is unknown or makes no sense, or no object has a handle.
    """

    metadata = {"autoreset_mode": AutoresetMode.DISABLED, "render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012

    def __init__(self, num_envs: int = 1, render_mode: str | None = None, **options: Any):
        known = {f.name for f in fields(OpeningOptions)}
        if not options.keys() <= known:
            wrong = ", ".join(sorted(options.keys() - known))
            raise ConfigError(f"there is no option {wrong}", "artsim/Opening-v0", f"use {', '.join(sorted(known))}")
        self.options, self.num_envs, self.render_mode = OpeningOptions(**options), num_envs, render_mode
        own = self.options
        sources: list[list[Source]] = (
            [[*find_sources(own.objects, {})]]
            if own.objects
            else [[*family_sources((category,), own.pool, own.first_seed)] for category in own.categories]
        )
        self._pool: list[list[list[Handle] | Source]] = [[*of_one] for of_one in sources]
        seen = {"hand": 5, "goal": 1 + len(sources)} | ({"state": 9} if "state" in own.observe else {})
        box: dict[str, spaces.Space[Any]] = {
            name: spaces.Box(-np.inf, np.inf, (size,), np.float32) for name, size in seen.items()
        }
        if "cloud" in own.observe:
            box["points"] = spaces.Box(-np.inf, np.inf, (own.num_points, 3), np.float32)
        self.single_observation_space = spaces.Dict(box)
        self.single_action_space = spaces.Box(-1.0, 1.0, (3 if own.task == "pull" else 4,), np.float32)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin B episodes. A seed makes them the same again; there are no options."""
        super().reset(seed=seed[0] if isinstance(seed, list) else seed)
        rng, own = self.np_random, self.options
        drawn = [self._draw(rng) for _ in range(self.num_envs)]
        self.handles = [handle for handle, _, _ in drawn]
        self.kind = np.array([kind for _, kind, _ in drawn])
        self.joints = HeldJoints(self.handles)
        reach = self.joints.reach
        self.goal = reach * rng.uniform(LEAST_GOAL, 1.0, self.num_envs)
        self.views = [look_at_row(handle, others, own.views, own.num_points, rng) for handle, _, others in drawn]
        self._R_level_world = np.stack([view.R_level_world for view in self.views])
        self.fingers_closed = np.full(self.num_envs, own.task == "pull")
        if own.task == "pull":
            self.joints.grasp(self.fingers_closed)
        else:
            T = np.stack([handle.detail.T_rest_detail[:3, :3] for handle in self.handles])
            away = rng.uniform(_START[:, 0], _START[:, 1], (self.num_envs, 3))
            self.joints.hand = self.joints.hand + np.einsum("bij,bj->bi", T, away)
        self._began, self._steps = self.joints.hand.copy(), 0
        self._lever = np.array([handle.lever for handle in self.handles])
        self._away = np.maximum(np.linalg.norm(self._began - self.joints.place, axis=1), 1e-3)
        self._worth = self._potential()
        return self._look(), self._info()

    def step(self, actions: ArrayLike) -> tuple[Observation, NDArray[Any], NDArray[Any], NDArray[Any], dict[str, Any]]:
        """One control step of every episode; see the class.

        Raises
        ------
        ConfigError
            When actions have another shape, or are not finite.
        """
        given = np.asarray(actions, dtype=np.float64)
        if given.shape != self.action_space.shape or not np.isfinite(given).all():
            raise ConfigError(
                f"actions of shape {given.shape} are not {self.action_space.shape} finite numbers",
                "artsim/Opening-v0",
                "pass a velocity for each hand",
            )
        given = np.clip(given, -1.0, 1.0)
        if self.options.task == "grasp":
            closes = given[:, 3] > 0
            self.joints.holds = self.joints.holds & closes
            self.joints.grasp(closes & ~self.fingers_closed & self._between())
            self.fingers_closed = closes
        velocity = SPEED * np.einsum("bji,bj->bi", self._R_level_world, given[:, :3])
        self.joints.move(velocity, CONTROL_STEP)
        self._steps += 1
        over = self._steps >= self.options.episode_length
        before, self._worth = self._worth, self._potential()
        info = self._info()
        reward = self._worth - before + (info["success"] if over else 0.0)
        no = np.zeros(self.num_envs, dtype=bool)
        return self._look(), reward, no, no | over, info

    def oracle(self) -> NDArray[np.float32]:
        """Actions (B, A) of one who knows the state: to the handle, and then along its way to the goal."""
        joints = self.joints
        ahead = np.clip(_GAIN * (self.goal - joints.q), -_LEAD / self._lever, _LEAD / self._lever)
        wanted = np.where(joints.holds[:, None], joints.held_place(joints.q + ahead), joints.place)
        velocity = (wanted - joints.hand) / (2.0 * CONTROL_STEP)
        action = np.einsum("bij,bj->bi", self._R_level_world, velocity) / SPEED
        action /= np.maximum(np.abs(action).max(axis=1, keepdims=True), 1.0)
        if self.options.task == "grasp":
            closes = joints.holds | (~self.fingers_closed & self._between())
            action = np.hstack([action, np.where(closes, 1.0, -1.0)[:, None]])
        return action.astype(np.float32)

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """(H, W, 3) pictures, a colour for each part and a dot for the hand, with ``render_mode="rgb_array"``."""
        if self.render_mode is None:
            return None
        episodes = zip(self.views, self.joints.q, self.joints.hand, self.fingers_closed, strict=True)
        return tuple(view.picture(q, hand, bool(closed)) for view, q, hand, closed in episodes)

    def _draw(self, rng: np.random.Generator) -> tuple[Handle, int, list[ArticulatedObject]]:
        """A handle to move, the number of its category, and objects of other categories."""
        kinds = rng.permutation(len(self._pool))[: self.options.count]
        chosen = [self._handles(int(kind), rng) for kind in kinds]
        return chosen[0][rng.integers(len(chosen[0]))], int(kinds[0]), [handles[0].obj for handles in chosen[1:]]

    def _handles(self, kind: int, rng: np.random.Generator) -> list[Handle]:
        """Those of a random object of a category, made at its first use."""
        pool = self._pool[kind]
        while pool:
            number = int(rng.integers(len(pool)))
            made = pool[number]
            if not isinstance(made, list):
                made = pool[number] = find_handles(made.load())
            if made:
                return made
            pool.pop(number)
        raise ConfigError("no object has a handle that moves a joint", "artsim/Opening-v0", "use other categories")

    def _look(self) -> Observation:
        joints, R = self.joints, self._R_level_world
        way = np.einsum("bij,bj->bi", R, joints.hand - self._began)
        one_hot = np.eye(len(self._pool))[self.kind]
        seen = {
            "hand": np.column_stack([way, self.fingers_closed, joints.holds]),
            "goal": np.column_stack([self.goal * self._lever, one_hot]),
        }
        if "state" in self.options.observe:
            there = joints.place
            ahead = joints.lever(there) / self._lever[:, None]
            seen["state"] = np.column_stack([
                np.einsum("bij,bj->bi", R, there - joints.hand), np.einsum("bij,bj->bi", R, ahead),
                joints.q * self._lever, joints.reach * self._lever, joints.holds,
            ])  # fmt: skip
        if "cloud" in self.options.observe:
            episodes = zip(self.views, self._motions(), joints.hand, strict=True)
            seen["points"] = np.stack([view.cloud(moved, hand) for view, moved, hand in episodes])
        return {name: array.astype(np.float32) for name, array in seen.items()}

    def _motions(self) -> Array:
        """(B, 4, 4) from the rest frame, as moving parts carry it, to the rest frame."""
        joints = self.joints
        T = np.zeros((self.num_envs, 4, 4))
        T[:, :3, 3] = joints.carried(np.zeros((self.num_envs, 3)), joints.q)
        for i in range(3):
            T[:, :3, i] = joints.carried(np.tile(np.eye(3)[i], (self.num_envs, 1)), joints.q) - T[:, :3, 3]
        T[:, 3, 3] = 1.0
        return T

    def _between(self) -> NDArray[np.bool_]:
        """(B,) whether handles are between the fingers."""
        T_moved_rest = invert_transform(self._motions())
        found = []
        for handle, T, hand in zip(self.handles, T_moved_rest, self.joints.hand, strict=True):
            T_detail_rest = invert_transform(handle.detail.T_rest_detail)
            local = (T_detail_rest @ T @ np.append(hand, 1.0))[:3]
            found.append(bool((np.abs(local) <= 0.5 * handle.detail.size + _AROUND).all()))
        return np.array(found)

    def _potential(self) -> Array:
        """(B,) 1 at the goal, and less by the share of the way to it and to the handle."""
        joints = self.joints
        left = np.abs(joints.q - self.goal) / self.goal
        away = np.linalg.norm(joints.hand - joints.place, axis=1) / self._away
        return 1.0 - left - (np.where(joints.holds, 0.0, away) if self.options.task == "grasp" else 0.0)

    def _info(self) -> dict[str, Any]:
        joints = self.joints
        success = np.abs(joints.q - self.goal) <= TOLERANCE * joints.reach
        return {"success": success, "opened": joints.q / joints.reach}


class OpeningEnv(gymnasium.Env[Observation, NDArray[np.float32]]):
    """One episode of :class:`OpeningVectorEnv`, whose options it takes."""

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012

    def __init__(self, render_mode: str | None = None, **options: Any):
        self.envs, self.render_mode = OpeningVectorEnv(1, render_mode, **options), render_mode
        self.observation_space, self.action_space = self.envs.single_observation_space, self.envs.single_action_space

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode."""
        super().reset(seed=seed)
        return _first(*self.envs.reset(seed=seed))

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One control step."""
        seen, reward, terminated, truncated, info = self.envs.step(np.asarray(action)[None])
        own, known = _first(seen, info)
        return own, float(reward[0]), bool(terminated[0]), bool(truncated[0]), known

    def render(self) -> NDArray[np.uint8] | None:
        """(H, W, 3) picture, with ``render_mode="rgb_array"``."""
        pictures = self.envs.render()
        return None if pictures is None else pictures[0]


def _first(seen: Observation, info: dict[str, Any]) -> tuple[Observation, dict[str, Any]]:
    return {name: array[0] for name, array in seen.items()}, {name: array[0] for name, array in info.items()}
