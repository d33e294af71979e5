"""Seeds: small files of each kind, all our own, as text or made by code where that is smaller."""

from __future__ import annotations

import io
import json
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from artperl.training.options import TrainOptions
from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.solids import box
from artsim.model.object_file import save_object
from artsim.model.objects import ArticulatedObject
from benchmarks.fuzz import mjcf_texts, texts, usd_corpus
from benchmarks.fuzz.mutations import npy_bytes


@dataclass(frozen=True)
class Seed:
    """A file to mutate, and the files beside it.

    Attributes
    ----------
    kind : str
        What reads it: a key of :data:`benchmarks.fuzz.targets.TARGETS`.
    name : str
        Unique among seeds of the kind.
    files : mapping of str to bytes
        Names within a folder, and contents.
    member : str
        The one of these that is mutated.
    form : str
        Its format: a key of :data:`benchmarks.fuzz.mutations.MUTATIONS`.
    """

    kind: str
    name: str
    files: dict[str, bytes]
    member: str
    form: str


def small_object() -> ArticulatedObject:
    """A box with a lid and a drawer."""
    assembly = Assembly()
    assembly.add("body", box((-0.2, -0.15, -0.1), (0.2, 0.15, 0.1)))
    assembly.add(
        "lid", box((-0.2, -0.15, 0.1), (0.2, 0.15, 0.11)), revolute("body", (0, 1, 0), (0.2, 0, 0.1), 0.0, 1.5)
    )
    assembly.add("drawer", box((-0.21, -0.1, -0.05), (-0.2, 0.1, 0.05)), prismatic("body", (-1, 0, 0), 0.0, 0.2))
    return assembly.build("box", "7")


@cache
def corpus() -> tuple[Seed, ...]:
    """All seeds, always the same ones in the same order."""
    with tempfile.TemporaryDirectory() as folder:
        return tuple(_seeds(Path(folder)))


def _seeds(folder: Path) -> Iterator[Seed]:
    yield from _robots()
    yield from _joints()
    yield from _meshes()
    yield from _clouds()
    yield from _pictures()
    save_object(small_object(), folder / "o.npz")
    yield Seed("object", "npz", {"o.npz": (folder / "o.npz").read_bytes()}, "o.npz", "npz")
    yield from _datasets(folder / "dataset")
    yield from _estimators(folder / "estimator")
    yield from _runs(folder / "run")


def _robots() -> Iterator[Seed]:
    pair = {
        "mobility.urdf": texts.TWO_BOXES.encode(),
        "meta.json": texts.META,
        "semantics.txt": texts.SEMANTICS,
        "mobility_v2.json": texts.MOBILITY,
    }
    yield Seed("urdf", "pair", pair, "mobility.urdf", "xml")
    yield Seed("urdf", "chain", {"mobility.urdf": texts.CHAIN.encode(), "m.obj": texts.OBJ}, "mobility.urdf", "xml")
    yield Seed("urdf", "mjcf", {"mobility.xml": texts.MJCF.encode(), "m.obj": texts.OBJ}, "mobility.xml", "xml")
    for name, files in mjcf_texts.files(texts.OBJ).items():
        yield Seed("urdf", f"mjcf_{name}", files, "mobility.xml", "xml")
    yield Seed("urdf", "usd", {"mobility.usda": texts.USD.encode()}, "mobility.usda", "text")
    for name, text in usd_corpus.TEXTS.items():
        yield Seed("urdf", f"usda_{name}", {"mobility.usda": text.encode()}, "mobility.usda", "text")
        yield Seed("urdf", f"usdc_{name}", {"mobility.usdc": usd_corpus.binary(text)}, "mobility.usdc", "binary")
    for member, form in (("meta.json", "json"), ("semantics.txt", "text"), ("mobility_v2.json", "json")):
        yield Seed("side", member.partition(".")[0], pair, member, form)


def _meshes() -> Iterator[Seed]:
    import trimesh

    block = trimesh.Trimesh(*_tetrahedron(), process=False)
    buffer = json.dumps(_gltf()).encode()
    contents = {
        "obj": ("obj", texts.OBJ, "text"),
        "stl": ("stl", texts.STL, "text"),
        "stl_binary": ("stl", block.export(file_type="stl"), "binary"),
        "ply": ("ply", texts.PLY, "text"),
        "ply_binary": ("ply", block.export(file_type="ply"), "binary"),
        "dae": ("dae", texts.DAE, "xml"),
        "glb": ("glb", block.export(file_type="glb"), "glb"),
        "gltf": ("gltf", buffer, "json"),
        "msh": ("msh", mjcf_texts.msh(), "binary"),
    }
    for name, (suffix, content, form) in contents.items():
        files = {"mobility.urdf": texts.MESH_ROBOT.format(suffix).encode(), f"m.{suffix}": content}
        yield Seed("mesh", name, files, f"m.{suffix}", form)


def _joints() -> Iterator[Seed]:
    """Annotations of joints in JSON, and what says which meshes they are about."""
    import trimesh

    axis = {"origin": [0, 0, None], "direction": [0, 1, 0]}
    turn = {"axis": axis, "limit": {"a": 90, "b": -10, "noLimit": False}}
    screw = {"axis": axis, "limit": {"a": 0, "b": 0.2, "noLimit": False, "rotates": True, "rotationLimit": 720}}
    rows: list[dict[str, Any]] = [
        {"id": 0, "parent": -1, "joint": "static", "name": "body", "parts": [{"id": 7, "name": "frame"}]},
        {"id": 1, "parent": 0, "joint": "hinge", "name": "door", "parts": [{"id": 8, "name": "board"}]},
        {"id": 2, "parent": 1, "joint": "slider", "name": "knob", "parts": [{"id": 9, "name": "knob"}]},
        {"id": 3, "parent": -1, "joint": "junk", "name": "other", "parts": []},
    ]
    rows[1]["jointData"], rows[2]["jointData"] = turn, screw
    leaves = [{"id": part, "name": "x", "objs": [f"o{part}"]} for part in (7, 8, 9)]
    tree = json.dumps([{"id": 1, "name": "root", "children": leaves}]).encode()
    files = {"mobility_v2.json": json.dumps(rows).encode(), "result.json": tree}
    files |= {f"textured_objs/o{part}.obj": texts.OBJ for part in (7, 8, 9)}
    yield Seed("joints", "version_2", files, "mobility_v2.json", "json")
    yield Seed("joints", "result", files, "result.json", "json")
    scene = trimesh.Scene()
    for part in (7, 8, 9):
        scene.add_geometry(trimesh.creation.box((1, 2, part)), node_name=f"{part}_0", geom_name=f"{part}_0")
    version_3 = json.dumps({"partnet": [], "mobility": rows}).encode()
    whole = {"mobility_v3.json": version_3, "model.glb": scene.export(file_type="glb")}
    yield Seed("joints", "version_3", whole, "mobility_v3.json", "json")
    yield Seed("joints", "glb", whole, "model.glb", "glb")
    child = {"dof_name": "d_1", "motion_type": "rotation", "center": [0, 0, 1], "direction": [0, 1, 0], "children": []}
    node = {**child, "dof_name": "dof_rootd", "motion_type": "none", "children": [child]}
    meshes = {f"part_objs/{name}.obj": texts.OBJ for name in ("none_motion", "d_1")}
    yield Seed(
        "joints", "shape2motion", {"motion_attributes.json": json.dumps(node).encode(), **meshes},
        "motion_attributes.json", "json",
    )  # fmt: skip


def _tetrahedron() -> tuple[list[list[float]], list[list[int]]]:
    return [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]


def _gltf() -> dict[str, Any]:
    """The tetrahedron, its buffer as a data URI."""
    import base64

    vertices, faces = _tetrahedron()
    positions, indices = np.array(vertices, "<f4").tobytes(), np.array(faces, "<u2").tobytes()
    data = base64.b64encode(positions + indices).decode()
    return {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0, "translation": [0, 0, 1], "children": [1]}, {"mesh": 0, "scale": [2, 2, 2]}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "mode": 4}]}],
        "buffers": [{"byteLength": 72, "uri": f"data:application/octet-stream;base64,{data}"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 24}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 1]},
            {"bufferView": 1, "componentType": 5123, "count": 12, "type": "SCALAR"},
        ],
    }


def _clouds() -> Iterator[Seed]:
    points = np.random.default_rng(0).normal(size=(20, 3)) * 0.1 + (0, 0, 1)
    buffer = io.BytesIO()
    np.savez(buffer, points=points)
    table = "\n".join(" ".join(f"{value:.3f}" for value in row) for row in points)
    contents = {
        "npy": (npy_bytes(points.astype(np.float32)), "npy"),
        "npz": (buffer.getvalue(), "npz"),
        "ply": (texts.PLY, "text"),
        "pcd": (texts.PCD, "text"),
        "xyz": (table.encode(), "text"),
        "csv": (("x,y,z\n" + table.replace(" ", ",")).encode(), "text"),
        "obj": (texts.OBJ, "text"),
    }
    for suffix, (content, form) in contents.items():
        yield Seed("cloud", suffix, {f"c.{suffix}": content}, f"c.{suffix}", form)
    binary = texts.PCD.split(b"DATA")[0] + b"DATA binary\n" + np.zeros((4, 4), "<f4").tobytes()
    yield Seed("cloud", "pcd_binary", {"c.pcd": binary}, "c.pcd", "text")


def _pictures() -> Iterator[Seed]:
    rng = np.random.default_rng(1)
    depth = rng.integers(500, 600, (12, 16)).astype(np.uint16)
    mask = np.where(rng.random((12, 16)) < 0.5, 255, 0).astype(np.uint8)
    own = json.dumps(texts.CAMERAS["own"]).encode()
    files = {"depth.png": _png(depth), "mask.png": _png(mask), "camera.json": own}
    yield Seed("depth", "png", files, "depth.png", "png")
    yield Seed("depth", "npy", {**files, "depth.npy": npy_bytes(depth * np.float32(0.001))}, "depth.npy", "npy")
    for name, image in {
        "gray": Image.fromarray(mask),
        "rgba": Image.fromarray(np.dstack([mask, mask, mask, mask])),
        "palette": Image.fromarray(mask).convert("P"),
        "bit": Image.fromarray(mask).convert("1"),
    }.items():
        yield Seed("mask", name, {**files, "mask.png": _png(image)}, "mask.png", "png")
    yield Seed("mask", "npy", {**files, "mask.npy": npy_bytes(mask > 0)}, "mask.npy", "npy")
    for name, camera in texts.CAMERAS.items():
        yield Seed("intrinsics", name, {**files, "camera.json": json.dumps(camera).encode()}, "camera.json", "json")
    yield Seed("intrinsics", "yaml", {**files, "camera.yaml": texts.CAMERA_YAML}, "camera.yaml", "text")


def _png(image: Any) -> bytes:
    buffer = io.BytesIO()
    (image if isinstance(image, Image.Image) else Image.fromarray(image)).save(buffer, "PNG")
    return buffer.getvalue()


def _folder(folder: Path) -> dict[str, bytes]:
    """Every visible file of a folder, by its name in it."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file() and not path.name.startswith("."))
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def _datasets(folder: Path) -> Iterator[Seed]:
    from artsim.datasets.generate import generate
    from artsim.datasets.plan import SampleOptions
    from artsim.loading.sources import find_sources
    from artsim.model.draws import ViewOptions

    (folder.parent / "pair").mkdir()
    (folder.parent / "pair" / "mobility.urdf").write_text(texts.TWO_BOXES)
    options = SampleOptions(num_points=16, images=("depth", "part_mask"), views=ViewOptions(width=16, height=12))
    generate(find_sources([folder.parent / "pair"]), folder, 2, sample=options, workers=1, shard_size=2, progress=False)
    files = _folder(folder)
    (shard,) = (name for name in files if name.endswith(".tar"))
    (compiled,) = (name for name in files if name.endswith(".npz"))
    yield Seed("dataset", "description", files, "dataset.json", "json")
    yield Seed("dataset", "shard", files, shard, "tar")
    yield Seed("dataset", "object", files, compiled, "npz")
    motion = {"name": "motion-000000", "joint_state": [[0.0, 0.1]] * 2, "joint_velocity": [[0.0, 0.0]] * 2}
    recorded = {
        "motions.json": json.dumps({"format": 1, "control_step": 0.05, "motions": [motion]}).encode(),
        "motion-000000.tar": files[shard],
        "objects/motion-000000.npz": files[compiled],
    }
    yield Seed("motions", "description", recorded, "motions.json", "json")


def _runs(folder: Path) -> Iterator[Seed]:
    import torch

    from artperl.training.run_folder import RunFolder

    state = {"options": asdict(TrainOptions()), "best": 1.5, "history": [{"step": 10, "laptop": {"parts": []}}]}
    RunFolder(folder).write(state, {"done": torch.tensor([10, 0, 0]), "perception.a": torch.zeros(3, 4)})
    files = {name: content for name, content in _folder(folder).items() if name.startswith("state")}
    yield Seed("state", "description", files, "state.json", "json")
    yield Seed("state", "tensors", files, "state.safetensors", "safetensors")


def _estimators(folder: Path) -> Iterator[Seed]:
    import torch

    from artperl.boxes.network import Boxes
    from artperl.estimator import save_estimator
    from artperl.methods.full import Estimator
    from artperl.perception.network import Perception
    from artperl.retrieval.box_embedding import by_boxes
    from artperl.retrieval.shape_base import ShapeBase

    torch.manual_seed(0)
    base = by_boxes(ShapeBase.of([small_object(), small_object()], points_per_part=8))
    estimator = Estimator(Perception(3, 4), base, boxes=Boxes(3, 4))
    save_estimator(estimator, folder, {"options": {"categories": ["box"]}})
    files = _folder(folder)
    yield Seed("base", "npz", {"base.npz": files["base.npz"]}, "base.npz", "npz")
    yield Seed("estimator", "settings", files, "estimator.json", "json")
    yield Seed("estimator", "weights", files, "weights.safetensors", "safetensors")
