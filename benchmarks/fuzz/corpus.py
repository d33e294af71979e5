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


_MESH_ROBOT = (
    '<robot name="r"><link name="a"><visual><geometry><mesh filename="m.{}"/></geometry></visual></link></robot>'
)

_TWO_BOXES = """<?xml version="1.0"?>
<!-- two boxes -->
<robot name="pair">
  <material name="red"><color rgba="1 0 0 1"/></material>
  <link name="base">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual name="v"><origin xyz="0 0 0.1" rpy="0 0 1.57"/><geometry><box size="1 0.5 0.2"/></geometry>
      <material name="red"/></visual>
    <collision><geometry><box size="1 0.5 0.2"/></geometry></collision>
  </link>
  <link name="lid"><visual><origin xyz="0.5 0 0"/><geometry><box size="1 0.5 0.02"/></geometry></visual></link>
  <joint name="hinge" type="revolute">
    <origin xyz="-0.5 0 0.2" rpy="0 0 0"/><parent link="base"/><child link="lid"/><axis xyz="0 -1 0"/>
    <limit lower="0" upper="2.5" effort="10" velocity="1"/><dynamics damping="0.1" friction="0"/>
  </joint>
</robot>
"""

_CHAIN = """<robot name="chain">
  <link name="base"/>
  <link name="body"><visual><geometry><mesh filename="m.obj" scale="1 1 1"/></geometry></visual></link>
  <link name="drawer"><visual><geometry><cylinder radius="0.1" length="0.3"/></geometry></visual></link>
  <link name="knob"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
  <link name="dial"><visual><geometry><mesh filename="./m.obj" scale="0.5 -0.5 0.5"/></geometry></visual></link>
  <link name="thread"/>
  <link name="cap"><visual><geometry><box size="0.2 0.2 0.2"/></geometry></visual></link>
  <joint name="fix" type="fixed"><origin rpy="1.5707963 0 -1.5707963" xyz="0 0 0"/><parent link="base"/>
    <child link="body"/></joint>
  <joint name="slide" type="prismatic"><origin xyz="0 0.2 0"/><axis xyz="1 0 0"/><limit lower="-0.1" upper="0.4"/>
    <parent link="body"/><child link="drawer"/></joint>
  <joint name="turn" type="continuous"><axis xyz="0 0 1"/><parent link="drawer"/><child link="knob"/></joint>
  <joint name="follow" type="revolute"><axis xyz="0 1 0"/><limit lower="-1" upper="1"/><parent link="body"/>
    <child link="dial"/><mimic joint="turn" multiplier="0.5" offset="0.1"/></joint>
  <joint name="lift" type="prismatic"><axis xyz="0 0 1"/><limit lower="0" upper="0.05"/><parent link="body"/>
    <child link="thread"/></joint>
  <joint name="spin" type="continuous"><axis xyz="0 0 1"/><parent link="thread"/><child link="cap"/></joint>
</robot>
"""

_MJCF = """<mujoco model="pair">
  <compiler angle="radian" autolimits="true"/>
  <default><default class="seen"><geom group="2" contype="0" conaffinity="0" mass="0"/></default></default>
  <asset><mesh name="m" file="m.obj" scale="0.5 0.5 0.5" inertia="shell"/></asset>
  <worldbody>
    <body name="base" pos="0 0 0.1" euler="0 0 1.57">
      <geom type="box" size="0.5 0.25 0.1"/><geom class="seen" type="mesh" mesh="m"/>
      <body name="lid" pos="-0.5 0 0.1">
        <joint name="hinge" axis="0 -1 0" range="0 2.5" damping="0.1" frictionloss="0.01" actuatorfrcrange="-9 9"/>
        <geom type="cylinder" fromto="0 0 0 0.5 0 0" size="0.02"/>
      </body>
      <body name="knob" pos="0 0 0.3">
        <joint name="turn" ref="0.5"/><joint name="push" type="slide" range="0 0.01"/><geom size="0.05"/>
      </body>
    </body>
  </worldbody>
  <equality><joint joint1="push" joint2="turn" polycoef="0 0.001 0 0 0"/></equality>
</mujoco>
"""

_USD = """#usda 1.0
(
    defaultPrim = "o"
    metersPerUnit = 0.01
    upAxis = "Y"
)
def Xform "o"
{
    def Xform "base" (prepend apiSchemas = ["PhysicsRigidBodyAPI", "PhysicsMassAPI"])
    {
        float physics:mass = 2
        def Cube "shape" (prepend apiSchemas = ["PhysicsCollisionAPI"])
        {
            double size = 20
        }
    }
    def Xform "lid" (prepend apiSchemas = ["PhysicsRigidBodyAPI"])
    {
        double3 xformOp:translate = (0, 30, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def Mesh "shape" (prepend apiSchemas = ["PhysicsCollisionAPI", "PhysicsMeshCollisionAPI"])
        {
            uniform token physics:approximation = "convexHull"
            point3f[] points = [(0, 0, 0), (10, 0, 0), (0, 10, 0), (0, 0, 10)]
            int[] faceVertexCounts = [3, 3, 3, 3]
            int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2]
        }
    }
    def PhysicsRevoluteJoint "hinge" (prepend apiSchemas = ["PhysicsDriveAPI:angular"])
    {
        rel physics:body0 = </o/base>
        rel physics:body1 = </o/lid>
        uniform token physics:axis = "Z"
        point3f physics:localPos0 = (0, 30, 0)
        quatf physics:localRot0 = (1, 0, 0, 0)
        float physics:lowerLimit = -30
        float physics:upperLimit = 90
        float drive:angular:physics:maxForce = 100
    }
}
"""

_META = b'{"model_cat": "Laptop", "anno_id": "10211", "artsim": {"parts": ["base", "lid"], "helpers": []}}'
_SEMANTICS = b"base free base_body\nlid hinge lid\n"
_MOBILITY = b'[{"id": 0, "parent": -1, "joint": "free", "jointData": {}}, {"id": 1, "parent": 0, "joint": "hinge"}]'

_OBJ = b"""# a tetrahedron and a quad
mtllib m.mtl
o thing
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
v 1 1 0 0.5 0.5 0.5
vt 0 0
vt 1 0
vn 0 0 1
usemtl red
f 1 3 2
f 1/1/1 2/2/1 4/1/1
f 2//1 3//1 4//1
g back
f -5 -4 -3
s off
f 1 2 5 3
"""

_STL = b"""solid s
facet normal 0 0 1
 outer loop
  vertex 0 0 0
  vertex 1 0 0
  vertex 0 1 0
 endloop
endfacet
facet normal 0 1 0
 outer loop
  vertex 0 0 0
  vertex 1 0 0
  vertex 0 0 1
 endloop
endfacet
endsolid s
"""

_PLY = b"""ply
format ascii 1.0
comment a corner
element vertex 4
property float x
property float y
property float z
property uchar red
element face 2
property list uchar int vertex_indices
end_header
0 0 0 255
1 0 0 255
0 1 0 0
0 0 1 0
3 0 1 2
3 0 3 1
"""

_DAE = b"""<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
 <library_effects><effect id="e"><profile_COMMON><technique sid="t"><phong>
   <diffuse><color>1 0 0 1</color></diffuse></phong></technique></profile_COMMON></effect></library_effects>
 <library_materials><material id="mat"><instance_effect url="#e"/></material></library_materials>
 <library_geometries><geometry id="g"><mesh>
  <source id="p"><float_array id="pa" count="12">0 0 0 10 0 0 0 10 0 0 0 10</float_array>
   <technique_common><accessor source="#pa" count="4" stride="3"><param name="X" type="float"/>
    <param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
  <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  <triangles count="2" material="mat"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3</p></triangles>
  <polylist count="1"><input semantic="VERTEX" source="#v" offset="0"/><vcount>4</vcount><p>0 1 3 2</p></polylist>
 </mesh></geometry></library_geometries>
 <library_nodes><node id="n"><instance_geometry url="#g"/></node></library_nodes>
 <library_visual_scenes><visual_scene id="s"><node id="root"><translate>1 2 3</translate><rotate>0 0 1 90</rotate>
   <matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_geometry url="#g"><bind_material><technique_common>
   <instance_material symbol="mat" target="#mat"/></technique_common></bind_material></instance_geometry>
   <instance_node url="#n"/></node></visual_scene></library_visual_scenes>
 <scene><instance_visual_scene url="#s"/></scene>
</COLLADA>
"""

_PCD = b"""# .PCD v0.7
VERSION 0.7
FIELDS x y z rgb
SIZE 4 4 4 4
TYPE F F F F
COUNT 1 1 1 1
WIDTH 4
HEIGHT 1
VIEWPOINT 0 0 0 1 0 0 0
POINTS 4
DATA ascii
0 0 0.5 0
0.1 0 0.5 0
0 0.1 0.5 0
0.1 0.1 0.6 0
"""

_CAMERAS: dict[str, Any] = {
    "own": {"fx": 20.0, "fy": 20.0, "cx": 8.0, "cy": 6.0, "width": 16, "height": 12},
    "matrix": {"K": [[20, 0, 8], [0, 20, 6], [0, 0, 1]]},
    "bop": {"0": {"cam_K": [20.0, 0, 8, 0, 20.0, 6, 0, 0, 1], "depth_scale": 0.1}},
    "open3d": {"width": 16, "height": 12, "intrinsic_matrix": [20, 0, 0, 0, 20, 0, 8, 6, 1]},
    "realsense": {"width": 16, "height": 12, "ppx": 8.0, "ppy": 6.0, "fx": 20.0, "fy": 20.0, "model": "none"},
}
_CAMERA_YAML = b"""image_width: 16
image_height: 12
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [20.0, 0.0, 8.0, 0.0, 20.0, 6.0, 0.0, 0.0, 1.0]
k: [20.0, 0.0, 8.0, 0.0, 20.0, 6.0, 0.0, 0.0, 1.0]
distortion_model: plumb_bob
d: [0, 0, 0, 0, 0]
"""


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
        "mobility.urdf": _TWO_BOXES.encode(),
        "meta.json": _META,
        "semantics.txt": _SEMANTICS,
        "mobility_v2.json": _MOBILITY,
    }
    yield Seed("urdf", "pair", pair, "mobility.urdf", "xml")
    yield Seed("urdf", "chain", {"mobility.urdf": _CHAIN.encode(), "m.obj": _OBJ}, "mobility.urdf", "xml")
    yield Seed("urdf", "mjcf", {"mobility.xml": _MJCF.encode(), "m.obj": _OBJ}, "mobility.xml", "xml")
    yield Seed("urdf", "usd", {"mobility.usda": _USD.encode()}, "mobility.usda", "text")
    for member, form in (("meta.json", "json"), ("semantics.txt", "text"), ("mobility_v2.json", "json")):
        yield Seed("side", member.partition(".")[0], pair, member, form)


def _meshes() -> Iterator[Seed]:
    import trimesh

    block = trimesh.Trimesh(*_tetrahedron(), process=False)
    buffer = json.dumps(_gltf()).encode()
    contents = {
        "obj": ("obj", _OBJ, "text"),
        "stl": ("stl", _STL, "text"),
        "stl_binary": ("stl", block.export(file_type="stl"), "binary"),
        "ply": ("ply", _PLY, "text"),
        "ply_binary": ("ply", block.export(file_type="ply"), "binary"),
        "dae": ("dae", _DAE, "xml"),
        "glb": ("glb", block.export(file_type="glb"), "glb"),
        "gltf": ("gltf", buffer, "json"),
    }
    for name, (suffix, content, form) in contents.items():
        files = {"mobility.urdf": _MESH_ROBOT.format(suffix).encode(), f"m.{suffix}": content}
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
    files |= {f"textured_objs/o{part}.obj": _OBJ for part in (7, 8, 9)}
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
    meshes = {f"part_objs/{name}.obj": _OBJ for name in ("none_motion", "d_1")}
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
        "ply": (_PLY, "text"),
        "pcd": (_PCD, "text"),
        "xyz": (table.encode(), "text"),
        "csv": (("x,y,z\n" + table.replace(" ", ",")).encode(), "text"),
        "obj": (_OBJ, "text"),
    }
    for suffix, (content, form) in contents.items():
        yield Seed("cloud", suffix, {f"c.{suffix}": content}, f"c.{suffix}", form)
    binary = _PCD.split(b"DATA")[0] + b"DATA binary\n" + np.zeros((4, 4), "<f4").tobytes()
    yield Seed("cloud", "pcd_binary", {"c.pcd": binary}, "c.pcd", "text")


def _pictures() -> Iterator[Seed]:
    rng = np.random.default_rng(1)
    depth = rng.integers(500, 600, (12, 16)).astype(np.uint16)
    mask = np.where(rng.random((12, 16)) < 0.5, 255, 0).astype(np.uint8)
    own = json.dumps(_CAMERAS["own"]).encode()
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
    for name, camera in _CAMERAS.items():
        yield Seed("intrinsics", name, {**files, "camera.json": json.dumps(camera).encode()}, "camera.json", "json")
    yield Seed("intrinsics", "yaml", {**files, "camera.yaml": _CAMERA_YAML}, "camera.yaml", "text")


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
    (folder.parent / "pair" / "mobility.urdf").write_text(_TWO_BOXES)
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
