"""Agreement of the renderers: ``python -m benchmarks.agreement``.

Real and procedural objects of 1 m diagonal, in random states and views at 640x480, drawn by the ray caster and by the
other renderers. Every pixel on which they differ is counted under the reason for it. The last line is one JSON object:
for each renderer its median depth difference, the share of equal part ids, whether that is what was asked of it, and
the pixels of each class that differ.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from numpy.typing import NDArray

from artsim import make_renderer
from artsim.common.progress import track
from artsim.errors import RenderError
from artsim.families import FAMILIES
from artsim.loading.sources import Source, family_sources, find_sources
from artsim.model.draws import StateOptions, ViewOptions, sample_state, sample_view
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.objects import ArticulatedObject
from artsim.renderers import Renderer
from benchmarks.differences import CLASSES, Scene, classify, near_edge

LIMITS = {
    "warp": (0.005, 0.1, 0.999),
    "sapien": (0.005, 0.1, 0.999),
    "pybullet-egl": (0.05, 1.0, 0.998),
    "pybullet": (1.5, 1.0, 0.99),
}
"""What is asked of each renderer: at most this median, and 99.9th percentile away from edges, of the depth differences
in mm; at least this share of equal part ids."""

_OFF = 1.0  # mm of depth that count as a difference


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
    renderers: tuple[str, ...] = tuple(LIMITS)


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
        differ, off = shown & ~same, same & (error > _OFF)
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


def main(options: Options) -> None:
    """Compare and print."""
    sources = choose(options.partnet, options.objects) + choose_procedural(options.procedural)
    result: dict[str, Any] = {}
    for name in options.renderers:
        try:
            renderer = make_renderer(name)
        except RenderError as error:
            print(f"{name}: not compared: {error}")
            result[name] = None
            continue
        rows, total = [], Agreement()
        for number, source in enumerate(track(name, sources, unit="object", leave=False)):
            one = compare(draw_scenes(source.load(), options.states, options.views, seed=number), renderer)
            rows.append((source.name, one))
            total.merge(one)
        renderer.close()
        print(f"{name} against raycast: {options.objects} real and {options.procedural} procedural objects", end="")
        print(f" x {options.states} states x {options.views} views")
        _print_total(total, LIMITS[name])
        _print_worst(rows)
        result[name] = _row(total, LIMITS[name])
    print(json.dumps(result))


def _row(total: Agreement, limits: tuple[float, float, float]) -> dict[str, Any]:
    return {
        **total.summary(),
        "agrees": total.agrees(limits),
        "object_pixels": total.object_pixels,
        "ids_differ": {name: total.ids_differ[name] for name in CLASSES},
        "depth_off": {name: total.depth_off[name] for name in CLASSES},
    }


def _print_total(total: Agreement, limits: tuple[float, float, float]) -> None:
    summary = total.summary()
    print(f"  depth: median {summary['median_mm']:.5f} mm (asked: {limits[0]}), 99.9 % within", end=" ")
    print(f"{summary['p999_mm']:.4f} mm away from edges (asked: {limits[1]})")
    print(f"  part ids equal on {summary['part_ids_equal']:.5%} of {total.object_pixels} pixels", end=" ")
    print(f"(asked: {limits[2]:.1%}): {'agrees' if total.agrees(limits) else 'DOES NOT AGREE'}")
    print(f"  {'pixels that differ':22s}{'part ids':>10s}{f'depth > {_OFF:.0f} mm':>15s}")
    for name, why in CLASSES.items():
        print(f"  {name:22s}{total.ids_differ[name]:10d}{total.depth_off[name]:15d}  {why}")


def _print_worst(rows: Sequence[tuple[str, Agreement]]) -> None:
    print("  least agreement:")
    for label, one in sorted(rows, key=lambda row: row[1].summary()["part_ids_equal"])[:3]:
        print(f"    {label}: part ids {one.summary()['part_ids_equal']:.4%}, differing {dict(+one.ids_differ)}")
    for label, one in sorted(rows, key=lambda row: -row[1].summary()["p999_mm"])[:3]:
        print(f"    {label}: 99.9 % within {one.summary()['p999_mm']:.4f} mm, off {dict(+one.depth_off)}")


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
