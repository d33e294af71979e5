"""Frames per second of each renderer: ``python -m benchmarks.renderers``.

Depth and part ids (and colour, where a renderer always makes it) of the same objects, states and views at two image
sizes. An object's first frame, for which it is loaded and its scene built, does not count. Then many views of different
objects at once, by Warp and, where there is a GPU, by ManiSkill's batched camera. The last line is one JSON object:
``fps`` by renderer and size, and ``batched``, views per second.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tyro

from artsim import Camera, make_renderer
from artsim.commands.doctor import Finding, examine
from artsim.common.progress import track
from artsim.renderers import RENDERERS, Renderer
from benchmarks.agreement import choose, choose_procedural, draw_scenes
from benchmarks.batches import measure_batches
from benchmarks.differences import Scene

_SIZES = ((640, 480), (128, 128))


@dataclass(frozen=True)
class Options:
    """Measure frames per second."""

    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """Folder of real objects, which half of the objects are; without it, all are procedural."""
    objects: int = 20
    views: int = 10
    """Frames of each object that count, each of another state and view."""
    renderers: tuple[str, ...] = tuple(RENDERERS)


def resized(camera: Camera, width: int, height: int) -> Camera:
    """The camera with another image size that shows as much from top to bottom."""
    factor = height / camera.height
    K = camera.K * [[factor], [factor], [1.0]]
    K[0, 2] += 0.5 * (width - factor * camera.width)
    return replace(camera, K=K, width=width, height=height)


def sized(scenes: Sequence[Scene], size: tuple[int, int]) -> list[Scene]:
    """Scenes with another image size."""
    return [(obj, q, resized(camera, *size)) for obj, q, camera in scenes]


def measure(renderer: Renderer, scenes: Sequence[Scene]) -> tuple[int, float]:
    """Frames drawn of one object, and the seconds that they took."""
    renderer.render(*scenes[0])
    start = time.perf_counter()
    for scene in scenes[1:]:
        renderer.render(*scene)
    return len(scenes) - 1, time.perf_counter() - start


def main(options: Options) -> None:
    """Print a table and the JSON line."""
    real = [] if options.partnet is None else choose(options.partnet, options.objects // 2)
    sources = real + choose_procedural(options.objects - len(real))
    per_object = [draw_scenes(source.load(), options.views + 1, 1, seed=i) for i, source in enumerate(sources)]
    triangles = int(np.median([scenes[0][0].num_faces for scenes in per_object]))
    print(f"{len(real)} real and {len(sources) - len(real)} procedural objects, {triangles} triangles in the median,")
    print(f"{options.views} states and views of each; {os.cpu_count()} processor cores")
    print(f"{'':14s}" + "".join(f"{f'{w}x{h}':>10s}" for w, h in _SIZES) + "  frames/s, on")
    fps: dict[str, dict[str, float]] = {}
    for name in options.renderers:
        finding = examine(name)
        if finding.works:
            fps[name] = _rates(name, per_object)
        print(_row(finding, fps.get(name)))
    batched = measure_batches([scenes[0][0] for scenes in per_object]) if "warp" in fps else None
    print(json.dumps({"fps": fps, "batched": batched}))


def _rates(name: str, per_object: Sequence[Sequence[Scene]]) -> dict[str, float]:
    renderer = make_renderer(name)
    total = dict.fromkeys(_SIZES, (0, 0.0))
    for scenes in track(name, per_object, unit="object", leave=False):
        for size in _SIZES:
            frames, seconds = measure(renderer, sized(scenes, size))
            total[size] = total[size][0] + frames, total[size][1] + seconds
    renderer.close()
    return {f"{w}x{h}": round(frames / seconds, 1) for (w, h), (frames, seconds) in total.items()}


def _row(finding: Finding, rates: dict[str, float] | None) -> str:
    if rates is None:
        return f"{finding.backend:14s}{'-':>10s}{'-':>10s}  not measured: {finding.problem} (fix: {finding.fix})"
    return f"{finding.backend:14s}" + "".join(f"{rate:10.1f}" for rate in rates.values()) + f"  {finding.device}"


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
