"""``artsim/Articulated-v0``: an articulated object under physics, seen by a depth camera.

::

    import gymnasium
    import artsim.envs

    env = gymnasium.make("artsim/Articulated-v0", categories=("laptop", "drawer"), images=("depth",))
    observation, info = env.reset(seed=0)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from artsim.camera import Camera
from artsim.dataset import pad_sample
from artsim.errors import ConfigError
from artsim.kinematics import Array
from artsim.objects import ArticulatedObject
from artsim.physics import Control, PhysicsOptions, Simulation
from artsim.renderers import render
from artsim.sample import Sample, observe
from artsim.sampling import (
    Scale,
    StateOptions,
    ViewOptions,
    bounding_sphere,
    joint_intervals,
    sample_scale,
    sample_state,
    sample_view,
)
from artsim.sensor import find_sensor
from artsim.sources import FamilySource, Source, family_sources, find_sources
from artsim.stream import STREAM_SEEDS

Observation = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class EnvOptions:
    """What an episode is like."""

    categories: tuple[str, ...] = ("drawer",)
    """Procedural categories: every episode has a new object of one of them, unless objects are named."""
    objects: tuple[str | Path, ...] = ()
    """URDF files, object folders, or folders of them: every episode has one of these."""
    obj: ArticulatedObject | None = None
    """The one object of every episode."""
    scale: Scale = "native"
    """Size of the object: native, unit (diagonal of 1 m), or a range of diagonals in metres."""
    states: StateOptions = field(default_factory=lambda: StateOptions(mode="rest"))
    """State in which an episode begins."""
    control: Control = "effort"
    """What actions are: effort or velocity."""
    max_joints: int = 16
    """Entries of an action, and joints of the largest object."""
    episode_length: int = 100
    """Control steps."""
    physics: PhysicsOptions = field(default_factory=PhysicsOptions)
    camera: Literal["fixed", "orbit"] = "fixed"
    """fixed: the camera stands still in an episode; orbit: it goes round the object."""
    orbit_speed: float = 20.0
    """Degrees per second."""
    views: ViewOptions = field(default_factory=lambda: ViewOptions(width=160, height=120))
    """Where the camera begins; the object fits its image in every state."""
    num_points: int = 1024
    """Points of a cloud."""
    images: tuple[Literal["depth", "part_mask"], ...] = ()
    """Images to observe besides the cloud."""
    noise: str = "none"
    """Depth sensor whose noise cloud and depth image carry; the ground truth never does."""

    def __post_init__(self) -> None:
        if self.control not in ("effort", "velocity"):
            raise ConfigError(f"there is no control {self.control!r}", "control", "use effort or velocity")
        if self.camera not in ("fixed", "orbit"):
            raise ConfigError(f"there is no camera motion {self.camera!r}", "camera", "use fixed or orbit")
        unknown = set(self.images) - {"depth", "part_mask"}
        if unknown:
            raise ConfigError(f"there is no image {', '.join(sorted(unknown))}", "images", "use depth, part_mask")
        find_sensor(self.noise)
        for name in ("max_joints", "episode_length", "num_points"):
            if getattr(self, name) < 1:
                raise ConfigError(f"{getattr(self, name)} is not a count", name, "use 1 or more")


class ArticulatedEnv(gymnasium.Env[Observation, Any]):
    """An object whose joints are driven, and what a depth camera sees of it.

    An **action** is one number in [-1, 1] for each joint that can be chosen (``obj.tree.free_joints``, in order): the
    share of its effort limit, or, under velocity control, of its velocity limit. Further entries move nothing. An
    **observation** holds ``points`` (N, 3), the partial cloud in the camera frame in metres, and the images asked for:
    ``depth`` (H, W) in metres, 0 = no return, ``part_mask`` (H, W), 255 = background. The **info** is the whole ground
    truth: the sample's record as :func:`artsim.dataset.pad_sample` writes it, with P = ``max_joints + 1`` rows, and

    - ``time``: seconds since the episode began,
    - ``joint_velocity`` (P,): rad/s or m/s,
    - ``openness``: mean over the joints that can be chosen of the way from rest, over the longest way there is,
    - ``action_valid`` (max_joints,): which entries of an action move a joint, and ``action_limit``: what 1 means there,
    - ``category``, ``object_id``, ``part_names`` (in order, with blanks between).

    The **reward** of a step is what it added to the openness, so that a return is how far the object was opened. An
    episode never terminates; it is truncated at its length. Equal seeds make equal episodes.

    Parameters
    ----------
    render_mode : str, optional
        "rgb_array": :meth:`render` gives the picture of the camera.
    **options
        Fields of :class:`EnvOptions`.

    Raises
    ------
    ConfigError
        When an option is unknown or makes no sense.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 20}  # noqa: RUF012  # gymnasium's own name and type

    sample: Sample
    """What was seen last, with its ground truth: the record behind the info."""

    def __init__(self, render_mode: str | None = None, **options: Any):
        known = {f.name for f in fields(EnvOptions)}
        if not options.keys() <= known:
            wrong = ", ".join(sorted(options.keys() - known))
            raise ConfigError(f"there is no option {wrong}", "artsim/Articulated-v0", f"use {', '.join(sorted(known))}")
        if render_mode not in (None, *self.metadata["render_modes"]):
            raise ConfigError(f"there is no render mode {render_mode!r}", "artsim/Articulated-v0", "use rgb_array")
        self.options, self.render_mode = EnvOptions(**options), render_mode
        self._sources = self._find_sources()
        self._load = lru_cache(maxsize=16)(lambda number: self._sources[number].load())
        self._simulation: Simulation | None = None
        width, height = self.options.views.width, self.options.views.height
        seen: dict[str, spaces.Space[Any]] = {
            "points": spaces.Box(-np.inf, np.inf, (self.options.num_points, 3), np.float32)
        }
        if "depth" in self.options.images:
            seen["depth"] = spaces.Box(0.0, np.inf, (height, width), np.float32)
        if "part_mask" in self.options.images:
            seen["part_mask"] = spaces.Box(0, 255, (height, width), np.uint8)
        self.observation_space = spaces.Dict(seen)  # type: ignore[assignment]
        self.action_space = spaces.Box(-1.0, 1.0, (self.options.max_joints,), np.float32)

    def _find_sources(self) -> list[Source]:
        options = self.options
        if options.obj is not None:
            return []
        if options.objects:
            return [*find_sources(options.objects)]
        return [*family_sources(options.categories, 1)]

    def _draw_object(self) -> ArticulatedObject:
        """The object of a new episode."""
        if self.options.obj is not None:
            obj = self.options.obj
        else:
            number = int(self.np_random.integers(len(self._sources)))
            source = self._sources[number]
            if isinstance(source, FamilySource):  # never seen before
                obj = replace(source, seed=int(self.np_random.integers(*STREAM_SEEDS))).load()
            else:
                obj = self._load(number)
        if len(obj) - 1 > self.options.max_joints:
            raise ConfigError(
                f"has {len(obj) - 1} joints, more than {self.options.max_joints}",
                f"{obj.category} {obj.object_id}",
                f"set max_joints={len(obj) - 1} or more",
            )
        return sample_scale(obj, self.options.scale, self.np_random)

    @property
    def simulation(self) -> Simulation:
        """Physics of the current episode.

        Raises
        ------
        ConfigError
            Before the first :meth:`reset`.
        """
        if self._simulation is None:
            raise ConfigError("no episode has begun", "artsim/Articulated-v0", "call reset() first")
        return self._simulation

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode: a new object, its state, and a camera.

        Parameters
        ----------
        seed : int, optional
        options : mapping, optional
            Not used.

        Returns
        -------
        observation, info : dict
        """
        super().reset(seed=seed)
        obj = self._draw_object()
        if self._simulation is None or self._simulation.obj is not obj:
            self.close()
            self._simulation = Simulation(obj, self.options.physics)
        self._simulation.reset(sample_state(obj, self.options.states, self.np_random))
        self._steps = 0
        self._camera = sample_view(obj, _widest(obj), self.options.views, self.np_random)
        self._openness = openness(obj, self._simulation.state)
        return self._look()

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """One control step.

        Parameters
        ----------
        action : (max_joints,) float
            Within [-1, 1]; see the class.

        Returns
        -------
        observation : dict
        reward : float
        terminated, truncated : bool
        info : dict

        Raises
        ------
        ConfigError
            When the action has another shape, or is not finite.
        """
        simulation = self.simulation
        given = np.asarray(action, dtype=np.float64)
        if given.shape != self.action_space.shape or not np.isfinite(given).all():
            raise ConfigError(
                f"an action of shape {given.shape} is not {self.options.max_joints} finite numbers",
                "artsim/Articulated-v0",
                "pass one for each of max_joints; those beyond the object's joints move nothing",
            )
        limit = self._action_limit()
        simulation.step(np.clip(given[: len(limit)], -1.0, 1.0) * limit, self.options.control)
        self._steps += 1
        before, self._openness = self._openness, openness(simulation.obj, simulation.state)
        observation, info = self._look()
        return observation, self._openness - before, False, self._steps >= self.options.episode_length, info

    def _action_limit(self) -> Array:
        """(F,) effort or speed that 1 stands for."""
        simulation = self.simulation
        return simulation.effort_limit if self.options.control == "effort" else simulation.velocity_limit

    def _look(self) -> tuple[Observation, dict[str, Any]]:
        simulation, options = self.simulation, self.options
        obj, state = simulation.obj, simulation.state
        self.sample = observe(
            obj,
            state,
            self.camera,
            num_points=options.num_points,
            images=options.images,
            noise=options.noise,
            rng=self.np_random,
            index=self._steps,
        )
        record = pad_sample(self.sample, options.max_joints + 1)
        # Copies: what is handed out is the receiver's, whatever the object and the camera share.
        observation = {name: record[name].copy() for name in ("points", *options.images)}
        info: dict[str, Any] = {name: array.copy() for name, array in record.items()}
        velocity, limit = np.zeros(options.max_joints + 1), np.zeros(options.max_joints)
        velocity[: len(obj)] = simulation.velocity
        limit[: len(self._action_limit())] = self._action_limit()
        info |= {
            "time": self._steps * options.physics.control_step,
            "joint_velocity": velocity,
            "openness": self._openness,
            "action_valid": limit > 0,
            "action_limit": limit,
            "category": obj.category,
            "object_id": obj.object_id,
            "part_names": " ".join(self.sample.part_names),
        }
        return observation, info

    @property
    def camera(self) -> Camera:
        """Where the camera is now."""
        if self.options.camera == "fixed":
            return self._camera
        obj = self.simulation.obj
        center, _ = bounding_sphere(obj, _widest(obj))
        angle = np.deg2rad(self.options.orbit_speed) * self._steps * self.options.physics.control_step
        T_world_turned = np.eye(4)
        T_world_turned[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        T_world_turned[:3, 3] = center - T_world_turned[:3, :3] @ center
        return replace(self._camera, T_world_camera=T_world_turned @ self._camera.T_world_camera)

    def render(self) -> NDArray[np.uint8] | None:
        """(H, W, 3) picture of the object, if the environment was made with ``render_mode="rgb_array"``."""
        if self.render_mode is None:
            return None
        simulation = self.simulation
        return render(simulation.obj, simulation.state, self.camera, renderer="pybullet").rgb

    def close(self) -> None:
        """Free the physics world."""
        if self._simulation is not None:
            self._simulation.close()
            self._simulation = None


def openness(obj: ArticulatedObject, q: Array) -> float:
    """How far the object is open: mean over its free joints of the way from rest over the longest; 0 without joints."""
    free, rest = obj.tree.free_joints, obj.tree.rest
    longest = np.abs(joint_intervals(obj) - rest[:, None]).max(axis=1)
    return float(np.mean(np.abs(q - rest)[free] / np.maximum(longest[free], 1e-9))) if len(free) else 0.0


def _widest(obj: ArticulatedObject) -> Array:
    """(K,) of the rest state and the two ends of all joints, the one that takes the most room."""
    ends = joint_intervals(obj)
    states = [obj.tree.complete_state(q) for q in (obj.tree.rest, ends[:, 0], ends[:, 1])]
    return max(states, key=lambda q: bounding_sphere(obj, q)[1])
