"""Procedural objects as files: they are strict, say what the object is, and read back as the same object."""

from __future__ import annotations

import csv
import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from artsim.assembly import Assembly, continuous, prismatic, revolute, screw
from artsim.errors import AssetError, ConfigError, DatasetError
from artsim.export import FORMATS, export
from artsim.export.batch import generate_objects
from artsim.export.robot import HELPER_SHARE, as_robot
from artsim.export.usd import frame_along, principal_axes
from artsim.families import FAMILIES, make
from artsim.inertia import joined_inertia, part_inertia
from artsim.kinematics import Array, Joint, KinematicTree, transform_points
from artsim.objects import ArticulatedObject
from artsim.solids import Solid, box, cylinder, ring
from artsim.strict import strict_kinematics, strict_urdf
from artsim.urdf import load
from tests.conftest import ASSETS

rng = np.random.default_rng(0)


def valve() -> ArticulatedObject:
    """Every type of joint, a mimic relation, and parts in another order than a walk through the tree gives."""
    assembly = Assembly()
    assembly.add("pipe", box((-0.1, -0.1, 0), (0.1, 0.1, 0.2)), density=1000.0)
    arm = revolute("pipe", (0, 0, 1), (0.15, 0, 0), -1, 2)
    assembly.add("arm", box((0.15, -0.02, 0), (0.35, 0.02, 0.05)), arm)
    cap = screw("pipe", (0, 0, 1), (0, 0, 0.2), 0, 20, 0.002)
    assembly.add("cap", cylinder((0, 0, 0.21), (0, 0, 0.25), 0.05), cap)
    knob = continuous("arm", (1, 2, 0), (0.4, 0, 0))
    assembly.add("knob_2", ring((0.41, 0, 0.01), (1, 0, 0), 0.01, 0.02, 0.02), knob)
    slide = prismatic("arm", (1, 0, 1), 0, 0.1, mimic=("cap", 0.005))
    assembly.add("knob_1", box((0.4, 0.1, 0), (0.42, 0.12, 0.02)), slide)
    return assembly.build("valve", "3")


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


# --- mass and inertia ------------------------------------------------------------------------------------------------


def test_a_box_weighs_its_volume_and_turns_as_the_formula_says() -> None:
    obj = valve()
    inertia = part_inertia(obj, 0)
    a, b, c = 0.2, 0.2, 0.2
    mass = a * b * c * 1000.0
    assert inertia.mass == pytest.approx(mass)
    np.testing.assert_allclose(inertia.center, obj.box_center[0], atol=1e-12)
    exact = np.diag([b * b + c * c, a * a + c * c, a * a + b * b]) * mass / 12
    np.testing.assert_allclose(inertia.tensor, exact, atol=1e-12)


def test_mass_grows_with_the_third_power_of_size_and_inertia_with_the_fifth() -> None:
    small, large = part_inertia(valve(), 3), part_inertia(valve().scaled(2.0), 3)
    assert large.mass == pytest.approx(8 * small.mass)
    np.testing.assert_allclose(large.tensor, 32 * small.tensor, atol=1e-15)


def test_overlapping_pieces_weigh_what_their_union_does() -> None:
    assembly = Assembly()
    assembly.add("block", box((0, 0, 0), (1, 1, 1)) + box((0.5, 0, 0), (1.5, 1, 1)), density=2.0)
    assert part_inertia(assembly.build("block", "0"), 0).mass == pytest.approx(3.0)


def test_halves_joined_are_the_whole() -> None:
    def solid(*parts: Solid) -> ArticulatedObject:
        assembly = Assembly()
        for i, part in enumerate(parts):
            assembly.add(f"half_{i}", part, prismatic("half_0", (1, 0, 0), 0, 1) if i else None)
        return assembly.build("solid", "0")

    whole = part_inertia(solid(box((0, 0, 0), (2, 1, 1))), 0)
    halves = solid(box((0, 0, 0), (1, 1, 1)), box((1, 0, 0), (2, 1, 1)))
    joined = joined_inertia(part_inertia(halves, k) for k in range(2))
    assert joined.mass == pytest.approx(whole.mass)
    np.testing.assert_allclose(joined.tensor, whole.tensor, rtol=1e-12, atol=1e-12)
    # A rod about its end: m l^2 / 3, and the same of its cross-section.
    end = joined.about(joined.center - [1.0, 0, 0], np.array([0.0, 0, 1]))
    assert end == pytest.approx(whole.mass * (4 / 3 + 1 / 12))


def test_what_nothing_is_known_of_has_no_mass() -> None:
    with pytest.raises(AssetError, match="has no body"):
        part_inertia(load(ASSETS / "laptop"), 0)
    obj = valve()
    flat = replace(obj.parts[0], faces=obj.parts[0].faces[:2])
    with pytest.raises(AssetError, match="encloses no solid"):
        part_inertia(replace(obj, parts=(flat, *obj.parts[1:])), 0)


@pytest.mark.parametrize("category", FAMILIES)
def test_inertias_of_every_family_are_those_of_possible_bodies(category: str) -> None:
    obj = make(category, 7)
    for k in range(len(obj)):
        moments = np.linalg.eigvalsh(part_inertia(obj, k).tensor)
        assert moments[0] > 0
        assert moments[2] <= moments[:2].sum() * (1 + 1e-9)


# --- folders ---------------------------------------------------------------------------------------------------------


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


# --- strictness ------------------------------------------------------------------------------------------------------

Mutation = Callable[[etree._Element], object]


def _drop(path: str) -> Mutation:
    def mutate(root: etree._Element) -> None:
        element = root.find(path)
        element.getparent().remove(element)

    return mutate


def _set(path: str, **attributes: str) -> Mutation:
    return lambda root: [root.find(path).set(name, value) for name, value in attributes.items()]


@pytest.mark.parametrize(
    ("mutate", "problem"),
    [
        (_drop("link[@name='arm']/inertial"), "link 'arm': has no <inertial>"),
        (_drop("link[@name='arm']/visual"), "link 'arm': has no <visual>"),
        (_drop("link[@name='arm']/collision"), "link 'arm': has no <collision>"),
        (_set("link[@name='arm']/inertial/mass", value="0"), "link 'arm': has no mass above 0"),
        (_set("link[@name='arm']/inertial/inertia", ixx="-1"), "link 'arm': its inertia is not positive definite"),
        (_set("link[@name='arm']/inertial/inertia", ixx="nan"), "link 'arm': its inertia is not six finite numbers"),
        (_set("link[@name='arm']/inertial/inertia", ixx="5"), "possible body"),
        (_set("link[@name='arm']/visual/geometry/mesh", filename="meshes/lost.obj"), "'meshes/lost.obj' is missing"),
        (_set("link[@name='pipe']/collision/geometry/box", size="1 1 0"), "<box> has no size above 0"),
        (_set("link[@name='arm']", name="pipe"), "link 'pipe': 2 of them"),
        (_set("joint[@name='arm_joint']", name="cap_joint"), "joint 'cap_joint': 2 of them"),
        (_drop("joint[@name='arm_joint']"), "2 root links: arm, pipe"),
        (_set("joint[@name='arm_joint']/parent", link="knob_2"), "hangs on a cycle"),
        (_set("joint[@name='arm_joint']/parent", link="nobody"), "its parent 'nobody' is no link"),
        (_set("joint[@name='arm_joint']/child", link="cap"), "link 'cap': carried by 2 joints"),
        (_set("joint[@name='arm_joint']/axis", xyz="0 0 2"), "joint 'arm_joint': its axis has length 2"),
        (_drop("joint[@name='arm_joint']/axis"), "joint 'arm_joint': has no axis"),
        (_drop("joint[@name='arm_joint']/limit"), "joint 'arm_joint': has no limit"),
        (_set("joint[@name='arm_joint']/limit", effort="0"), "joint 'arm_joint': has no effort limit above 0"),
        (_set("joint[@name='arm_joint']/limit", lower="0.5"), "joint 'arm_joint': 0 is outside its limits [0.5, 2]"),
        (_set("joint[@name='arm_joint']/limit", lower="0", upper="0"), "joint 'arm_joint': its limits let it not move"),
        (_set("joint[@name='knob_2_joint']/limit", lower="0", upper="1"), "turns freely, but has position limits"),
        (_set("joint[@name='arm_joint']/origin", xyz="0 nan 0"), "not three finite numbers"),
        (_set("joint[@name='arm_joint']", type="planar"), "joint 'arm_joint': type 'planar' is not one of"),
        (_set("joint[@name='knob_1_joint']/mimic", joint="nobody"), "mimics 'nobody', which is no joint"),
        (_set("joint[@name='knob_1_joint']/mimic", joint="knob_1_joint"), "mimic relations form a loop"),
        (_drop("joint[@name='cap_slide']/mimic"), "link 'cap_thread': has no <visual>"),
    ],
)
def test_strictness_names_what_is_missing(mutate: Mutation, problem: str, tmp_path: Path) -> None:
    export(valve(), tmp_path)
    file = tmp_path / "mobility.urdf"
    tree = etree.parse(str(file))
    mutate(tree.getroot())
    tree.write(str(file))
    assert any(problem in found for found in strict_urdf(tmp_path)), strict_urdf(tmp_path)


def test_files_that_are_no_urdf_are_not_strict(tmp_path: Path) -> None:
    assert "no such file" in strict_urdf(tmp_path / "none.urdf")[0]
    (tmp_path / "a.urdf").write_text("<robot name='a'>")
    assert "not well-formed" in strict_urdf(tmp_path)[0]


def test_a_folder_in_partnets_manner_is_not_strict() -> None:
    problems = strict_urdf(ASSETS / "laptop")
    assert {"link 'base': has no <visual>", "link 'base': has no <inertial>"} <= set(problems)
    assert "joint 'joint_1': has no effort limit above 0" in problems


@pytest.mark.parametrize(
    ("joint", "problem"),
    [
        (Joint("a", "revolute", 0, lower=-np.inf, upper=np.inf), "is revolute without limits"),
        (Joint("a", "continuous", 0, lower=-1, upper=1), "turns freely, but has limits"),
        (Joint("a", "prismatic", 0, lower=0.1, upper=1, rest=0.1), "0 or its rest state is outside"),
        (Joint("a", "prismatic", 0, lower=0, upper=1, rest=2), "0 or its rest state is outside"),
        (Joint("a", "prismatic", 0), "let it not move"),
        (Joint("a", "screw", 0, lower=0, upper=1), "without a pitch"),
    ],
)
def test_strict_kinematics_names_the_joint(joint: Joint, problem: str) -> None:
    obj = valve()
    tree = KinematicTree([Joint("root", "free", -1), joint])
    problems = strict_kinematics(replace(obj, parts=obj.parts[:2], native_tree=tree))
    assert len(problems) == 1
    assert problems[0].startswith("joint 'a': ")
    assert problem in problems[0]


def test_a_follower_must_not_be_driven_beyond_its_limits() -> None:
    obj = valve()
    joints = list(obj.tree.joints)
    joints[4] = replace(joints[4], upper=0.05)
    assert strict_kinematics(obj) == []
    assert "is carried to [0, 0.1]" in strict_kinematics(replace(obj, native_tree=KinematicTree(joints)))[0]


# --- MJCF and USD ----------------------------------------------------------------------------------------------------


def test_mjcf_has_the_links_masses_and_kinematics_of_the_object(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
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
    mujoco = pytest.importorskip("mujoco")
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
    pytest.importorskip("pxr")
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


# --- runs ------------------------------------------------------------------------------------------------------------


def content(folder: Path) -> dict[str, bytes]:
    """Bytes of every file below a folder."""
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


def test_bytes_depend_on_the_seed_alone_and_whole_objects_are_kept(tmp_path: Path) -> None:
    formats = [name for name in FORMATS if name != "usd"]
    one = generate_objects(["laptop", "drawer"], tmp_path / "one", 2, 5, formats, workers=1, progress=False)
    two = generate_objects(["laptop", "drawer"], tmp_path / "two", 2, 5, formats, workers=2, progress=False)
    assert (one.objects, one.made) == (two.objects, two.made) == (4, 4)
    assert content(tmp_path / "one") == content(tmp_path / "two")

    # One object lost, one half made, one of another version: only these are made.
    for file in sorted((tmp_path / "two/laptop/5").rglob("*"), reverse=True):
        file.rmdir() if file.is_dir() else file.unlink()
    (tmp_path / "two/laptop/5").rmdir()
    (tmp_path / "two/laptop/.5.123.part").mkdir()
    meta = tmp_path / "two/drawer/6/meta.json"
    meta.write_text(meta.read_text().replace('"version": "', '"version": "0.0.'))
    kept = (tmp_path / "two/laptop/6/mobility.urdf").stat().st_mtime_ns
    again = generate_objects(["laptop", "drawer"], tmp_path / "two", 2, 5, formats, workers=1, progress=False)
    assert again.made == 2
    assert (tmp_path / "two/laptop/6/mobility.urdf").stat().st_mtime_ns == kept
    assert content(tmp_path / "one") == content(tmp_path / "two")
    assert generate_objects(["laptop", "drawer"], tmp_path / "two", 2, 5, formats, progress=False).made == 0

    rows = list(csv.DictReader((tmp_path / "two/index.csv").read_text().splitlines()))
    assert [row["folder"] for row in rows] == ["laptop/5", "laptop/6", "drawer/5", "drawer/6"]
    for row in rows:
        obj = make(row["category"], int(row["object_id"]))
        assert row["parts"].split() == [part.name for part in obj.parts]
        assert row["sha256"] == obj.sha256
        assert (tmp_path / "two" / row["folder"] / FORMATS["mjcf"]).is_file()


def test_usd_is_written_to_the_same_bytes_each_time(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    for name in ("one", "two"):
        export(make("laptop", 1), tmp_path / name, ["usd"])
    assert content(tmp_path / "one") == content(tmp_path / "two")


@pytest.mark.parametrize(
    ("more", "problem"),
    [
        ({"categories": ["lapdog"]}, "'lapdog'"),
        ({"categories": []}, "no category"),
        ({"count": 0}, "count"),
        ({"workers": 0}, "workers"),
        ({"seed": -1}, "seed"),
        ({"formats": ["step"]}, "step"),
        ({"formats": []}, "formats"),
    ],
)
def test_options_that_make_no_sense_are_refused(more: dict[str, object], problem: str, tmp_path: Path) -> None:
    options: dict[str, object] = {"categories": ["laptop"], "out": tmp_path / "out", "count": 1, **more}
    with pytest.raises(ConfigError, match=problem):
        generate_objects(**options)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_a_folder_that_cannot_be_written_to_is_named(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("a file")
    with pytest.raises(ConfigError, match="cannot write"):
        generate_objects(["laptop"], tmp_path / "out", 1, progress=False)


def test_two_runs_do_not_share_a_folder(tmp_path: Path) -> None:
    import fcntl

    with (tmp_path / ".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with pytest.raises(DatasetError, match="another run"):
            generate_objects(["laptop"], tmp_path, 1, progress=False)


def test_ctrl_c_keeps_whole_objects_and_leaves_nothing_else(tmp_path: Path) -> None:
    options = ["--category", "laptop", "--count", "2000", "--workers", "1", "--out", str(tmp_path)]
    run = subprocess.Popen(
        [sys.executable, "-c", "from artsim.cli import main; main()", "generate-objects", *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a job in the background ignores Ctrl-C
    )
    deadline = time.monotonic() + 60
    while not list(tmp_path.glob("laptop/[0-9]*")) and time.monotonic() < deadline:
        time.sleep(0.05)
    run.send_signal(signal.SIGINT)
    output, _ = run.communicate(timeout=60)
    assert run.returncode == 130
    assert "whole objects are kept" in output
    made = sorted((tmp_path / "laptop").iterdir())
    assert made
    assert all(folder.name.isdigit() for folder in made)
    assert all(strict_urdf(folder) == [] for folder in made)
    assert not (tmp_path / "index.csv").exists()
