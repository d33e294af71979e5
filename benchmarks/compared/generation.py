"""Samples made: clouds, noise, many parts, images, and end to end onto disk."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from . import Work

VIEWS = 4


def clouds(folder: Path, noise: str) -> Callable[[], Work]:
    """Clouds with all ground truth of 20 real and 20 procedural objects; of 40 procedural ones without real ones."""
    return _samples(benchmark_objects(40), noise=noise)


def many_parts(folder: Path, parts: int) -> Callable[[], Work]:
    """Clouds of cabinets whose front is a wall of small drawers."""
    return _samples([wall_of_drawers(parts)] * 10)


def images(folder: Path) -> Callable[[], Work]:
    """Samples with images of 10 objects."""
    return _samples(benchmark_objects(10), images=("depth", "part_mask"))


def _samples(objects: Sequence[Any], **options: Any) -> Callable[[], Work]:
    from artsim.datasets.sample_options import SampleOptions, draw_sample
    from artsim.renderers import make_renderer

    renderer, asked = make_renderer("raycast"), SampleOptions(**options)

    def work() -> Work:
        made = [
            draw_sample(obj, asked, 0, VIEWS * i + view, renderer)
            for i, obj in enumerate(objects)
            for view in range(VIEWS)
        ]
        return Work(len(made), lambda: digest_of(made))

    return work


def digest_of(samples: Sequence[Any]) -> str:
    """SHA-256 of all that shards would hold of some samples."""
    from artsim.datasets.shards import sample_members

    digest = hashlib.sha256()
    for sample in samples:
        for name, content in sample_members(sample).items():
            digest.update(name.encode() + content)
    return digest.hexdigest()


def benchmark_objects(count: int) -> list[Any]:
    """The first half real where there are any, the others of as many families."""
    import artsim

    paths = real_objects()
    real = [artsim.load(path) for path in paths[:: max(1, len(paths) // (count // 2))][: count // 2]]
    families = artsim.CATEGORIES
    return real + [artsim.make(families[i % len(families)], i) for i in range(count - len(real))]


def real_objects() -> list[Path]:
    """URDF files below ``ARTSIM_PARTNET_DIR``, if it is set."""
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    return sorted(Path(folder).glob("*/*/mobility.urdf")) if folder else []


def wall_of_drawers(parts: int) -> Any:
    """A rack, and a grid of drawers so small that few rays meet each."""
    import numpy as np

    from artsim.making.assembly import Assembly, prismatic
    from artsim.making.solids import box

    rack = Assembly()
    rack.add("rack", box((0.0, -0.5, -0.5), (0.4, 0.5, 0.5)))
    across = int(np.ceil(np.sqrt(parts - 1)))
    pitch = 0.96 / across
    for k in range(parts - 1):
        y, z = -0.48 + pitch * (k % across), -0.48 + pitch * (k // across)
        # A third of the pitch wide: most of the front is rack, and each drawer is met by few rays.
        drawer = box((-0.02, y, z), (-0.005, y + pitch / 3, z + pitch / 3))
        rack.add(f"drawer_{k}", drawer, prismatic("rack", (-1, 0, 0), 0.0, 0.1))
    return rack.build("wall_of_drawers", str(parts))


def end_to_end(folder: Path, workers: int, samples: int = 3000) -> Callable[[], Work]:
    """A dataset made from the objects of some families, which are made first, and from the demo objects."""
    from artsim import generate
    from artsim.loading.sources import family_sources

    def work() -> Work:
        out = folder / "dataset"
        shutil.rmtree(out, ignore_errors=True)
        sources = family_sources(["laptop", "drawer", "scissors", "eyeglasses"], 2)
        generate(sources, out, num_samples=samples, workers=workers, progress=False)
        return Work(samples, lambda: digest_of_files(out))

    return work


def digest_of_files(folder: Path) -> str:
    """SHA-256 of all files of a dataset."""
    digest = hashlib.sha256()
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        digest.update(path.relative_to(folder).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()
