"""Agreement of the renderers: ``python -m benchmarks.agreement``.

Real and procedural objects of 1 m diagonal, in random states and views at 640x480, drawn by the ray caster and by the
rasterisers. Every pixel on which they differ is counted under the reason for it. The last line is one JSON object.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import tyro
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation
from tqdm import tqdm

from artsim import make_renderer
from artsim.camera import Camera
from artsim.families import FAMILIES
from artsim.kinematics import Array
from artsim.objects import ArticulatedObject
from artsim.renderers import BACKGROUND, Frame, Renderer
from artsim.renderers.raycast import pose, render_posed
from artsim.sampling import StateOptions, ViewOptions, sample_state, sample_view
from artsim.sources import Source, family_sources, find_sources

Scene = tuple[ArticulatedObject, Array, Camera]
"""A sized object, its joint states and the camera that looks at it."""

_EDGE = 2  # pixels
_JUMP = 2e-3  # metres between neighbouring pixels, beyond the local slope: a silhouette
_COINCIDENT = 1e-4  # metres between the surfaces of two parts


@dataclass(frozen=True)
class Options:
    """Compare renderers with the ray caster."""

    partnet: Path = Path(os.environ.get("ARTSIM_PARTNET_DIR", "partnet_mobility"))
    """Folder of real objects."""
    objects: int = 40
    """Real objects, spread over their categories."""
    procedural: int = 30
    """Procedural objects, likewise."""
    states: int = 5
    views: int = 2
    renderers: tuple[str, ...] = ("sapien", "pybullet-egl", "pybullet")


@dataclass
class Agreement:
    """Differences between two renderers, over any number of images."""

    depth_mm: list[NDArray[np.float64]] = field(default_factory=list)
    inner_mm: list[NDArray[np.float64]] = field(default_factory=list)
    object_pixels: int = 0
    reasons: Counter[str] = field(default_factory=Counter)

    def add(self, scene: Scene, rays: Frame, other: Frame) -> None:
        """Take in one image."""
        shown = (rays.part_ids != BACKGROUND) | (other.part_ids != BACKGROUND)
        same = (rays.part_ids == other.part_ids) & (rays.part_ids != BACKGROUND)
        error = 1e3 * np.abs(rays.depth.astype(np.float64) - other.depth)
        edge = near_edge(rays) | near_edge(other)
        self.depth_mm.append(error[same])
        self.inner_mm.append(error[same & ~edge])
        self.object_pixels += int(shown.sum())
        differ = shown & ~same
        if differ.any():
            coincident = differ & coincident_parts(*scene, rays, other)
            self.reasons["two parts' surfaces coincide"] += int(coincident.sum())
            self.reasons["within 2 px of an edge"] += int((differ & ~coincident & edge).sum())
            self.reasons["not explained"] += int((differ & ~coincident & ~edge).sum())
        self.reasons["depth off by more than 1 mm away from edges"] += int((error[same & ~edge] > 1.0).sum())

    def summary(self) -> dict[str, float]:
        """Median and 99.9th percentile in mm, and the share of equal part ids."""
        differing = sum(n for reason, n in self.reasons.items() if not reason.startswith("depth"))
        coincident = self.reasons["two parts' surfaces coincide"]
        inner = np.concatenate(self.inner_mm)
        return {
            "median_mm": float(np.median(np.concatenate(self.depth_mm))),
            "p999_mm": float(np.percentile(inner, 99.9)) if len(inner) else 0.0,
            "part_ids_equal": 1.0 - differing / self.object_pixels,
            "part_ids_equal_without_coincident": 1.0 - (differing - coincident) / (self.object_pixels - coincident),
        }


def near_edge(frame: Frame) -> NDArray[np.bool_]:
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
    return binary_dilation(edge | bend, iterations=_EDGE)


def coincident_parts(obj: ArticulatedObject, q: Array, camera: Camera, rays: Frame, other: Frame) -> NDArray[np.bool_]:
    """(H, W) pixels at which the two parts that the renderers show lie at the same depth."""
    apart = np.full(rays.depth.shape, np.inf)
    posed = pose(obj, q, camera)
    shown = {int(k) for k in np.unique(np.concatenate([rays.part_ids, other.part_ids]))} - {BACKGROUND}
    for k in shown:
        alone = render_posed(posed, only=k).depth
        theirs = (other.part_ids == k) & (rays.part_ids != k) & (rays.part_ids != BACKGROUND) & (alone > 0)
        apart[theirs] = np.abs(alone - rays.depth)[theirs]
    return apart < _COINCIDENT


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


def main(options: Options) -> None:
    """Compare and print."""
    sources = choose(options.partnet, options.objects) + choose_procedural(options.procedural)
    result = {}
    for name in options.renderers:
        renderer = make_renderer(name)
        total, rows = Agreement(), []
        for number, source in enumerate(tqdm(sources, desc=name)):
            obj = source.load()
            one = compare(draw_scenes(obj, options.states, options.views, seed=number), renderer)
            rows.append((one.summary(), f"{obj.category} {obj.object_id}", one.reasons))
            total.depth_mm += one.depth_mm
            total.inner_mm += one.inner_mm
            total.object_pixels += one.object_pixels
            total.reasons += one.reasons
        renderer.close()
        summary = total.summary()
        result[name] = {**summary, "object_pixels": total.object_pixels, "pixels": dict(total.reasons)}
        print(f"\n{name} against raycast: {options.objects} real and {options.procedural} procedural objects", end="")
        print(f" x {options.states} states x {options.views} views")
        print("  " + ", ".join(f"{key} {value:.6g}" for key, value in summary.items()))
        print(f"  of {total.object_pixels} object pixels: " + ", ".join(f"{n} {r}" for r, n in total.reasons.items()))
        print("  least agreement:")
        for one_summary, label, reasons in sorted(rows, key=lambda row: row[0]["part_ids_equal"])[:5]:
            print(f"    {label}: {one_summary['part_ids_equal']:.5f}, {dict(reasons)}")
        print("  largest 99.9th percentile:")
        for one_summary, label, reasons in sorted(rows, key=lambda row: -row[0]["p999_mm"])[:5]:
            print(f"    {label}: {one_summary['p999_mm']:.4f} mm, {dict(reasons)}")
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
