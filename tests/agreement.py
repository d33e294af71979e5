"""How closely two renderers agree, and why they differ at a pixel.

Every pixel falls into the first class that applies to it.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, maximum_filter, minimum_filter

from artsim import make_renderer
from artsim.families import FAMILIES
from artsim.loading.sources import Source, family_sources, find_sources
from artsim.model.camera import Camera
from artsim.model.draws import StateOptions, ViewOptions, sample_state, sample_view
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.renderers import Renderer
from artsim.renderers.raycast import pose, render_posed

LIMITS = {
    "warp": (0.005, 0.1, 0.999),
    "sapien": (0.005, 0.1, 0.999),
    "pybullet-egl": (0.05, 1.0, 0.998),
    "pybullet": (1.5, 1.0, 0.99),
}
"""What is asked of each renderer: at most this median, and 99.9th percentile away from edges, of the depth differences
in mm; at least this share of equal part ids."""

DIFFERENCE_MM = 1.0
"""Of depth that counts."""

Scene = tuple[ArticulatedObject, Array, Camera]
"""A sized object, its joint states and the camera that looks at it."""
Mask = NDArray[np.bool_]

CLASSES = {
    "coincident surfaces": "two parts' surfaces lie within 0.1 mm of each other: rounding chooses",
    "sliver": "a part or a gap thinner than 3 px: whether a pixel's centre meets it is rounding",
    "silhouette": "within 2 px of the object's outline: the pixel's centre falls on either side",
    "edge": "within 2 px of a part's border, a step or a crease",
    "grazing": "seen at more than 80 deg: a fraction of a pixel is a long way along the ray",
    "unexplained": "none of these",
}
"""Classes of pixels, and why renderers differ there."""

_REACH = 2  # pixels about an edge
_JUMP = 2e-3  # metres between neighbouring pixels, beyond the local slope: a step
_COINCIDENT = 1e-4  # metres
_GRAZING = np.tan(np.deg2rad(80.0))


def classify(scene: Scene, rays: Frame, other: Frame) -> dict[str, Mask]:
    """Pixels of each class: (H, W) each, every pixel in one of them.

    Parameters
    ----------
    scene : Scene
    rays : Frame
        By the ray caster.
    other : Frame
        By another renderer.
    """
    found = {
        "coincident surfaces": coincident_parts(*scene, rays, other),
        "sliver": slivers(rays) | slivers(other),
        "silhouette": near_outline(rays) | near_outline(other),
        "edge": near_edge(rays) | near_edge(other),
        "grazing": grazing(rays, scene[2]),
        "unexplained": np.ones(rays.depth.shape, dtype=bool),
    }
    left = np.ones(rays.depth.shape, dtype=bool)
    for name in CLASSES:
        found[name] &= left
        left &= ~found[name]
    return found


def near_edge(frame: Frame) -> Mask:
    """(H, W) pixels within 2 px of a part's border or of a jump in depth."""
    ids, depth = frame.part_ids, frame.depth
    edge = np.zeros(ids.shape, dtype=bool)
    for first, second in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        step = np.abs(depth[first] - depth[second])
        border = (ids[first] != ids[second]) | (step > _JUMP + 0.02 * depth[first])
        edge[first] |= border
        edge[second] |= border
    # A smooth slope has equal steps either side; a thin gap or sliver does not.
    bend = np.zeros(ids.shape, dtype=bool)
    bend[1:-1] |= np.abs(depth[2:] - 2 * depth[1:-1] + depth[:-2]) > _JUMP
    bend[:, 1:-1] |= np.abs(depth[:, 2:] - 2 * depth[:, 1:-1] + depth[:, :-2]) > _JUMP
    return binary_dilation(edge | bend, iterations=_REACH)


def near_outline(frame: Frame) -> Mask:
    """(H, W) pixels within 2 px of where the object ends and the background begins."""
    shown = frame.part_ids != BACKGROUND
    return binary_dilation(shown, iterations=_REACH) & binary_dilation(~shown, iterations=_REACH)


def slivers(frame: Frame) -> Mask:
    """(H, W) pixels that no 3x3 window of one part, or of background, contains."""
    ids = frame.part_ids
    uniform = minimum_filter(ids, 3) == maximum_filter(ids, 3)
    return ~binary_dilation(uniform, np.ones((3, 3), dtype=bool))


def grazing(frame: Frame, camera: Camera) -> Mask:
    """(H, W) pixels at which the surface is seen at more than 80 deg from its normal, by the slope of the depth."""
    depth = frame.depth.astype(np.float64)
    across = np.zeros_like(depth)
    for axis, focal in ((0, camera.K[1, 1]), (1, camera.K[0, 0])):
        step = np.abs(np.diff(depth, axis=axis)) * focal
        before = np.concatenate([step.take([0], axis), step], axis)
        after = np.concatenate([step, step.take([-1], axis)], axis)
        across += np.minimum(before, after) ** 2  # the smaller: the larger may be a step
    grazes: Mask = (depth > 0) & (np.sqrt(across) > _GRAZING * depth)
    return grazes


def coincident_parts(obj: ArticulatedObject, q: Array, camera: Camera, rays: Frame, other: Frame) -> Mask:
    """(H, W) pixels at which the two parts that the renderers show lie at the same depth."""
    differ = (rays.part_ids != other.part_ids) & (rays.part_ids != BACKGROUND) & (other.part_ids != BACKGROUND)
    apart = np.full(rays.depth.shape, np.inf)
    posed = pose(obj, q, camera)
    for k in np.unique(other.part_ids[differ]):
        alone = render_posed(posed, only=int(k)).depth
        theirs = differ & (other.part_ids == k) & (alone > 0)
        apart[theirs] = np.abs(alone - rays.depth)[theirs]
    return apart < _COINCIDENT


@dataclass
class Agreement:
    """Differences between two renderers, over any number of images."""

    depth_mm: list[NDArray[np.float64]] = field(default_factory=list)
    inner_mm: list[NDArray[np.float64]] = field(default_factory=list)
    object_pixels: int = 0
    ids_differ: Counter[str] = field(default_factory=Counter)
    """By class, pixels at which another part is shown, or a part and none."""
    depth_off: Counter[str] = field(default_factory=Counter)
    """By class, pixels of the same part whose depths are more than 1 mm apart."""

    def add(self, scene: Scene, rays: Frame, other: Frame) -> None:
        """Take in one image."""
        shown = (rays.part_ids != BACKGROUND) | (other.part_ids != BACKGROUND)
        same = (rays.part_ids == other.part_ids) & (rays.part_ids != BACKGROUND)
        error = 1e3 * np.abs(rays.depth.astype(np.float64) - other.depth)
        self.depth_mm.append(error[same])
        self.inner_mm.append(error[same & ~near_edge(rays) & ~near_edge(other)])
        self.object_pixels += int(shown.sum())
        differ, off = shown & ~same, same & (error > DIFFERENCE_MM)
        if differ.any() or off.any():
            for name, pixels in classify(scene, rays, other).items():
                self.ids_differ[name] += int((differ & pixels).sum())
                self.depth_off[name] += int((off & pixels).sum())

    def merge(self, more: Agreement) -> None:
        """Take in the images of another."""
        self.depth_mm += more.depth_mm
        self.inner_mm += more.inner_mm
        self.object_pixels += more.object_pixels
        self.ids_differ += more.ids_differ
        self.depth_off += more.depth_off

    def summary(self) -> dict[str, float]:
        """Median and 99.9th percentile in mm, and the share of equal part ids."""
        inner = np.concatenate(self.inner_mm)
        return {
            "median_mm": float(np.median(np.concatenate(self.depth_mm))),
            "p999_mm": float(np.percentile(inner, 99.9)) if len(inner) else 0.0,
            "part_ids_equal": 1.0 - self.ids_differ.total() / self.object_pixels,
        }

    def agrees(self, limits: tuple[float, float, float]) -> bool:
        """Whether this is within limits as in :data:`LIMITS`."""
        median, percentile, share = self.summary().values()
        return median < limits[0] and percentile < limits[1] and share >= limits[2]


def compare(scenes: Sequence[Scene], renderer: Renderer) -> Agreement:
    """Agreement of a renderer with the ray caster over some scenes."""
    rays = make_renderer("raycast")
    agreement = Agreement()
    for scene in scenes:
        agreement.add(scene, rays.render(*scene), renderer.render(*scene))
    return agreement


def draw_scenes(obj: ArticulatedObject, states: int, views: int, seed: int) -> list[Scene]:
    """Random states and views of an object made 1 m large."""
    rng, obj = np.random.default_rng(seed), obj.with_diagonal(1.0)
    scenes = []
    for _ in range(states):
        q = sample_state(obj, StateOptions(), rng)
        scenes += [(obj, q, sample_view(obj, q, ViewOptions(preset="sphere"), rng)) for _ in range(views)]
    return scenes


def choose(partnet: Path, count: int) -> list[Source]:
    """Real objects spread over all categories: the first of each, then the second, and so on."""
    by_category: dict[str, list[Source]] = {}
    for source in find_sources([partnet]) if count else ():
        by_category.setdefault(source.name.split("/")[1], []).append(source)
    return _in_turn(list(by_category.values()), count)


def choose_procedural(count: int) -> list[Source]:
    """Procedural objects spread over all categories, in the same way."""
    each = -(-count // len(FAMILIES))
    return _in_turn([[*family_sources([category], each)] for category in FAMILIES] if count else [], count)


def _in_turn(lists: list[list[Source]], count: int) -> list[Source]:
    turns = max(map(len, lists), default=0)
    return [sources[i] for i in range(turns) for sources in lists if i < len(sources)][:count]
