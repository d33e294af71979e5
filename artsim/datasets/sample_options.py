"""What one sample looks like, and how it is drawn: its size, joint states and view, from (seed, index) alone."""

import contextlib
import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from artsim.common.sharding import Shared
from artsim.errors import ConfigError, RenderError
from artsim.model.draws import Scale, StateOptions, ViewOptions, sample_scale, sample_state, sample_view
from artsim.model.objects import ArticulatedObject
from artsim.observing.capture import observe
from artsim.observing.padding import refuse_collation
from artsim.observing.sample import Sample
from artsim.renderers import Renderer, RendererName, make_renderer

_VIEW_ATTEMPTS = 50
_SEEN_OFTEN_ENOUGH = 3

PLANNED_ATTEMPTS = 1000
"""Views drawn for a sample of a dataset, whose objects were all seen by three of fifty at least."""

ImageName = Literal["depth", "part_mask", "rgb"]
SensorName = Literal["none", "kinect_v1", "d435", "azure", "gaussian3mm"]


@dataclass(frozen=True)
class SampleOptions:
    """What one sample looks like."""

    num_points: int = 2048
    """Points of each cloud."""
    scale: Scale = "native"
    """Size of the object: native (as in its file), unit (diagonal of 1 m), or a range of diagonals in metres."""
    states: StateOptions = field(default_factory=StateOptions)
    views: ViewOptions = field(default_factory=ViewOptions)
    renderer: RendererName = "raycast"
    """raycast needs nothing installed; the others need the extra 'pybullet', 'sapien' or 'warp'."""
    images: tuple[ImageName, ...] = ()
    """Images to keep beside the cloud; rgb needs sapien or pybullet."""
    noise: SensorName = "none"
    """Depth sensor whose noise the cloud and the depth image carry; the ground truth never does."""

    details: bool = False
    """Say of each point which handle, knob, button, pane or display it is on."""

    def __post_init__(self) -> None:
        if not 1 <= self.num_points <= 1_000_000:
            raise ConfigError(f"clouds of {self.num_points} points are not made", "num_points", "use 1 to 1000000")
        if not isinstance(self.scale, str) and not 0.0 < self.scale[0] <= self.scale[1]:
            raise ConfigError(f"{self.scale} is not a range of diagonals", "scale", "write LOW HIGH in metres")
        if "rgb" in self.images and self.renderer in ("raycast", "warp"):
            raise ConfigError(f"{self.renderer} makes no rgb", "images", "add --renderer sapien or pybullet")


def draw_sample(
    obj: ArticulatedObject,
    options: SampleOptions,
    seed: int,
    index: int,
    renderer: Renderer,
    attempts: int = _VIEW_ATTEMPTS,
) -> Sample:
    """The sample that (seed, index) stands for, of this object.

    Raises
    ------
    RenderError
        When so many drawn views in a row do not see the object.
    """
    rng = np.random.default_rng([seed, index])
    sized = sample_scale(obj, options.scale, rng)
    for _ in range(attempts):
        q = sample_state(sized, options.states, rng)
        camera = sample_view(sized, q, options.views, rng)
        try:
            return observe(
                sized, q, camera, num_points=options.num_points, renderer=renderer, images=options.images,
                noise=options.noise, rng=rng, seed=seed, index=index, details=options.details,
            )  # fmt: skip
        except RenderError:
            continue  # out of sight: draw another view
    raise RenderError(
        f"{attempts} drawn views in a row do not see the object",
        f"{obj.object_id}, sample {index}",
        "correct the view options",
    )


def check_visible(obj: ArticulatedObject, options: SampleOptions, seed: int, identity: str) -> None:
    """Refuse an object that the views hardly ever see, before a dataset is planned with it.

    Rays alone decide, so that the answer is the same for every renderer. An object that three of fifty views see passes
    by mistake once in a million; :data:`PLANNED_ATTEMPTS` views in a row then miss it no more often.

    Parameters
    ----------
    obj : ArticulatedObject
    options : SampleOptions
    seed : int
    identity : str
        Hex digest: the views tried depend on it and on the seed alone.

    Raises
    ------
    RenderError
    """
    rng = np.random.default_rng([seed, int(identity[:16], 16)])
    seen = 0
    for _ in range(_VIEW_ATTEMPTS):
        sized = sample_scale(obj, options.scale, rng)
        q = sample_state(sized, options.states, rng)
        camera = sample_view(sized, q, options.views, rng)
        with contextlib.suppress(RenderError):
            observe(sized, q, camera, num_points=16, noise=options.noise, rng=rng)
            seen += 1
        if seen == _SEEN_OFTEN_ENOUGH:
            return
    raise RenderError(
        f"{seen} of {_VIEW_ATTEMPTS} drawn views see the object", fix="correct the view options, or the object"
    )


class DrawnStream(Shared):
    """An endless source of samples: sample ``i`` is made when asked for, and is always the same.

    It shows object ``i // views_per_object``. Iterating yields all samples of the objects ``start``, ``start + step``,
    ... Workers of a torch ``DataLoader``, and processes of its process group, share the objects out by themselves;
    other processes need a ``start`` of their own and a common ``step``. Indexing makes any one.
    """

    def __init__(self, options: SampleOptions, seed: int, views_per_object: int, start: int, step: int):
        if min(seed, start) < 0 or min(views_per_object, step) < 1:
            raise ConfigError(
                f"a stream has no seed {seed}, {views_per_object} views per object, start {start}, step {step}",
                fix="count from 0 upwards; views and step from 1",
            )
        self.options, self.seed, self.views_per_object = options, seed, views_per_object
        self.start, self.step = start, step
        self._renderer: Renderer | None = None

    def object(self, n: int) -> ArticulatedObject:
        """Object number ``n``, which samples ``n * views_per_object`` and on show."""
        raise NotImplementedError

    def __getitem__(self, i: int) -> Sample:
        if i < 0:
            raise IndexError(f"sample {i} of an endless stream")
        if self._renderer is None:
            self._renderer = make_renderer(self.options.renderer)
        return draw_sample(self.object(i // self.views_per_object), self.options, self.seed, i, self._renderer)

    def __iter__(self) -> Iterator[Sample]:
        refuse_collation()
        share, shares = self._share()
        for n in itertools.count(self.start + share * self.step, shares * self.step):
            for view in range(self.views_per_object):
                yield self[n * self.views_per_object + view]
