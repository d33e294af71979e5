"""How cost grows with the work: ``python -m benchmarks.growth``.

Does the same work at several sizes, and fits the exponent of processor time over size to the upper half of them, where
what is the same at every size counts least: 1 is in proportion. Readings of a size are taken by turns with those of
the others, and the least counts, so that a busy machine disturbs little. The last line is one JSON object.
"""

from __future__ import annotations

import json
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from artsim import (
    ArticulatedObject,
    Camera,
    SampleOptions,
    family_sources,
    generate,
    make,
    observe,
    open_dataset,
    render,
    verify,
)
from artsim.common.progress import track
from artsim.errors import ConfigError
from artsim.making.assembly import Assembly
from artsim.making.solids import ellipsoid
from benchmarks.compared.generation import wall_of_drawers

Work = Callable[[], object]
EYE, MIDDLE = (-2.5, 0.8, 1.2), (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Growth:
    """One way in which work grows.

    Attributes
    ----------
    what : str
    sizes : sequence of int
    prepare : callable
        Of a size and an empty folder, what is timed.
    """

    what: str
    sizes: Sequence[int]
    prepare: Callable[[int, Path], Work]


def ball(sections: int) -> ArticulatedObject:
    """A ball of about so many sections around and along."""
    assembly = Assembly()
    assembly.add("ball", ellipsoid((0.0, 0.0, 0.0), 0.5, sections))
    return assembly.build("ball", str(sections))


def clouds(obj: ArticulatedObject, num_points: int = 2048, camera: Camera | None = None) -> Work:
    """A few clouds of an object at rest."""
    camera = camera or Camera.look_at(EYE, MIDDLE)

    def work() -> None:
        for i in range(4):
            observe(obj, obj.tree.rest, camera, num_points=num_points, rng=np.random.default_rng(i))

    work()
    return work


def of_faces(sections: int, folder: Path) -> Work:
    """Clouds of a ball."""
    return clouds(ball(sections))


def of_parts(parts: int, folder: Path) -> Work:
    """Clouds of a wall of small drawers."""
    return clouds(wall_of_drawers(parts))


def of_points(points: int, folder: Path) -> Work:
    """Clouds of a laptop, of an image that has pixels for all of them."""
    return clouds(make("laptop", 0), points, Camera.look_at((-0.6, 0.2, 0.4), MIDDLE, 2560, 1920))


def of_pixels(width: int, folder: Path) -> Work:
    """Frames of a laptop."""
    obj, camera = make("laptop", 0), Camera.look_at((-0.6, 0.2, 0.4), MIDDLE, width, width * 3 // 4)
    return lambda: [render(obj, obj.tree.rest, camera) for _ in range(3)]


def small_dataset(samples: int, shard_size: int, folder: Path) -> None:
    """A dataset of few points a sample."""
    options: dict[str, Any] = {"workers": 1, "progress": False, "sample": SampleOptions(num_points=16)}
    generate(family_sources(["laptop"], 1), folder, num_samples=samples, shard_size=shard_size, **options)


def of_shards(shards: int, folder: Path) -> Work:
    """500 samples read in shuffled order, for one of so many shards: per sample, this has to stay as it is."""
    samples = 2000
    small_dataset(samples, -(-samples // shards), folder)
    dataset = open_dataset(folder)
    for i in range(samples):
        dataset[i]
    order = np.random.default_rng(0).integers(0, samples, 500).tolist()
    return lambda: [dataset[i] for i in order]


def of_samples(samples: int, folder: Path) -> Work:
    """A dataset of one shard verified."""
    small_dataset(samples, samples, folder)
    return lambda: verify(folder, progress=False)


GROWTHS: dict[str, Growth] = {
    "faces": Growth("clouds over triangles of the object", (32, 64, 128, 256), of_faces),
    "parts": Growth("clouds over parts", (16, 32, 64, 128), of_parts),
    "points": Growth("clouds over their points", (4096, 8192, 16384, 32768), of_points),
    "pixels": Growth("frames over the pixels of the image", (320, 640, 1280, 2560), of_pixels),
    "shards": Growth("500 shuffled reads over the shards of a dataset", (10, 50, 250, 1000), of_shards),
    "samples": Growth("verification over the samples of a shard", (250, 500, 1000, 2000), of_samples),
}

_SIZE: dict[str, Callable[[int], float]] = {
    "faces": lambda sections: float(ball(sections).num_faces),
    "pixels": lambda width: float(width * (width * 3 // 4)),
}
"""How much work a size is, where it is not the size itself."""


@dataclass(frozen=True)
class Options:
    """Measure how cost grows with the work."""

    only: tuple[str, ...] = ()
    """Some of: faces parts points pixels shards samples."""
    repeats: int = 5
    """Readings of each size, of which the least counts."""
    picture: Path | None = None
    """PNG or SVG file to draw the times into."""
    most: float = 1.1
    """Exponents above are reported as failures."""

    def __post_init__(self) -> None:
        unknown = set(self.only) - GROWTHS.keys()
        if unknown:
            raise ConfigError(f"no growth is called {min(unknown)!r}", "only", f"use some of {', '.join(GROWTHS)}")
        if self.repeats < 1:
            raise ConfigError(f"{self.repeats} readings measure nothing", "repeats", "use 1 or more")


def main(options: Options) -> None:
    """Measure all, and print exponents."""
    exponents: dict[str, float] = {}
    times: dict[str, tuple[list[float], list[float]]] = {}
    for name in options.only or GROWTHS:
        growth = GROWTHS[name]
        work = [_SIZE.get(name, float)(size) for size in growth.sizes]
        seconds = least_seconds(growth, options.repeats)
        exponents[name], times[name] = exponent(work, seconds), (work, seconds)
        shown = ", ".join(f"{size:,.0f}: {1e3 * time_:.3g} ms" for size, time_ in zip(work, seconds, strict=True))
        print(f"{name:8} exponent {exponents[name]:5.2f}  {growth.what} ({shown})", flush=True)
    if options.picture is not None:
        draw(times, exponents, options.picture)
    over = sorted(name for name, value in exponents.items() if value > options.most)
    print(json.dumps({"exponents": {k: round(v, 3) for k, v in exponents.items()}, "over": over}))


def least_seconds(growth: Growth, repeats: int) -> list[float]:
    """Processor time at each size."""
    with tempfile.TemporaryDirectory() as folder:
        works = [growth.prepare(size, Path(folder) / str(size)) for size in growth.sizes]
        least = [float("inf")] * len(works)
        for _ in track(growth.what, range(repeats), leave=False):
            for i, work in enumerate(works):
                start = time.process_time()
                work()
                least[i] = min(least[i], time.process_time() - start)
    return least


def draw(times: dict[str, tuple[list[float], list[float]]], exponents: dict[str, float], file: Path) -> None:
    """Time over work, each on a panel of its own with the line of proportion."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot as plt

    across = min(3, len(times))
    figure, axes = plt.subplots(-(-len(times) // across), across, figsize=(3.2 * across, 5), squeeze=False)
    for axis, (name, (work, seconds)) in zip(axes.flat, times.items(), strict=False):
        proportion = [seconds[-1] * size / work[-1] for size in work]
        axis.loglog(work, [1e3 * time_ for time_ in proportion], ":", color="0.6", label="in proportion")
        axis.loglog(work, [1e3 * time_ for time_ in seconds], "o-", color="#0072b2")
        axis.set_title(f"{GROWTHS[name].what}\nexponent {exponents[name]:.2f}", fontsize=8)
        axis.set_xlabel(name, fontsize=8)
        axis.set_ylabel("ms", fontsize=8)
        axis.tick_params(labelsize=7, which="both")
    for axis in axes.flat[len(times) :]:
        axis.set_axis_off()
    axes.flat[0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(file, dpi=110)


def exponent(work: Sequence[float], seconds: Sequence[float]) -> float:
    """Slope of log time over log work, in the upper half of the sizes."""
    half = len(work) // 2
    slope, _ = np.polyfit(np.log(work[half - 1 :]), np.log(seconds[half - 1 :]), 1)
    return float(slope)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
