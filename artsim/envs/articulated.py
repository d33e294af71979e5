"""``artsim/Articulated-v0``: an articulated object under physics, seen by a depth camera.

::

    import gymnasium
    import artsim.envs

    env = gymnasium.make("artsim/Articulated-v0", categories=("laptop", "drawer"), images=("depth",))
    observation, info = env.reset(seed=0)
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.utils import RecordConstructorArgs
from numpy.typing import ArrayLike, NDArray

from artsim.errors import ConfigError
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.observing.annotation import shade_parts
from artsim.observing.padding import pad_sample
from artsim.observing.sample import Sample
from artsim.physics.episode import Episode, EpisodeOptions, openness
from artsim.physics.options import Control
from artsim.physics.world import Simulation
from artsim.renderers import render

EPISODE_LENGTH = 100
"""Control steps, by default."""

Observation = dict[str, NDArray[Any]]


def _complete(obj: ArticulatedObject, state: ArrayLike) -> Array:
    """A state (K,) within limits, with joints that follow others where they have to be.

    Raises
    ------
    ConfigError
        When it is no state of the object.
    """
    q = np.asarray(state, dtype=np.float64)
    if q.shape != (len(obj),) or not np.isfinite(q).all():
        raise ConfigError(f"shape {q.shape} is no state of {len(obj)} parts", "options: state", f"pass ({len(obj)},)")
    low, high = obj.tree.limits.T
    if ((q < low - 1e-9) | (q > high + 1e-9)).any():
        joint = int(np.argmax((q < low - 1e-9) | (q > high + 1e-9)))
        reach = f"{low[joint]:.3g} to {high[joint]:.3g}"
        raise ConfigError(f"joint {joint} cannot be at {q[joint]:.3g}", "options: state", f"use {reach}")
    return obj.tree.complete_state(q)


@dataclass(frozen=True)
class EnvOptions(EpisodeOptions):
    """What an episode shows, and how it is played."""

    control: Control = "effort"
    """What actions are: effort or velocity."""
    max_joints: int = 16
    """Entries of an action, and joints of the largest object."""
    episode_length: int | None = None
    """Control steps. By default 100, or what ``max_episode_steps`` of ``gymnasium.make`` says."""

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.control not in ("effort", "velocity"):
            raise ConfigError(f"there is no control {self.control!r}", "control", "use effort or velocity")
        for name in ("max_joints", "episode_length"):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise ConfigError(f"{value} is not a count", name, "use 1 or more")


class ObeyTimeLimit(gymnasium.Wrapper[Any, Any, Any, Any], RecordConstructorArgs):
    """Lets ``max_episode_steps`` of ``gymnasium.make`` hold instead of the length that episodes have by default."""

    def __init__(self, env: gymnasium.Env[Any, Any]):
        RecordConstructorArgs.__init__(self)
        super().__init__(env)
        own = env.unwrapped
        assert isinstance(own, ArticulatedEnv)
        if env.spec is not None and env.spec.max_episode_steps is not None and own.options.episode_length is None:
            own.length = None


class ArticulatedEnv(gymnasium.Env[Observation, Any]):
    """An object whose joints are driven, and what a depth camera sees of it.

    An **action** is one number in [-1, 1] for each joint that can be chosen (``obj.tree.free_joints``, in order): the
    share of its effort limit, or, under velocity control, of its velocity limit. Further entries move nothing. An
    **observation** holds ``points`` (N, 3), the partial cloud in the camera frame in metres, and the images asked for:
    ``depth`` (H, W) in metres, 0 = no return, ``part_mask`` (H, W), 255 = background. The **info** is the whole ground
    truth: the record as :func:`artsim.observing.padding.pad_sample` writes it, with P = ``max_joints + 1`` rows, and

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

    length: int | None
    """Control steps of an episode; None where only a wrapper ends it."""
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
        self.episode, self.length = Episode(self.options), self.options.episode_length or EPISODE_LENGTH
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

    def reset(
        self, *, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode: a new object, its state, and a camera.

        Parameters
        ----------
        seed : int, optional
        options : mapping, optional
            ``category``: the episode has a new object of this procedural category. ``object``: it has this
            ArticulatedObject. ``state`` (K,): it begins in this state, radians and metres; 0 for the root.

        Returns
        -------
        observation, info : dict

        Raises
        ------
        ConfigError
            When an option is unknown or makes no sense.
        """
        super().reset(seed=seed)
        given = dict(options or {})
        category, obj, state = (given.pop(name, None) for name in ("category", "object", "state"))
        if given:
            unknown = ", ".join(sorted(map(str, given)))
            raise ConfigError(f"reset has no option {unknown}", "options", "use category, object, state")
        if category is not None and obj is not None:
            raise ConfigError("an episode has one object", "options", "name a category or an object")
        if obj is None:
            obj = self.episode.draw_object(self.np_random, category)
        if len(obj) - 1 > self.options.max_joints:
            raise ConfigError(
                f"has {len(obj) - 1} joints, more than {self.options.max_joints}",
                f"{obj.category} {obj.object_id}",
                f"set max_joints={len(obj) - 1} or more",
            )
        self.episode.begin(obj, self.np_random, None if state is None else _complete(obj, state))
        self._openness = openness(obj, self.simulation.state)
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
        given = np.asarray(action, dtype=np.float64)
        if given.shape != self.action_space.shape or not np.isfinite(given).all():
            raise ConfigError(
                f"an action of shape {given.shape} is not {self.options.max_joints} finite numbers",
                "artsim/Articulated-v0",
                "pass one for each of max_joints; those beyond the object's joints move nothing",
            )
        limit = self._action_limit()
        self.episode.step(np.clip(given[: len(limit)], -1.0, 1.0) * limit, self.options.control)
        before, self._openness = self._openness, openness(self.episode.obj, self.simulation.state)
        observation, info = self._look()
        truncated = self.length is not None and self.episode.steps >= self.length
        return observation, self._openness - before, False, truncated, info

    @property
    def simulation(self) -> Simulation:
        """Physics of the current episode."""
        return self.episode.simulation

    def _action_limit(self) -> Array:
        """(F,) effort or speed that 1 stands for."""
        simulation = self.simulation
        return simulation.effort_limit if self.options.control == "effort" else simulation.velocity_limit

    def _look(self) -> tuple[Observation, dict[str, Any]]:
        simulation, options = self.simulation, self.options
        obj, self.sample = simulation.obj, self.episode.look(self.np_random)
        record = pad_sample(self.sample, options.max_joints + 1, float32=False)
        # Copies: what is handed out is the receiver's, whatever the object and the camera share.
        observation = {name: record[name].copy() for name in ("points", *options.images)}
        info = {name: array.copy() if isinstance(array, np.ndarray) else array for name, array in record.items()}
        velocity, limit = np.zeros(options.max_joints + 1), np.zeros(options.max_joints)
        velocity[: len(obj)] = simulation.velocity
        limit[: len(self._action_limit())] = self._action_limit()
        info |= {
            "time": self.episode.time,
            "joint_velocity": velocity,
            "openness": self._openness,
            "action_valid": limit > 0,
            "action_limit": limit,
            "part_names": " ".join(self.sample.part_names),
        }
        return observation, info

    def render(self) -> NDArray[np.uint8] | None:
        """(H, W, 3) picture, a colour for each part, if the environment was made with ``render_mode="rgb_array"``."""
        if self.render_mode is None:
            return None
        episode, camera = self.episode, self.episode.camera
        return shade_parts(render(episode.obj, episode.simulation.state, camera), camera)

    def close(self) -> None:
        """Free the physics world."""
        self.episode.close()
