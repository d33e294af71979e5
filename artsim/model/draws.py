"""The pose distribution: joint states, viewpoints and object scale, each drawn from an explicit generator."""

import fnmatch
import importlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from artsim.common.elementary import cos, sin, tan
from artsim.common.products import apply, norm
from artsim.errors import ConfigError
from artsim.model.camera import Camera
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject

ViewSampler = Callable[[np.random.Generator, ArticulatedObject, Array], Camera]
"""Draws a camera for an object (in its rest frame, which is the world) in joint state q."""


StateMode = Literal["uniform", "rest", "limits", "mixed"]


@dataclass(frozen=True)
class StateOptions:
    """How joint states are drawn. A continuous joint counts as limited to half a turn either way."""

    mode: StateMode = "uniform"
    """uniform: anywhere within the limits; rest: the rest state; limits: each joint at one end or the other; mixed:
    each object in one of these ways by chance, every other one anywhere, a quarter at rest."""
    fraction_open: tuple[float, float] | None = None
    """Instead of the mode: open each joint by a fraction, drawn from this range, of the way from its rest state to its
    farther limit (0 = at rest, 1 = fully open)."""
    joint_range: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    """Range in radians or metres for joints whose name, or whose part's label, matches a pattern such as 'lid' or
    'drawer*'. Cut to the limits; overrides the other options for those joints."""

    def __post_init__(self) -> None:
        if self.fraction_open is not None and not 0.0 <= self.fraction_open[0] <= self.fraction_open[1] <= 1.0:
            raise ConfigError(f"{self.fraction_open} is not a range within 0..1", "fraction_open", "write 0.2 0.8")
        for pattern, (low, high) in self.joint_range.items():
            if not low <= high:
                raise ConfigError(f"{low} to {high} is not a range", f"joint_range {pattern!r}", "write LOW HIGH")


ViewPreset = Literal["artimage", "sphere", "mixed"]


@dataclass(frozen=True)
class ViewOptions:
    """From where, and with which camera, objects are seen."""

    preset: ViewPreset = "artimage"
    """artimage: azimuth within 75 deg of the front, elevation 10 to 60 deg; sphere: all round, elevation -10 to 85;
    mixed: each view as one or the other, by chance."""
    azimuth: tuple[float, float] | None = None
    """Range in degrees about the vertical, 0 = in front of the object, 90 = from its right (its -Y side); overrides
    the preset."""
    elevation: tuple[float, float] | None = None
    """Range in degrees above the horizon; overrides the preset."""
    fill: tuple[float, float] = (0.7, 0.98)
    """Range of the object's bounding sphere over the smaller side of the image: sets the distance."""
    width: int = 640
    height: int = 480
    fov: float = 45.0
    """Vertical field of view in degrees."""
    custom: str | None = None
    """Your 'module:function' that draws the camera: function(rng, obj, q) -> artsim.Camera."""

    def __post_init__(self) -> None:
        for name, bounds in (("azimuth", self.azimuth), ("elevation", self.elevation), ("fill", self.fill)):
            if bounds is not None and not bounds[0] <= bounds[1]:
                raise ConfigError(f"{bounds[0]} to {bounds[1]} is not a range", name, "write LOW HIGH")
        if not 0.0 < self.fill[0] <= self.fill[1] <= 4.0:
            raise ConfigError(f"{self.fill} is not a range within 0..4", "fill", "write 0.7 0.98")
        if not (0 < self.width <= 8192 and 0 < self.height <= 8192):
            raise ConfigError(f"images of {self.width}x{self.height} are not made", "width, height", "use 1 to 8192")
        if not 1.0 <= self.fov <= 170.0:
            raise ConfigError(f"a field of view of {self.fov} deg is not within 1..170", "fov", "write 45")

    def draw_directions(self, rng: np.random.Generator, count: int | None = None) -> tuple[Array, Array]:
        """Azimuths and elevations in radians, (count,) each; of a single view, without a count."""
        names = list(_DIRECTIONS)
        number = rng.integers(len(names), size=count) if self.preset == "mixed" else names.index(self.preset)
        azimuth, elevation = (np.array([_DIRECTIONS[name][angle] for name in names])[number].T for angle in range(2))
        low, high = azimuth if self.azimuth is None else self.azimuth
        azimuths = rng.uniform(low, high, count)
        low, high = elevation if self.elevation is None else self.elevation
        return np.deg2rad(azimuths), np.deg2rad(rng.uniform(low, high, count))


_DIRECTIONS = {"artimage": ((-75.0, 75.0), (10.0, 60.0)), "sphere": ((-180.0, 180.0), (-10.0, 85.0))}
"""Ranges of azimuth and elevation, degrees; mixed is any of these."""

Scale = Literal["native", "unit"] | tuple[float, float]
"""native: as the file has it; unit: diagonal of 1 m; or a range of diagonals in metres."""


def joint_intervals(obj: ArticulatedObject) -> Array:
    """(K, 2) range that each joint state is drawn from: its limits, half a turn either way where it has none."""
    limits, rest = obj.tree.limits, obj.tree.rest
    turn = np.stack([rest - np.pi, rest + np.pi], axis=1)
    return np.where(np.isfinite(limits), limits, turn)


def farther_ends(obj: ArticulatedObject) -> Array:
    """(K,) the end of each joint's interval that is farther from rest."""
    rest, (low, high) = obj.tree.rest, joint_intervals(obj).T
    return np.where(high - rest >= rest - low, high, low)


def sample_state(
    obj: ArticulatedObject, options: StateOptions | None = None, rng: np.random.Generator | None = None
) -> Array:
    """Draw joint states.

    Parameters
    ----------
    obj : ArticulatedObject
    options : StateOptions, optional
        By default, anywhere within the limits.
    rng : numpy Generator, optional
        Seeded with 0 by default: the same state each time.

    Returns
    -------
    (K,) float
        Complete state, mimic joints set; radians or metres at the object's scale.
    """
    rng = rng or np.random.default_rng(0)
    return states_at(obj, options or StateOptions(), rng.random(len(obj.tree)))


def states_at(obj: ArticulatedObject, options: StateOptions, draw: Array) -> Array:
    """The joint states that numbers drawn uniformly from [0, 1) stand for; see :func:`sample_state`.

    Parameters
    ----------
    obj : ArticulatedObject
    options : StateOptions
    draw : (..., K) float

    Returns
    -------
    (..., K) float
    """
    tree, intervals = obj.tree, joint_intervals(obj)
    low, high = intervals.T
    if options.fraction_open is not None:
        far = np.where(high - tree.rest >= tree.rest - low, high, low)
        start, end = options.fraction_open
        q = tree.rest + (start + draw * (end - start)) * (far - tree.rest)
    else:
        q = _in_mode(options.mode, draw, low, high, tree.rest)
    for pattern, bounds in options.joint_range.items():
        for k in tree.free_joints:
            if fnmatch.fnmatchcase(tree.joints[k].name, pattern) or fnmatch.fnmatchcase(obj.parts[k].label, pattern):
                first, last = np.clip(bounds, low[k], high[k])
                q[..., k] = first + draw[..., k] * (last - first)
    return tree.complete_state(q)


def _in_mode(mode: StateMode, draw: Array, low: Array, high: Array, rest: Array) -> Array:
    if mode == "rest":
        return np.broadcast_to(rest, draw.shape).copy()
    if mode == "limits":
        return np.where(draw < 0.5, low, high)
    if mode == "mixed":
        anywhere, at_rest, at_end = (_in_mode(m, draw, low, high, rest) for m in ("uniform", "rest", "limits"))
        kind = draw[..., :1]  # the root has no joint to draw a state for
        return np.where(kind < 0.5, anywhere, np.where(kind < 0.75, at_rest, at_end))
    uniform: Array = low + draw * (high - low)
    return uniform


def sample_scale(obj: ArticulatedObject, scale: Scale, rng: np.random.Generator) -> ArticulatedObject:
    """The object at a drawn size; lengths of joint states change with it, so draw the size first."""
    if scale == "native":
        return obj
    if scale == "unit":
        return obj.with_diagonal(1.0)
    low, high = scale
    return obj.with_diagonal(low + float(rng.random()) * (high - low))


def sample_view(
    obj: ArticulatedObject,
    q: ArrayLike,
    options: ViewOptions | None = None,
    rng: np.random.Generator | None = None,
) -> Camera:
    """Draw a camera that looks at the posed object from a distance at which it fits the image.

    Parameters
    ----------
    obj : ArticulatedObject
        Stands with its rest frame on the world's.
    q : (K,) float
    options : ViewOptions, optional
    rng : numpy Generator, optional
        Seeded with 0 by default.
    """
    options, rng = options or ViewOptions(), rng or np.random.default_rng(0)
    if options.custom is not None:
        return view_sampler(options.custom)(rng, obj, np.asarray(q, dtype=np.float64))
    return sphere_view(*bounding_sphere(obj, q), options, rng)


def sphere_view(center: Array, radius: float, options: ViewOptions, rng: np.random.Generator) -> Camera:
    """Draw a camera that looks at a sphere, centre (3,) and radius in metres, from where it fits the image."""
    azimuth, elevation = options.draw_directions(rng)
    fill = rng.uniform(*options.fill)
    fov_y = np.deg2rad(options.fov)
    distance = radius / half_width(options, fill)
    level = cos(elevation)
    away = np.array([-cos(azimuth) * level, -sin(azimuth) * level, sin(elevation)])
    return Camera.look_at(center + distance * away, center, options.width, options.height, fov_y)


def half_width(options: ViewOptions, fill: ArrayLike) -> Array:
    """Sine of the angle between the optical axis and a bounding sphere that fills so much of the image."""
    half_side = tan(0.5 * np.deg2rad(options.fov)) * min(1.0, options.width / options.height)
    across = np.asarray(fill, dtype=np.float64) * half_side
    sine: Array = across / np.sqrt(1.0 + across * across)
    return sine


def bounding_sphere(obj: ArticulatedObject, q: ArrayLike) -> tuple[Array, float]:
    """Centre (3,) and radius of a sphere around the posed object, from its parts' boxes, rest frame, metres."""
    bottom, top = posed_bounds(obj, q)
    return 0.5 * (bottom + top), 0.5 * float(norm(top - bottom))


def posed_bounds(obj: ArticulatedObject, q: ArrayLike) -> tuple[Array, Array]:
    """Lower and upper corners (..., 3) of a box around the posed object in states (..., K), rest frame, metres."""
    low, high = obj.part_bounds[:, 0], obj.part_bounds[:, 1]
    T = obj.tree.forward_kinematics(q)
    center = apply(T[..., :3, :3], 0.5 * (low + high)) + T[..., :3, 3]
    reach = apply(np.abs(T[..., :3, :3]), 0.5 * (high - low))
    return (center - reach).min(axis=-2), (center + reach).max(axis=-2)


def view_sampler(name: str) -> ViewSampler:
    """The function that 'module:function' names.

    Raises
    ------
    ConfigError
        When it cannot be imported.
    """
    module, _, function = name.partition(":")
    try:
        sampler = getattr(importlib.import_module(module), function)
    except (ImportError, AttributeError, ValueError) as error:
        raise ConfigError(f"cannot import {name!r} ({error})", "views.custom", "write module:function") from error
    if not callable(sampler):
        raise ConfigError(f"{name!r} is not a function", "views.custom", "write module:function")
    return sampler
