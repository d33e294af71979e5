"""Scenes that simulate: objects with free joints in one MJCF file, one USD file, and as URDF files with places.

A folder of a scene holds ``objects/NAME`` with the files of each object (:func:`artsim.export.export`), ``scene.xml``
for MuJoCo, with the joint states of the scene as the keyframe ``scene``, ``scene.usda``, which places the objects' USD
files at rest, and ``scene.json``: for each object its URDF file, ``T_world_object``, joint states, and the joints that
would meet another object somewhere in their range. The support is the plane z = 0. Distractors are left out.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree

from artsim.common.extras import import_mujoco, require_extra
from artsim.common.files import read_json, write_atomic
from artsim.common.names import unused_name
from artsim.errors import ConfigError
from artsim.export import FORMATS, export, prepare
from artsim.export.options import Base, ExportOptions
from artsim.export.text import numbers
from artsim.model.draws import joint_intervals
from artsim.model.kinematics import Array
from artsim.model.robot import Robot, as_robot
from artsim.renderers.scene import Thing

_STEPS = 9
"""States over each joint's range in which it must be free of other objects."""
_NAMES = ("name", "mesh", "material", "texture", "joint", "joint1", "joint2", "body1", "body2")
_FILES = ("mesh", "texture")
_MAX_BYTES = 64_000_000
_MEETING = -1e-3
"""Metres: what crosses less only touches."""


@dataclass(frozen=True)
class SceneFiles:
    """What was written of a scene."""

    folder: Path
    names: tuple[str, ...]
    """Of the objects."""
    blocked: tuple[str, ...]
    """``NAME/JOINT`` of joints that would meet another object somewhere in their range."""


def write_simulation(
    instances: Sequence[Thing], folder: Path, base: Base = "fixed", recipe: Mapping[str, Any] | None = None,
    notes: Mapping[str, Any] | None = None,
) -> SceneFiles:  # fmt: skip
    """Write articulated objects where they stand, so that simulators load them with all joints free.

    Parameters
    ----------
    instances : sequence of Thing
        Such as those of a :class:`artsim.renderers.scene.Scene`.
    folder : path
        Made if missing.
    base : Base
        Whether roots are ``fixed`` where they stand, or ``free`` to be pushed (MJCF and USD).
    recipe : mapping, optional
        What the scene follows from, in JSON's terms. A folder that was written by the same is left alone.
    notes : mapping, optional
        More for ``scene.json``.

    Raises
    ------
    AssetError
        When an object lacks what physics needs.
    ConfigError
        When MuJoCo or usd-core is not installed.
    """
    found = _written(folder)
    if recipe is not None and found is not None and found.get("recipe") == recipe:
        return SceneFiles(folder, tuple(own["name"] for own in found["objects"]), tuple(found["blocked"]))
    things = [_with_bodies(thing) for thing in instances]
    robots = [as_robot(thing.obj) for thing in things]
    names = tuple(f"{thing.obj.category or 'object'}_{number}" for number, thing in enumerate(things))
    for name, thing in zip(names, things, strict=True):
        export(thing.obj, folder / "objects" / name, ("urdf", "mjcf", "usd"), options=ExportOptions(base))
    write_atomic(folder / "scene.xml", _mjcf(folder, names, things))
    _add_keyframe(folder / "scene.xml", names, things, robots)
    write_atomic(folder / "scene.usda", _usd(folder, names, things, base).encode())
    blocked = _blocked(folder / "scene.xml", names, things, robots)
    record = [
        {
            "name": name, "category": thing.obj.category, "object_id": thing.obj.object_id,
            "urdf": f"objects/{name}/{FORMATS['urdf']}", "T_world_object": thing.T_world_object.tolist(),
            "joints": robot.states(thing.q),
        }
        for name, thing, robot in zip(names, things, robots, strict=True)
    ]  # fmt: skip
    content = {"recipe": recipe, "objects": record, "blocked": blocked, **(notes or {})}
    write_atomic(folder / "scene.json", (json.dumps(content, indent=1) + "\n").encode())
    return SceneFiles(folder, names, tuple(blocked))


def _with_bodies(thing: Thing) -> Thing:
    """An object of a file gets what physics needs, and stands at rest at q = 0."""
    if all(part.body is not None for part in thing.obj.parts) and not thing.obj.tree.rest.any():
        return thing
    return replace(thing, obj=prepare(thing.obj, progress=False), q=thing.q - thing.obj.tree.rest)


def _mjcf(folder: Path, names: Sequence[str], things: Sequence[Thing]) -> bytes:
    """The objects' MJCF files in one: names get that of the object before them."""
    root = etree.Element("mujoco", model="scene")
    sections = {tag: etree.Element(tag) for tag in ("asset", "worldbody", "contact", "equality")}
    for name, thing in zip(names, things, strict=True):
        own = etree.fromstring((folder / "objects" / name / FORMATS["mjcf"]).read_bytes())
        if not len(root):
            root.extend([own.find("option"), own.find("compiler"), own.find("default")])
            root.find("compiler").attrib.pop("meshdir")
        for element in own.iter():
            for key in _NAMES:
                if key in element.attrib:
                    element.set(key, f"{name}/{element.get(key)}")
            if element.tag in _FILES and "file" in element.attrib:
                element.set("file", f"objects/{name}/meshes/{Path(element.get('file')).name}")
        body = own.find("worldbody/body")
        position = thing.T_world_object @ [*map(float, body.get("pos").split()), 1.0]
        body.set("pos", numbers(position[:3]))
        body.set("quat", numbers(_quaternion(thing.T_world_object[:3, :3])))
        for tag, section in sections.items():
            found = own.find(tag)
            section.extend(list(found) if found is not None else [])
    etree.SubElement(sections["worldbody"], "geom", name="support", type="plane", size="0 0 1")
    etree.SubElement(sections["worldbody"], "light", pos="0 0 4", directional="true")
    root.extend(sections.values())
    text: bytes = etree.tostring(root, pretty_print=True)
    return text


def _add_keyframe(path: Path, names: Sequence[str], things: Sequence[Thing], robots: Sequence[Robot]) -> None:
    """The states of the scene, in MuJoCo's order."""
    mujoco = import_mujoco("MJCF files")

    model = mujoco.MjModel.from_xml_path(str(path))
    qpos = model.qpos0.copy()
    for name, thing, robot in zip(names, things, robots, strict=True):
        for joint, value in robot.states(thing.q).items():
            qpos[model.joint(f"{name}/{joint}").qposadr[0]] = value
    root = etree.fromstring(path.read_bytes())
    etree.SubElement(etree.SubElement(root, "keyframe"), "key", name="scene", qpos=numbers(qpos))
    write_atomic(path, etree.tostring(root, pretty_print=True))


def _blocked(path: Path, names: Sequence[str], things: Sequence[Thing], robots: Sequence[Robot]) -> list[str]:
    """Joints that meet another object, all others being where they are in the scene."""
    mujoco = import_mujoco("MJCF files")

    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    owner = model.body_rootid[model.geom_bodyid]
    support = model.geom("support").id

    def meets(name: str, thing: Thing, robot: Robot, k: int, value: float) -> bool:
        q = thing.q.copy()
        q[k] = value
        mujoco.mj_resetDataKeyframe(model, data, 0)
        for joint, state in robot.states(q).items():
            data.qpos[model.joint(f"{name}/{joint}").qposadr[0]] = state
        mujoco.mj_forward(model, data)
        root = model.body_rootid[model.body(f"{name}/{thing.obj.parts[0].name}").id]
        pairs = [owner[each.geom] for each in data.contact if each.dist < _MEETING and support not in each.geom]
        return any(one != other and root in (one, other) for one, other in pairs)

    found = []
    for name, thing, robot in zip(names, things, robots, strict=True):
        intervals = joint_intervals(thing.obj)
        for k in thing.obj.tree.free_joints:
            values = np.linspace(intervals[k, 0], intervals[k, 1], _STEPS)
            if any(meets(name, thing, robot, k, value) for value in values):
                found.append(f"{name}/{thing.obj.tree.joints[k].name}")
    return found


def _usd(folder: Path, names: Sequence[str], things: Sequence[Thing], base: str) -> str:
    """The objects' USD files, each at its place; a fixed base is held there."""
    with require_extra("USD files"):
        from pxr import Gf, Usd, UsdGeom, UsdPhysics

    unsaved = folder / ".scene.usda"  # beside what it refers to
    stage = Usd.Stage.CreateNew(str(unsaved))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    world = UsdGeom.Xform.Define(stage, "/World")
    stage.SetDefaultPrim(world.GetPrim())
    UsdPhysics.Scene.Define(stage, "/World/physics").CreateGravityDirectionAttr(Gf.Vec3f(0.0, 0.0, -1.0))
    support = UsdGeom.Plane.Define(stage, "/World/support")
    support.CreateAxisAttr(UsdGeom.Tokens.z)
    UsdPhysics.CollisionAPI.Apply(support.GetPrim())
    for name, thing in zip(names, things, strict=True):
        T = thing.T_world_object
        w, x, y, z = _quaternion(T[:3, :3]).tolist()
        placed = UsdGeom.Xform.Define(stage, f"/World/{name}")
        placed.GetPrim().GetReferences().AddReference(f"./objects/{name}/{FORMATS['usd']}")
        placed.AddTranslateOp().Set(Gf.Vec3d(*T[:3, 3].tolist()))
        placed.AddOrientOp().Set(Gf.Quatf(w, x, y, z))
        if base == "fixed":  # the world's side of the joint that holds the base
            word = unused_name("fixed_base", {part.name for part in thing.obj.parts})
            held = UsdPhysics.FixedJoint(stage.OverridePrim(f"/World/{name}/{word}"))
            held.CreateLocalPos0Attr(Gf.Vec3f(*T[:3, 3].tolist()))
            held.CreateLocalRot0Attr(Gf.Quatf(w, x, y, z))
    text: str = stage.GetRootLayer().ExportToString()
    unsaved.unlink()
    return text


def _quaternion(rotation: Array) -> Array:
    """w, x, y, z."""
    from scipy.spatial.transform import Rotation

    quaternion: Array = Rotation.from_matrix(rotation).as_quat()[[3, 0, 1, 2]]
    return quaternion


def _written(folder: Path) -> dict[str, Any] | None:
    """The record of a scene that is there whole."""
    path = folder / "scene.json"
    found = read_json(path, "the record of a scene", ConfigError, _MAX_BYTES) if path.is_file() else None
    return found if isinstance(found, dict) else None
