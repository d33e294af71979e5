"""Procedural objects as files: they say what the object is, and read back as the same object."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from artsim.checks.strict_urdf import strict_kinematics, strict_urdf
from artsim.errors import AssetError, ConfigError
from artsim.export import FORMATS, export
from artsim.export.robot import HELPER_SHARE, as_robot
from artsim.export.usd import frame_along, principal_axes
from artsim.families import FAMILIES, make
from artsim.loading.urdf import load
from artsim.making.assembly import Assembly, revolute
from artsim.making.solids import box
from artsim.model.inertia import part_inertia
from artsim.model.kinematics import Array, KinematicTree, transform_points
from artsim.model.objects import ArticulatedObject
from tests.conftest import ASSETS, installed, valve

rng = np.random.default_rng(0)


def states(obj: ArticulatedObject, count: int = 5) -> Array:
    """Random states within limits; half a turn where there are none."""
    limits = np.where(np.isfinite(obj.tree.limits), obj.tree.limits, [-np.pi, np.pi])
    return obj.tree.complete_state(rng.uniform(limits[:, 0], limits[:, 1], (count, len(obj))))


def assert_same(loaded: ArticulatedObject, obj: ArticulatedObject) -> None:
    """Two objects are the same but for rounding."""
    assert loaded.repairs == ()
    assert (loaded.category, loaded.object_id) == (obj.category, obj.object_id)
    assert [(p.name, p.label) for p in loaded.parts] == [(p.name, p.label) for p in obj.parts]
    assert loaded.tree.types == obj.tree.types
    np.testing.assert_array_equal(loaded.tree.parents, obj.tree.parents)
    np.testing.assert_array_equal(loaded.tree.rest, 0.0)
    np.testing.assert_allclose(loaded.tree.axes, obj.tree.axes, atol=1e-12)
    np.testing.assert_allclose(loaded.tree.origins, obj.tree.origins, atol=1e-9)
    np.testing.assert_allclose(loaded.tree.limits, obj.tree.limits, atol=1e-12)
    np.testing.assert_allclose(loaded.part_bounds, obj.part_bounds, atol=1e-8)
    q = states(obj)
    np.testing.assert_allclose(loaded.tree.forward_kinematics(q), obj.tree.forward_kinematics(q), atol=1e-8)


@pytest.mark.parametrize("category", FAMILIES)
def test_every_family_is_written_strictly_and_reads_back_as_it_was(category: str, tmp_path: Path) -> None:
    for seed in (0, 11):
        obj = make(category, seed)
        folder = tmp_path / str(seed)
        export(obj, folder)
        assert strict_urdf(folder) == []
        assert strict_kinematics(obj) == []
        loaded = load(folder)
        assert_same(loaded, obj)
        assert strict_kinematics(loaded) == []


def test_all_joint_types_and_the_order_of_parts_survive(tmp_path: Path) -> None:
    obj = valve()
    export(obj, tmp_path / "3")
    assert strict_urdf(tmp_path / "3") == []
    loaded = load(tmp_path / "3")
    assert_same(loaded, obj)
    assert loaded.tree.joints[2].pitch == pytest.approx(0.002)
    mimic = loaded.tree.joints[4].mimic
    assert mimic is not None
    assert (mimic.source, mimic.multiplier) == (2, pytest.approx(0.005))


def test_a_scaled_object_is_written_at_its_size(tmp_path: Path) -> None:
    obj = valve().scaled(0.5)
    export(obj, tmp_path / "3")
    assert_same(load(tmp_path / "3"), obj)


def test_a_closed_laptop_stays_as_it_is_whatever_rule_its_category_has(tmp_path: Path) -> None:
    """Rest states of PartNet's laptops are found from geometry; ours are known."""
    assembly = Assembly()
    assembly.add("base", box((-0.1, -0.1, 0), (0.1, 0.1, 0.02)))
    lid = box((-0.1, -0.1, 0.03), (0.1, 0.1, 0.04)).turned((0, 1, 0), 0.2, (0.1, 0, 0.03))  # not shut at its zero
    assembly.add("lid", lid, revolute("base", (0, 1, 0), (0.1, 0, 0.03), -0.2, 1.5))
    export(assembly.build("laptop", "5"), tmp_path / "5")
    assert load(tmp_path / "5").tree.rest[1] == 0.0
    meta = json.loads((tmp_path / "5" / "meta.json").read_text())
    del meta["artsim"]
    (tmp_path / "5" / "meta.json").write_text(json.dumps(meta))
    assert load(tmp_path / "5").tree.rest[1] == pytest.approx(-0.2, abs=0.01)


@pytest.mark.parametrize("parts", [["pipe"], ["arm", "pipe", "cap", "knob_2", "knob_1"], ["pipe", "pipe"], "pipe", [3]])
def test_a_list_of_parts_that_does_not_fit_is_not_believed(parts: object, tmp_path: Path) -> None:
    export(valve(), tmp_path / "3")
    meta = json.loads((tmp_path / "3" / "meta.json").read_text())
    meta["artsim"]["parts"] = parts
    (tmp_path / "3" / "meta.json").write_text(json.dumps(meta))
    loaded = load(tmp_path / "3")
    assert [p.name for p in loaded.parts] == ["pipe", "arm", "knob_2", "knob_1", "cap"]
    assert bool(loaded.repairs) == isinstance(parts, list)


def test_the_file_weighs_what_the_object_does(tmp_path: Path) -> None:
    obj = valve()
    meta = export(obj, tmp_path)
    root = etree.parse(str(tmp_path / "mobility.urdf")).getroot()
    masses = {link.get("name"): float(link.find("inertial/mass").get("value")) for link in root.findall("link")}
    own = [part_inertia(obj, k).mass for k in range(len(obj))]
    assert sum(masses.values()) == pytest.approx(sum(own)) == meta["artsim"]["mass_kg"]
    assert masses["pipe"] == pytest.approx(8.0)
    assert masses["cap_thread"] == pytest.approx(HELPER_SHARE * own[2])


def test_collision_shapes_are_convex_and_cover_the_part(tmp_path: Path) -> None:
    obj = make("drawer", 3)
    robot = as_robot(obj)
    for link in robot.links:
        volumes = []
        body = obj.parts[link.part].body
        assert body is not None
        for shape, piece in zip(link.collision, body.pieces, strict=True):
            if hasattr(shape, "size"):
                np.testing.assert_allclose(piece[0].min(axis=0), shape.center - 0.5 * shape.size, atol=1e-12)
                np.testing.assert_allclose(piece[0].max(axis=0), shape.center + 0.5 * shape.size, atol=1e-12)
                volumes.append(np.prod(shape.size))
            else:
                triangles = shape.vertices[shape.faces]
                normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
                normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
                above = np.einsum("fvk,fk->fv", shape.vertices[None] - triangles[:, :1], normals)
                assert above.max() < 1e-6
                volumes.append(np.einsum("fi,fi->", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6)
        assert sum(volumes) * body.density >= 0.999 * link.inertia.mass


def test_joints_are_strong_enough_to_hold_what_they_carry() -> None:
    for joint in as_robot(make("laptop", 0)).joints:
        lid = part_inertia(make("laptop", 0), 1)
        arm = np.linalg.norm(np.cross(joint.axis, lid.center - make("laptop", 0).tree.origins[1]))
        assert joint.effort > 2 * lid.mass * 9.81 * arm


def test_what_cannot_be_exported_says_why(tmp_path: Path) -> None:
    obj = valve()
    with pytest.raises(ConfigError, match="step"):
        export(obj, tmp_path, ["step"])
    with pytest.raises(AssetError, match="two words"):
        export(replace(obj, parts=(replace(obj.parts[0], label="two words"), *obj.parts[1:])), tmp_path)
    with pytest.raises(AssetError, match="no body"):
        export(load(ASSETS / "cabinet"), tmp_path)
    ajar = KinematicTree([obj.tree.joints[0], replace(obj.tree.joints[1], rest=0.5), *obj.tree.joints[2:]])
    with pytest.raises(AssetError, match="not at rest"):
        export(replace(obj, native_tree=ajar), tmp_path)
    assert not any(tmp_path.iterdir())


# --- MJCF and USD ----------------------------------------------------------------------------------------------------


def test_mjcf_has_the_links_masses_and_kinematics_of_the_object(tmp_path: Path) -> None:
    mujoco = installed("mujoco")
    obj = valve()
    export(obj, tmp_path, ["mjcf"])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / FORMATS["mjcf"]))
    robot = as_robot(obj)
    assert model.nbody - 1 == len(robot.links) == len(obj) + 1
    assert model.njnt == len(robot.joints) == len(obj)
    assert model.body_mass.sum() == pytest.approx(sum(part_inertia(obj, k).mass for k in range(len(obj))))
    data = mujoco.MjData(model)
    for q in states(obj):
        for name, value in robot.states(q).items():
            data.joint(name).qpos[0] = value
        mujoco.mj_kinematics(model, data)
        T = obj.tree.forward_kinematics(q)
        for link in robot.links:
            if link.part >= 0:
                place = transform_points(T[link.part], link.origin[None])[0]
                np.testing.assert_allclose(data.body(link.name).xpos, place, atol=1e-9)
                np.testing.assert_allclose(data.body(link.name).xmat.reshape(3, 3), T[link.part, :3, :3], atol=1e-9)


def test_a_screw_advances_in_mujoco_as_it_is_turned(tmp_path: Path) -> None:
    mujoco = installed("mujoco")
    obj = valve()
    export(obj, tmp_path, ["mjcf"])
    model = mujoco.MjModel.from_xml_path(str(tmp_path / FORMATS["mjcf"]))
    model.opt.gravity = 0
    data = mujoco.MjData(model)
    while data.joint("cap_joint").qpos[0] < 5.0 and data.time < 2.0:
        data.joint("cap_joint").qfrc_applied[0] = 0.05
        mujoco.mj_step(model, data)
    turned = data.joint("cap_joint").qpos[0]
    assert turned >= 5.0
    assert data.joint("cap_slide").qpos[0] == pytest.approx(0.002 * turned, rel=1e-3)
    assert data.joint("knob_1_joint").qpos[0] == pytest.approx(0.005 * turned, rel=1e-3)


def test_usd_has_the_bodies_masses_and_joints_of_the_object(tmp_path: Path) -> None:
    installed("pxr")
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    obj = valve()
    export(obj, tmp_path, ["usd"])
    stage = Usd.Stage.Open(str(tmp_path / FORMATS["usd"]))
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
    assert stage.GetDefaultPrim().HasAPI(UsdPhysics.ArticulationRootAPI)
    robot = as_robot(obj)
    prims = {prim.GetName(): prim for prim in stage.Traverse()}
    cache = UsdGeom.XformCache()
    for link in robot.links:
        assert prims[link.name].HasAPI(UsdPhysics.RigidBodyAPI)
        mass = UsdPhysics.MassAPI(prims[link.name])
        assert mass.GetMassAttr().Get() == pytest.approx(link.inertia.mass)
        axes = np.array(Gf.Matrix3d(Gf.Rotation(mass.GetPrincipalAxesAttr().Get()))).T  # Gf's vectors are rows
        tensor = axes @ np.diag(mass.GetDiagonalInertiaAttr().Get()) @ axes.T
        np.testing.assert_allclose(tensor, link.inertia.tensor, rtol=1e-5, atol=1e-7)
        for prim in prims[link.name].GetChildren():
            collides = prim.GetName().startswith("collision")
            assert prim.HasAPI(UsdPhysics.CollisionAPI) == collides
            if not collides:
                points = np.array(UsdGeom.Mesh(prim).GetPointsAttr().Get()) + link.origin
                np.testing.assert_allclose(points.min(axis=0), obj.part_bounds[link.part, 0], atol=1e-6)
    for joint in robot.joints:
        schema = UsdPhysics.PrismaticJoint if joint.type == "prismatic" else UsdPhysics.RevoluteJoint
        made = schema(prims[joint.name])
        assert made
        places, turns = [], []
        for body, position, rotation in (
            (made.GetBody0Rel(), made.GetLocalPos0Attr(), made.GetLocalRot0Attr()),
            (made.GetBody1Rel(), made.GetLocalPos1Attr(), made.GetLocalRot1Attr()),
        ):
            world = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(body.GetTargets()[0]))
            places.append(np.array(world.Transform(Gf.Vec3d(position.Get()))))
            turns.append(np.array(Gf.Rotation(rotation.Get()).TransformDir(Gf.Vec3d(1, 0, 0))))
        np.testing.assert_allclose(places, [robot.links[joint.child].origin] * 2, atol=1e-6)
        np.testing.assert_allclose(turns, [joint.axis] * 2, atol=1e-6)
        limits = [made.GetLowerLimitAttr().Get(), made.GetUpperLimitAttr().Get()]
        unit = 1.0 if joint.type == "prismatic" else 180.0 / np.pi
        np.testing.assert_allclose(limits, [joint.lower * unit, joint.upper * unit], rtol=1e-6)
    assert prims["cap_slide"].GetAttribute("artsim:mimic:multiplier").Get() == pytest.approx(0.002)
    assert prims["cap_slide"].GetRelationship("artsim:mimic:joint").GetTargets()[0].name == "cap_joint"


def test_principal_axes_and_joint_frames_are_right_handed() -> None:
    for axis in rng.normal(size=(20, 3)):
        frame = frame_along(axis / np.linalg.norm(axis))
        assert np.linalg.det(frame) == pytest.approx(1.0)
        np.testing.assert_allclose(frame[:, 0], axis / np.linalg.norm(axis))
        tensor = frame @ np.diag([1.0, 2.0, 2.5]) @ frame.T
        moments, axes = principal_axes(tensor)
        assert np.linalg.det(axes) == pytest.approx(1.0)
        np.testing.assert_allclose(axes @ np.diag(moments) @ axes.T, tensor, atol=1e-12)
