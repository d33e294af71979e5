"""Episodes: an object of some source under physics, before a camera that stands or goes round it."""

from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal, cast

import numpy as np
import tyro
from numpy.typing import ArrayLike

from artsim.common.sequences import wrap_singles
from artsim.datasets.family_stream import STREAM_SEEDS
from artsim.errors import ConfigError
from artsim.loading.roots import PackageRoots
from artsim.loading.sources import FamilySource, Source, family_sources, find_sources
from artsim.model.camera import Camera
from artsim.model.draws import (
    Scale,
    StateOptions,
    ViewOptions,
    bounding_sphere,
    joint_intervals,
    sample_scale,
    sample_state,
    sample_view,
)
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import compose_transform
from artsim.observing.capture import observe
from artsim.observing.sample import Sample
from artsim.observing.sensor import find_sensor
from artsim.physics.options import Control, Engine, PhysicsOptions
from artsim.physics.world import Simulation


@dataclass(frozen=True)
class EpisodeOptions:
    """What an episode shows."""

    categories: tuple[str, ...] = ("drawer",)
    """Procedural categories, such as drawer: every episode has a new object of one, unless objects are named."""
    objects: tuple[Path, ...] = ()
    """URDF files, object folders, or folders of them: every episode has one of these."""
    package_root: PackageRoots = field(default_factory=dict)
    """Folders that package:// names of these files stand for, where they are not found as they are; repeatable."""
    obj: Annotated[ArticulatedObject | None, tyro.conf.Suppress] = None
    """The one object of every episode."""
    scale: Scale = "native"
    """Size of the object: native (as in its file), unit (diagonal of 1 m), or a range of diagonals in metres."""
    states: StateOptions = field(default_factory=lambda: StateOptions(mode="rest"))
    physics: PhysicsOptions = field(default_factory=PhysicsOptions)
    camera: Literal["fixed", "orbit"] = "fixed"
    """fixed: the camera stands still in an episode; orbit: it goes round the object."""
    orbit_speed: float = 20.0
    """Degrees per second, counter-clockwise seen from above."""
    views: ViewOptions = field(default_factory=lambda: ViewOptions(width=160, height=120))
    num_points: int = 1024
    """Points of each cloud."""
    images: tuple[Literal["depth", "part_mask"], ...] = ()
    """Images besides the cloud."""
    noise: Literal["none", "kinect_v1", "d435", "azure", "gaussian3mm"] = "none"
    """Depth sensor whose noise the cloud and the depth image carry; the ground truth never does."""

    def __post_init__(self) -> None:
        wrap_singles(self)
        if isinstance(self.physics, str):  # the name of an engine
            object.__setattr__(self, "physics", PhysicsOptions(engine=cast(Engine, self.physics)))
        if self.camera not in ("fixed", "orbit"):
            raise ConfigError(f"there is no camera motion {self.camera!r}", "camera", "use fixed or orbit")
        unknown = set(self.images) - {"depth", "part_mask"}
        if unknown:
            raise ConfigError(f"there is no image {', '.join(sorted(unknown))}", "images", "use depth, part_mask")
        find_sensor(self.noise)
        if self.num_points < 1:
            raise ConfigError(f"{self.num_points} is not a count", "num_points", "use 1 or more")


class Episode:
    """One episode at a time; each begins with :meth:`begin`.

    The camera is placed so that the object fits its image in every state.

    Parameters
    ----------
    options : EpisodeOptions

    Attributes
    ----------
    steps : int
        Control steps since the episode began.

    Raises
    ------
    ConfigError, AssetError
        When there is no such category, or no object.
    """

    def __init__(self, options: EpisodeOptions):
        self.options, self.steps = options, 0
        self._sources: list[Source] = []
        if options.obj is None:
            named = find_sources(options.objects, options.package_root)
            self._sources = [*named] if options.objects else [*family_sources(options.categories, 1)]
        self._load = lru_cache(maxsize=16)(lambda number: self._sources[number].load())
        self._simulation: Simulation | None = None

    @property
    def simulation(self) -> Simulation:
        """Physics of the current episode.

        Raises
        ------
        ConfigError
            Before the first :meth:`begin`.
        """
        if self._simulation is None:
            raise ConfigError(
                "no episode has begun", "artsim.physics.episode", "begin one first: reset() of an environment"
            )
        return self._simulation

    @property
    def obj(self) -> ArticulatedObject:
        """The object of the current episode."""
        return self.simulation.obj

    @property
    def time(self) -> float:
        """Seconds since the episode began."""
        return self.steps * self.options.physics.control_step

    def draw_object(self, rng: np.random.Generator, category: str | None = None) -> ArticulatedObject:
        """An object for a new episode; of a procedural category, if one is named, a new one of that.

        Raises
        ------
        ConfigError
            When there is no such category.
        """
        obj = self.options.obj
        if category is not None:
            obj = family_sources((category,), 1, int(rng.integers(*STREAM_SEEDS)))[0].load()
        elif obj is None:
            number = int(rng.integers(len(self._sources)))
            source = self._sources[number]
            if isinstance(source, FamilySource):
                obj = replace(source, seed=int(rng.integers(*STREAM_SEEDS))).load()
            else:
                obj = self._load(number)
        return sample_scale(obj, self.options.scale, rng)

    def begin(self, obj: ArticulatedObject, rng: np.random.Generator, state: Array | None = None) -> None:
        """Begin an episode with this object; ``rng`` draws its state, unless one (K,) is given, and the camera."""
        if self._simulation is None or self._simulation.obj is not obj:
            self.close()
            self._simulation = Simulation(obj, self.options.physics)
        drawn = sample_state(obj, self.options.states, rng)
        self._simulation.reset(drawn if state is None else state)
        self.steps = 0
        self._camera = sample_view(obj, most_open_state(obj), self.options.views, rng)

    def step(self, action: ArrayLike, control: Control) -> None:
        """One control step; see :meth:`Simulation.step`."""
        self.simulation.step(action, control)
        self.steps += 1

    @property
    def camera(self) -> Camera:
        """Where the camera is now."""
        obj = self.obj
        if self.options.camera == "fixed":
            return self._camera
        center, _ = bounding_sphere(obj, most_open_state(obj))
        angle = np.deg2rad(self.options.orbit_speed) * self.time
        turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        T_world_turned = compose_transform(center - turn @ center, turn)
        return replace(self._camera, T_world_camera=T_world_turned @ self._camera.T_world_camera)

    def look(self, rng: np.random.Generator, seed: int = -1) -> Sample:
        """What the camera sees now; ``index`` of the sample counts the control steps."""
        return observe(
            self.obj,
            self.simulation.state,
            self.camera,
            num_points=self.options.num_points,
            images=self.options.images,
            noise=self.options.noise,
            rng=rng,
            seed=seed,
            index=self.steps,
        )

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


def most_open_state(obj: ArticulatedObject) -> Array:
    """(K,) of the rest state and the two ends of all joints, the one that takes the most room."""
    ends = joint_intervals(obj)
    states = [obj.tree.complete_state(q) for q in (obj.tree.rest, ends[:, 0], ends[:, 1])]
    return max(states, key=lambda q: bounding_sphere(obj, q)[1])
