"""What a processor makes of objects, clouds and a dataset: ``python -m tests.reproduce`` prints it as JSON.

``python -m tests.reproduce --record`` writes the record that every processor is compared with. Do that after a change
that gives objects or samples other bytes, with the packages of ``constraints.txt``.
"""

from __future__ import annotations

import contextlib
import ctypes
import hashlib
import json
import os
import re
import sys
import tarfile
import tempfile
from collections.abc import Iterable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any
from unittest.mock import patch

import embreex
import numpy as np
from embreex.rtcore import EmbreeDevice

import artsim
from artsim.commands.doctor import processor
from artsim.datasets.plan import SampleOptions
from artsim.families import CATEGORIES, make
from artsim.loading.sources import family_sources, find_sources
from artsim.model.camera import Camera
from artsim.model.draws import StateOptions, ViewOptions, sample_state
from artsim.model.objects import ArticulatedObject
from artsim.observing.capture import observe
from artsim.observing.sample import Sample
from artsim.observing.sensor import SENSORS
from artsim.renderers import raycast
from tests.conftest import ASSETS
from tests.processors import EMBREE, can_run

RECORD = Path(__file__).with_name("reproduced.json")
NUM_SAMPLES = 120
LOADED = [ASSETS / name for name in ("laptop", "scissors", "quirks/primitives", "quirks/formats")]
PACKAGES = ("numpy", "scipy", "trimesh", "manifold3d", "lxml", "orjson", "pillow", "pycollada")
"""What makes bytes, other than this project: the record holds for these versions of them."""


def main() -> None:
    """Print what is made here, or record it."""
    made = everything(() if sys.argv[1:] == ["--exact"] else EMBREE)
    if sys.argv[1:] != ["--record"]:
        print(json.dumps(made))
        return
    record = {
        "made on": f"{processor()}, {' '.join(name for name in EMBREE if can_run(name))}",
        "packages": packages(),
        **{section: made[section] for section in ("objects", "families", "compiled objects", "labels", "noise")},
        "clouds": next(iter(made["clouds"].values())),  # of the newest code
    }
    RECORD.write_text(json.dumps(record, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    print(f"recorded in {RECORD}")


def packages() -> dict[str, str]:
    """Version of each package that makes bytes."""
    return {name: version(name) for name in PACKAGES}


def everything(kinds: Iterable[str] = EMBREE) -> dict[str, Any]:
    """Sections of the record, and what is only compared between runs on one processor.

    Clouds are those of these kinds of processors.
    """
    objects = [make(category, seed) for seed, category in enumerate(CATEGORIES)]
    with tempfile.TemporaryDirectory() as folder:
        make_dataset(Path(folder) / "dataset")
        files = sorted(path for path in Path(folder).rglob("*") if path.is_file())
        digests = {path.relative_to(folder).as_posix(): sha256(path.read_bytes()) for path in files}
        labels = {key: digest for path in files if path.suffix == ".tar" for key, digest in label_digests(path)}
    return {
        "objects": object_digests(objects),
        "families": {name: family_digest([make(name, seed) for seed in range(3)]) for name in CATEGORIES},
        "real object": real_object(),
        "compiled objects": {Path(name).stem: digest for name, digest in digests.items() if name.endswith(".npz")},
        "labels": labels,
        "noise": noise_digests(),
        "clouds": {EMBREE[name]: clouds(objects, EMBREE[name]) for name in kinds if can_run(name)},
        "files": digests,
    }


def sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


# --- objects ---------------------------------------------------------------------------------------------------------


def object_digests(objects: list[ArticulatedObject]) -> dict[str, str]:
    """Of each object its own SHA-256, and one of every number of its shape and its joints."""
    return {
        f"{obj.category}:{obj.object_id}{what}": digest
        for obj in objects
        for what, digest in (("", obj.sha256), (" whole", whole_digest(obj)))
    }


def whole_digest(obj: ArticulatedObject) -> str:
    """SHA-256 of vertices, faces, convex pieces and the tree, by way of nothing of artsim's own."""
    digest = hashlib.sha256()
    for part in obj.parts:
        pieces = [] if part.body is None else part.body.pieces
        for vertices, faces in ((part.vertices, part.faces), *pieces):
            digest.update(np.ascontiguousarray(vertices).tobytes() + np.ascontiguousarray(faces).tobytes())
    digest.update(repr([repr(joint) for joint in obj.native_tree.joints]).encode())
    return digest.hexdigest()


def family_digest(objects: list[ArticulatedObject]) -> str:
    """Of trees and boxes of parts to 0.1 mm: it stays where packages change the last bits of a surface."""
    digest = hashlib.sha256()
    for obj in objects:
        for joint, box in zip(obj.tree.joints, obj.part_bounds, strict=True):
            numbers = (*joint.axis, *joint.origin, joint.lower, joint.upper, joint.rest, joint.pitch, *box.flat)
            digest.update(f"{joint.type} {joint.parent} {joint.mimic}".encode())
            digest.update((np.round(numbers, 4) + 0.0).tobytes())  # no -0
    return digest.hexdigest()[:12]


def real_object() -> str:
    """Digest of a real object and of a cloud of it; empty where there is none. No record has it."""
    if "ARTSIM_PARTNET_DIR" not in os.environ:
        return ""
    obj = artsim.load(sorted(Path(os.environ["ARTSIM_PARTNET_DIR"]).glob("*/*/mobility.urdf"))[0])
    return whole_digest(obj) + sha256(cloud(obj).points.tobytes())


# --- samples ---------------------------------------------------------------------------------------------------------


def make_dataset(folder: Path) -> None:
    """Clouds and images with noise, of every other family, of objects of files and of primitive shapes."""
    artsim.generate(
        [*family_sources(CATEGORIES[::2], 1), *find_sources(LOADED)],
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


def label_digests(shard: Path) -> Iterator[tuple[str, str]]:
    """Key and digest of the labels of each sample: poses, joints, boxes and camera.

    Labels do without Embree, but for the share of each part that is visible: a ray that grazes an edge may miss it on
    another processor.
    """
    with tarfile.open(shard) as archive:
        for member in archive:
            if member.name.endswith(".json"):
                content = archive.extractfile(member)
                assert content is not None
                labels, found = re.subn(rb'"visible_fraction": ?\[[^]]*\]', b"", content.read())
                assert found == 1, member.name
                yield member.name.removesuffix(".json"), sha256(labels)


def noise_digests() -> dict[str, str]:
    """What every sensor makes of a ball before a wall: depth of which each bit is known."""
    camera = Camera.look_at((-1.0, 0.0, 0.0), (0.0, 0.0, 0.0), 64, 48)
    row, column = np.mgrid[:48, :64]
    ball = np.maximum(400 - (row - 24) ** 2 - (column - 30) ** 2, 0)
    depth = (1.5 - 0.01 * np.sqrt(ball) + 0.002 * column * (ball == 0)).astype(np.float32)
    return {
        name: sha256(sensor.read_image(depth, camera, key).tobytes())
        for key, (name, sensor) in enumerate(sorted(SENSORS.items()))
    }


def cloud(obj: ArticulatedObject) -> Sample:
    """256 points of an object, without noise."""
    rng = np.random.default_rng(1)
    eye = obj.diagonal * np.array([-1.2, 0.4, 0.7])
    camera = Camera.look_at(eye, (0.0, 0.0, 0.0), 160, 120)
    return observe(obj, sample_state(obj, StateOptions(), rng), camera, num_points=256, rng=rng)


def clouds(objects: list[ArticulatedObject], code: str) -> dict[str, list[float]]:
    """Mean of the points of each object's cloud, in metres, as Embree's code for other instructions finds them."""
    with embree(code):
        return {obj.category: cloud(obj).points.mean(axis=0, dtype=np.float64).tolist() for obj in objects}


@contextlib.contextmanager
def embree(code: str) -> Iterator[None]:
    """Let Embree run its code for other instructions, which embreex has no option for."""
    library = ctypes.CDLL(str(next(Path(embreex.__path__[0] + ".libs").glob("libembree*"))))
    library.rtcNewDevice.restype = ctypes.c_void_p
    device = EmbreeDevice()
    # The object holds one thing behind what every object of Python has: Embree's own device, which is exchanged.
    assert EmbreeDevice.__basicsize__ == object.__basicsize__ + ctypes.sizeof(ctypes.c_void_p)
    held = ctypes.c_void_p.from_address(id(device) + object.__basicsize__)
    own, held.value = held.value, library.rtcNewDevice(f"isa={code}".encode())
    assert held.value, f"Embree has no code {code}"
    raycast._surfaces.clear()
    try:
        with patch("artsim.renderers.ray_scenes.embree_device", lambda process: device):
            yield
    finally:
        raycast._surfaces.clear()
        held.value = own


if __name__ == "__main__":
    main()
