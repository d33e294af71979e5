"""Renderers beside the ray caster: ``python -m benchmarks.renderers``.

Real and procedural objects of 1 m diagonal, in random states and views. For each renderer: its frames of depth and part
ids per second at two image sizes, without the first frame of an object; its depth differences from the ray caster at
640x480; and every pixel on which they differ, under the reason for it. The last line is one JSON object.
"""

import json
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import tyro

from artsim import Camera, make_renderer
from artsim.commands.doctor import examine
from artsim.common.progress import track
from artsim.renderers import RENDERERS, Renderer
from tests.agreement import CLASSES, LIMITS, Agreement, Scene, choose, choose_procedural, compare, draw_scenes

_SIZES = ((640, 480), (128, 128))


@dataclass(frozen=True)
class Options:
    """Measure frames per second, and compare with the ray caster."""

    partnet: Path = Path(os.environ.get("ARTSIM_PARTNET_DIR", "partnet_mobility"))
    """Folder of real objects."""
    objects: int = 30
    """Real objects, spread over their categories."""
    procedural: int = 30
    """Procedural objects, likewise."""
    states: int = 4
    views: int = 1
    """Of each state."""
    renderers: tuple[str, ...] = tuple(RENDERERS)


def main(options: Options) -> None:
    """Measure, compare and print."""
    sources = choose(options.partnet, options.objects) + choose_procedural(options.procedural)
    loaded = [(source.name, source.load()) for source in track("objects", sources, unit="object", leave=False)]
    scenes = {name: draw_scenes(obj, options.states, options.views, seed=i) for i, (name, obj) in enumerate(loaded)}
    print(f"{options.objects} real and {options.procedural} procedural objects, {options.states} states", end=" ")
    print(f"x {options.views} views; {os.cpu_count()} processor cores")
    result: dict[str, Any] = {}
    for name in options.renderers:
        finding = examine(name)
        if not finding.works:
            print(f"{name}: not measured: {finding.problem} (fix: {finding.fix})")
            result[name] = None
            continue
        renderer = make_renderer(name)
        result[name] = {"fps": frames_per_second(renderer, list(scenes.values()))}
        rates = ", ".join(f"{rate} /s at {size}" for size, rate in result[name]["fps"].items())
        print(f"{name}: {rates}, on {finding.device}")
        if name in LIMITS:
            rows = {what: compare(own, renderer) for what, own in track(name, scenes.items(), leave=False)}
            result[name] |= agreement(rows, LIMITS[name])
        renderer.close()
    print(json.dumps(result))


def frames_per_second(renderer: Renderer, per_object: Sequence[Sequence[Scene]]) -> dict[str, float]:
    """Of each image size, without the first frame of an object, for which its scene is built."""
    rates = {}
    for width, height in _SIZES:
        count, seconds = 0, 0.0
        for scenes in per_object:
            sized = [(obj, q, resized(camera, width, height)) for obj, q, camera in scenes]
            renderer.render(*sized[0])
            start = time.perf_counter()
            for scene in sized:
                renderer.render(*scene)
            count, seconds = count + len(sized), seconds + time.perf_counter() - start
        rates[f"{width}x{height}"] = round(count / seconds, 1)
    return rates


def resized(camera: Camera, width: int, height: int) -> Camera:
    """The camera with another image size that shows as much from top to bottom."""
    factor = height / camera.height
    K = camera.K * [[factor], [factor], [1.0]]
    K[0, 2] += 0.5 * (width - factor * camera.width)
    return replace(camera, K=K, width=width, height=height)


def agreement(rows: dict[str, Agreement], limits: tuple[float, float, float]) -> dict[str, Any]:
    """Print and return how closely a renderer agrees with the ray caster over all objects."""
    total = Agreement()
    for one in rows.values():
        total.merge(one)
    summary, agrees = total.summary(), total.agrees(limits)
    print(f"  depth: median {summary['median_mm']:.5f} mm (limit {limits[0]}), 99.9 % within", end=" ")
    print(f"{summary['p999_mm']:.4f} mm away from edges (limit {limits[1]})")
    print(f"  part ids equal on {summary['part_ids_equal']:.5%} of {total.object_pixels} pixels", end=" ")
    print(f"(limit {limits[2]:.1%}): {'agrees' if agrees else 'DOES NOT AGREE'}")
    for name, why in CLASSES.items():
        print(f"  {name:22s}{total.ids_differ[name]:8d} part ids,{total.depth_off[name]:8d} depths differ  {why}")
    least = min(rows, key=lambda what: rows[what].summary()["part_ids_equal"])
    print(f"  least agreement: {least}, part ids {rows[least].summary()['part_ids_equal']:.4%}")
    differ = {"ids_differ": dict(total.ids_differ), "depth_off": dict(total.depth_off)}
    return {**summary, "agrees": agrees, "object_pixels": total.object_pixels, **differ}


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
