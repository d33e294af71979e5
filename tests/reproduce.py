"""What a processor makes of procedural objects and of a dataset: ``python -m tests.reproduce`` prints JSON."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from pathlib import Path

import numpy as np

import artsim
from artsim.datasets.plan import SampleOptions
from artsim.families import CATEGORIES, make
from artsim.loading.sources import Source, family_sources, find_sources
from artsim.model.draws import StateOptions, ViewOptions
from artsim.model.objects import ArticulatedObject
from tests.conftest import ASSETS

NUM_SAMPLES = 120


def main() -> None:
    """Print name -> digest."""
    with tempfile.TemporaryDirectory() as folder:
        print(json.dumps(object_digests() | dataset_digests(Path(folder) / "dataset")))


def object_digests() -> dict[str, str]:
    """An object of every family: its own SHA-256, and one of every number of its shape and its joints."""
    digests = {}
    for seed, category in enumerate(CATEGORIES):
        obj = make(category, seed)
        digests[f"{category}:{seed}"] = obj.sha256
        digests[f"{category}:{seed} whole"] = whole_digest(obj)
    return digests


def whole_digest(obj: ArticulatedObject) -> str:
    """SHA-256 of vertices, faces, convex pieces and the tree, by way of nothing of artsim's own."""
    digest = hashlib.sha256()
    for part in obj.parts:
        pieces = [] if part.body is None else part.body.pieces
        for vertices, faces in ((part.vertices, part.faces), *pieces):
            digest.update(np.ascontiguousarray(vertices).tobytes() + np.ascontiguousarray(faces).tobytes())
    digest.update(repr([repr(joint) for joint in obj.native_tree.joints]).encode())
    return digest.hexdigest()


def dataset_digests(folder: Path) -> dict[str, str]:
    """Every file of a dataset of clouds and images with noise, of procedural and of loaded objects."""
    artsim.generate(
        sources(),
        folder,
        num_samples=NUM_SAMPLES,
        sample=SampleOptions(
            num_points=256,
            noise="kinect_v1",
            images=("depth", "part_mask"),
            scale=(0.3, 1.2),
            states=StateOptions(mode="mixed"),
            views=ViewOptions(preset="mixed", width=80, height=60),
        ),
        workers=1,
        shard_size=40,
        progress=False,
    )
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def sources() -> list[Source]:
    """Every other family, an object of files and one of primitive shapes, and a real one where there are any."""
    paths = [ASSETS / name for name in ("laptop", "scissors", "quirks/primitives", "quirks/formats")]
    if "ARTSIM_PARTNET_DIR" in os.environ:
        paths += sorted(Path(os.environ["ARTSIM_PARTNET_DIR"]).glob("*/*/mobility.urdf"))[:1]
    return [*family_sources(CATEGORIES[::2], 1), *find_sources(paths)]


if __name__ == "__main__":
    main()
