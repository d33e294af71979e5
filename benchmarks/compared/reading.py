"""Samples read and verified, objects loaded."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from inspect import signature
from pathlib import Path
from typing import Any

from . import Work
from .generation import digest_of, real_objects


def verified(folder: Path, workers: int, samples: int = 2000) -> Callable[[], Work]:
    """A sound dataset verified, by several processes where that is possible."""
    from artsim import generate, verify
    from artsim.loading.sources import family_sources

    options = {"workers": workers} if workers > 1 and "workers" in signature(verify).parameters else {}
    sources = family_sources(["laptop", "drawer", "scissors", "eyeglasses"], 2)
    generate(sources, folder / "dataset", num_samples=samples, shard_size=100, workers=1, progress=False)

    def work() -> Work:
        problems = verify(folder / "dataset", progress=False, **options)
        return Work(samples, lambda: f"{len(problems)} problems")

    return work


def shuffled(folder: Path, shards: int) -> Callable[[], Work]:
    """Small samples, read all over the shards from the second time on, as in training."""
    import numpy as np

    from artsim import SampleOptions, generate, open_dataset
    from artsim.loading.sources import family_sources

    samples, reads = 6_400, 500
    generate(
        family_sources(["laptop"], 2),
        folder / "dataset",
        num_samples=samples,
        sample=SampleOptions(num_points=16),
        shard_size=-(-samples // shards),
        workers=1,
        progress=False,
    )
    dataset = open_dataset(folder / "dataset")
    for i in range(0, samples, samples // shards // 2):
        dataset[i]
    rng = np.random.default_rng(0)

    def work() -> Work:
        order = rng.integers(0, samples, reads).tolist()
        read = [dataset[i] for i in order]
        return Work(reads, lambda: digest_of(read))

    return work


def loaded(folder: Path) -> Callable[[], Work]:
    """Objects loaded from their files."""
    import artsim

    paths = real_objects()[::4]
    if not paths:
        assets = Path(artsim.__file__).resolve().parent.parent / "urdf_assets"
        paths = [assets / name for name in ("laptop", "cabinet", "eyeglasses", "dishwasher", "scissors")]

    def work() -> Work:
        objects = [artsim.load(path) for path in paths]
        return Work(len(objects), lambda: _digest(objects))

    return work


def _digest(objects: list[Any]) -> str:
    digest = hashlib.sha256()
    for obj in objects:
        digest.update(obj.sha256.encode())
        for part in obj.parts:
            digest.update(part.vertices.tobytes() + part.faces.tobytes())
        digest.update(repr([repr(joint) for joint in obj.native_tree.joints]).encode())
    return digest.hexdigest()
