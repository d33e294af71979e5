"""Joints of USD files move bodies as usd-core's parser and the schemas' own formulas say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from artsim.errors import AssetError
from artsim.loading.urdf import load
from artsim.model.objects import ArticulatedObject
from tests.artsim.loading.usd_files import AT_LID, BODY, CUBE, HEAD, HINGE, PAIR, body, joint, repairs_of, written
from tests.conftest import CASES
from tests.usd_oracle import assert_moves_as_parsed

SECOND = CASES / "second"


def limited(**ends: tuple[float, float]) -> str:
    """A generic joint's limits; what is not named is locked."""
    names = [f"{word}{letter}" for word in ("trans", "rot") for letter in "XYZ"]
    rows = [
        f"float limit:{name}:physics:{end} = {value}"
        for name in names
        for end, value in zip(("low", "high"), ends.get(name, (1.0, -1.0)), strict=True)
    ]
    return "\n".join(rows)


def generic(more: str, first: str = "base", second: str = "lid") -> str:
    schemas = ", ".join(f'"PhysicsLimitAPI:{word}{letter}"' for word in ("trans", "rot") for letter in "XYZ")
    return joint("", first, second, AT_LID + more).replace('"j" {', f'"j" (prepend apiSchemas = [{schemas}]) {{')


# --- cases of others -----------------------------------------------------------------------------------------------


def test_a_mirrored_body_stands_where_usd_core_has_it() -> None:
    file = SECOND / "US1_mirrored_body" / "lid.usda"
    obj = load(file)
    np.testing.assert_allclose(obj.box_center[1] - obj.box_center[0], [0, 0, 0.06], atol=1e-7)
    assert_moves_as_parsed(obj, file)


def test_two_hinges_of_one_body_are_a_chain_of_two_turns() -> None:
    file = SECOND / "US4_two_hinges_of_one_body" / "m.usda"
    obj = load(file)
    assert obj.tree.types == ("free", "revolute", "revolute")
    np.testing.assert_allclose(np.rad2deg(obj.tree.limits[1:]), [[0, 90], [-45, 45]], atol=1e-5)
    assert "prim /R/lid: several joints carry it, read as a chain: /R/j, /R/k" in repairs_of(obj)
    assert_moves_as_parsed(obj, file)


# --- where bodies are ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scale", [(-1, 1, 1), (1, -2, 1), (1, 1, -0.5), (-1, -1, -1), (-1, -2, 3), (-2, 1, -1)])
@pytest.mark.parametrize("above", [False, True])
def test_mirrored_and_scaled_bodies_move_as_parsed(scale: tuple[float, ...], above: bool, tmp_path: Path) -> None:
    ops = f"float3 xformOp:scale = {scale}\n"
    order = 'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]\n'
    at = "double3 xformOp:translate = (0.1, 0.2, 1)\n"
    if above:  # the mirror is above the body
        lid = f'def Xform "m" {{\n{at}{ops}{order}def Xform "lid" ({BODY}) {{\n{CUBE}\n}}\n}}\n'
    else:
        lid = f'def Xform "m" {{\ndef Xform "lid" ({BODY}) {{\n{at}{ops}{order}{CUBE}\n}}\n}}\n'
    more = HINGE + "point3f physics:localPos1 = (0.3, 0.1, 0.2)\nquatf physics:localRot1 = (0.5, 0.5, -0.5, 0.5)\n"
    file = written(tmp_path, body("base") + lid + joint("Revolute", "base", "m/lid", more))
    assert_moves_as_parsed(load(file), file)


def test_a_mirrored_body_is_read_in_centimetres_with_y_up(tmp_path: Path) -> None:
    head = HEAD.replace("metersPerUnit = 1", "metersPerUnit = 0.01").replace('"Z"', '"Y"')
    lid = body("lid", (0, 100, 0)).replace(
        'xformOpOrder = ["xformOp:translate"]', 'xformOpOrder = ["xformOp:translate", "xformOp:scale"]'
    )
    lid = lid.replace("double3", "float3 xformOp:scale = (1, 1, -1)\ndouble3", 1)
    file = written(tmp_path, body("base") + lid + joint("Revolute", "base", "lid", HINGE), head)
    assert_moves_as_parsed(load(file), file)


# --- which axes are free -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("free", "types"),
    [
        ({"rotY": (-30.0, 60.0)}, ("revolute",)),
        ({"transZ": (0.0, 0.5)}, ("prismatic",)),
        ({"rotX": (-30.0, 60.0), "rotZ": (-10.0, 10.0)}, ("revolute", "revolute")),
        ({"transX": (0.0, 0.5), "rotX": (-90.0, 90.0)}, ("prismatic", "revolute")),
        ({"transX": (0.0, 0.5), "transY": (0.0, 0.1), "transZ": (-1.0, 0.5)}, ("prismatic",) * 3),
        ({"rotX": (-30.0, 60.0), "rotY": (-20.0, 10.0), "rotZ": (-10.0, 10.0)}, ("revolute",) * 3),
        ({}, ()),
    ],
)
@pytest.mark.parametrize("ends", [("base", "lid"), ("lid", "base")])
def test_a_generic_joint_is_a_chain_of_its_free_axes(
    free: dict[str, tuple[float, float]], types: tuple[str, ...], ends: tuple[str, str], tmp_path: Path
) -> None:
    turned = "quatf physics:localRot0 = (0.5, 0.5, -0.5, 0.5)\n"
    hold = 'def PhysicsFixedJoint "hold" { rel physics:body1 = </o/base> }\n'
    file = written(tmp_path, PAIR + hold + generic(turned + limited(**free), *ends))
    obj = load(file)
    assert sorted(obj.tree.types[1:]) == sorted(types)
    assert (f"leaves {len(types)} axes free" in repairs_of(obj)) == (len(types) > 1)
    assert_moves_as_parsed(obj, file)


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
def test_a_ball_swings_within_its_cone_and_turns_about_its_axis(axis: str, tmp_path: Path) -> None:
    more = (
        f'uniform token physics:axis = "{axis}"\nfloat physics:coneAngle0Limit = 30\nfloat physics:coneAngle1Limit = 45'
    )
    file = written(tmp_path, PAIR + joint("Spherical", "base", "lid", f"{AT_LID}{more}\n"))
    obj = load(file)
    assert obj.tree.types == ("free", "revolute", "revolute", "continuous")
    np.testing.assert_allclose(np.rad2deg(obj.tree.limits[1:3]), [[-30, 30], [-45, 45]], atol=1e-5)
    k = "XYZ".index(axis)
    swung = obj.tree.forward_kinematics([0, np.deg2rad(30), 0, 0])[-1][:3, :3] @ np.eye(3)[k]
    np.testing.assert_allclose(np.abs(swung[(k + 1) % 3]), 0.5, atol=1e-6)  # towards the next axis
    assert "PhysicsSphericalJoint that leaves 3 axes free: read as a chain" in repairs_of(obj)
    assert_moves_as_parsed(obj, file)


def test_joints_of_the_same_bodies_that_meet_at_other_places_close_a_chain(tmp_path: Path) -> None:
    apart = joint("Revolute", "base", "lid", HINGE + AT_LID) + joint("Revolute", "base", "lid", HINGE, "k")
    with pytest.raises(AssetError, match=r"prim /o/k: holds the bodies that /o/j joins, too, and closes a chain"):
        load(written(tmp_path, PAIR + apart))


def test_three_joints_of_the_same_bodies_are_one_chain_whichever_way_round(tmp_path: Path) -> None:
    slide = 'uniform token physics:axis = "Y"\nfloat physics:lowerLimit = 0\nfloat physics:upperLimit = 0.3\n' + AT_LID
    joints = joint("Prismatic", "base", "lid", slide, "a") + joint("Revolute", "base", "lid", HINGE + AT_LID, "b")
    turn = HINGE + 'uniform token physics:axis = "Z"\n' + AT_LID
    file = written(tmp_path, PAIR + joints + joint("Revolute", "base", "lid", turn, "c"))
    for hold in ("base", "lid"):
        whole = f'def PhysicsFixedJoint "hold" {{ rel physics:body1 = </o/{hold}> }}\n'
        file = written(
            tmp_path, PAIR + whole + joints + joint("Revolute", "base", "lid", turn, "c"), name=f"{hold}.usda"
        )
        obj = load(file)
        assert obj.tree.types[1:] == (
            ("prismatic", "revolute", "revolute") if hold == "base" else ("revolute", "revolute", "prismatic")
        )
        assert_moves_as_parsed(obj, file)


# --- the ground ----------------------------------------------------------------------------------------------------

GROUND = (
    'def Cube "ground" (prepend apiSchemas = ["PhysicsCollisionAPI"]) { double size = 1\n'
    f"double3 xformOp:translate = (0, 0, {-0.15})\nfloat3 xformOp:scale = (10, 10, 0.1)\n"
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"] }\n'
)
FIXED = 'def PhysicsFixedJoint "hold" {{ {}rel physics:body1 = </o/base>\n}}\n'
HINGED = PAIR + joint("Revolute", "base", "lid", HINGE + AT_LID)


HOLDS = ["", *(FIXED.format(first) for first in ("", *(f"rel physics:body0 = </o{x}>\n" for x in ("/ground", ""))))]


@pytest.mark.parametrize("hold", HOLDS)
@pytest.mark.parametrize("name", ["ground", "Plate"])
def test_the_ground_is_no_part_of_what_stands_on_it(hold: str, name: str, tmp_path: Path) -> None:
    content = (HINGED + GROUND + hold).replace('"ground"', f'"{name}"').replace("/o/ground", f"/o/{name}")
    obj = load(written(tmp_path, content))
    assert [part.name for part in obj.parts] == ["base", "lid"]
    np.testing.assert_allclose(obj.box_size, 0.2, atol=1e-6)
    assert f"prim /o/{name}: left out" in repairs_of(obj)


def test_a_joint_without_its_first_body_moves_against_the_world(tmp_path: Path) -> None:
    hinge = 'def PhysicsRevoluteJoint "j" { rel physics:body1 = </o/lid>\n' + HINGE + AT_LID + "}\n"
    file = written(tmp_path, body("lid", (0, 0, 1)) + GROUND + hinge)
    obj = load(file)
    assert [part.name for part in obj.parts] == ["world", "lid"]
    assert len(obj.parts[0].faces) == 0
    assert "prim /o/ground: left out: it is the ground" in repairs_of(obj)
    assert_moves_as_parsed(obj, file)


def test_a_static_frame_that_a_joint_names_is_the_objects_root(tmp_path: Path) -> None:
    frame = 'def Xform "frame" { def Cube "slab" { double size = 2 } }\n'
    wall = GROUND.replace('"ground"', '"wall"').replace("(0, 0, -0.15)", "(0, 30, 3)")
    file = written(tmp_path, frame + wall + body("lid", (0, 0, 1)) + joint("Revolute", "frame", "lid", HINGE + AT_LID))
    obj = load(file)
    np.testing.assert_allclose(obj.box_size[0], 2.0, atol=1e-6)
    assert "prim /o/wall: left out: no joint names it, and it is far from the object" in repairs_of(obj)


def test_a_static_frame_around_a_drawer_is_the_objects_root(tmp_path: Path) -> None:
    """No joint names it: it is no ground, as it stands as high as the drawer."""
    slide = 'def PhysicsPrismaticJoint "j" { rel physics:body1 = </o/drawer>\nfloat physics:upperLimit = 0.1 }\n'
    frame = 'def Cube "frame" { double size = 1 }\n'
    obj = load(written(tmp_path, frame + body("drawer") + slide))
    np.testing.assert_allclose(obj.box_size[0], 1.0, atol=1e-6)


def test_a_kinematic_body_that_nothing_joins_stands_as_static_shapes_do(tmp_path: Path) -> None:
    table = body("table", (0, 0, -2), "bool physics:kinematicEnabled = 1", CUBE.replace("0.2", "3"))
    obj = load(written(tmp_path, HINGED + table))
    assert [part.name for part in obj.parts] == ["base", "lid"]
    assert "prim /o/table/shape: left out" in repairs_of(obj)


def test_bodies_that_nothing_joins_to_what_moves_are_left_out_and_said(tmp_path: Path) -> None:
    obj = load(written(tmp_path, HINGED + body("ball", (5, 0, 0))))
    assert [part.name for part in obj.parts] == ["base", "lid"]
    assert "other objects are left out: ball" in repairs_of(obj)


def test_bodies_without_shapes_are_boxes_of_their_inertia(tmp_path: Path) -> None:
    """A box of 2 x 4 x 6 m and 12 kg has moments of 16 + 36, 4 + 36 and 4 + 16 kg m2."""
    weight = "float physics:mass = 12\nfloat3 physics:diagonalInertia = (52, 40, 20)\n"
    bodies = body("base", more=weight, shape="") + body("lid", (0, 0, 1), weight, "")
    obj = load(written(tmp_path, bodies + joint("Revolute", "base", "lid", HINGE + AT_LID)))
    np.testing.assert_allclose(obj.box_size, [[2, 4, 6]] * 2, rtol=1e-6)
    assert "boxes of the same mass and inertia" in repairs_of(obj)


def test_joints_that_usd_core_does_not_know_are_said(tmp_path: Path) -> None:
    obj = load(written(tmp_path, HINGED + 'def PhysxPhysicsGearJoint "gear" { }\n'))
    assert "prim /o/gear: left out: PhysxPhysicsGearJoint is no joint of UsdPhysics" in repairs_of(obj)


# --- joints that follow others -------------------------------------------------------------------------------------

CHAIN = body("base") + body("a", (0, 0, 1)) + body("b", (0, 0, 2))
UP = "point3f physics:localPos0 = (0, 0, 1)\n"


def following(schema: str, rows: str, leader: str = "Revolute", follower: str = "Revolute") -> str:
    lead = joint(leader, "base", "a", "float physics:lowerLimit = -50\nfloat physics:upperLimit = 50\n" + UP, "lead")
    follow = joint(
        follower, "a", "b", "float physics:lowerLimit = -90\nfloat physics:upperLimit = 90\n" + UP + rows, "f"
    )
    return CHAIN + lead + follow.replace('"f" {', f'"f" (prepend apiSchemas = [{schema}]) {{')


LEAD_OF_NEWTON = "rel newton:mimicJoint = </o/lead>\n"
NEWTON = f"{LEAD_OF_NEWTON}float newton:mimicCoef1 = -0.5\nfloat newton:mimicCoef0 = 10\n"
PHYSX = (
    "rel physxMimicJoint:rotX:referenceJoint = </o/lead>\nfloat physxMimicJoint:rotX:gearing = 0.5\n"
    "float physxMimicJoint:rotX:offset = -10\n"
)
MUJOCO = f"rel mjc:target = </o/lead>\ndouble mjc:coef0 = {np.deg2rad(10)}\ndouble mjc:coef1 = -0.5\n"
POLYNOMIAL = f"rel mjc:target = </o/lead>\nuniform double[] mjc:polycoef = [{np.deg2rad(10)}, -0.5, 0, 0, 0]\n"
OURS = "rel artsim:mimic:joint = </o/lead>\n"
OURS += f"double artsim:mimic:multiplier = -0.5\ndouble artsim:mimic:offset = {np.deg2rad(10)}\n"


def state_of_follower(obj: ArticulatedObject, lead: float) -> float:
    """Value of the joint ``f`` where ``lead`` has a value."""
    names = [joint.name for joint in obj.tree.joints]
    q = np.zeros(len(obj.tree))
    q[names.index("lead")] = lead
    return float(obj.tree.complete_state(q)[names.index("f")])


@pytest.mark.parametrize(
    ("schema", "rows"),
    [
        ('"NewtonMimicAPI"', NEWTON),
        ('"PhysxMimicJointAPI:rotX"', PHYSX),
        ('"MjcEqualityJointAPI"', MUJOCO),
        ('"MjcEqualityJointAPI"', POLYNOMIAL),
        ('"NewtonMimicAPI", "MjcEqualityJointAPI"', NEWTON),
        ('"PhysicsMassAPI"', OURS),
    ],
)
def test_a_turn_follows_another_at_minus_half_plus_ten_degrees(schema: str, rows: str, tmp_path: Path) -> None:
    obj = load(written(tmp_path, following(schema, rows)))
    for degrees in (-40.0, 0.0, 20.0):
        assert np.rad2deg(state_of_follower(obj, np.deg2rad(degrees))) == pytest.approx(10 - 0.5 * degrees, abs=1e-4)
    assert "follow" not in repairs_of(obj)


@pytest.mark.parametrize(("leader", "follower"), [("Prismatic", "Revolute"), ("Revolute", "Prismatic")])
def test_physx_counts_in_degrees_and_the_units_of_the_stage(leader: str, follower: str, tmp_path: Path) -> None:
    """In centimetres: 0.5 degrees for each centimetre, or 0.5 centimetres for each degree, and 10 more."""
    head = HEAD.replace("metersPerUnit = 1", "metersPerUnit = 0.01")
    obj = load(written(tmp_path, following('"PhysxMimicJointAPI:rotX"', PHYSX, leader, follower), head))
    if leader == "Prismatic":
        assert np.rad2deg(state_of_follower(obj, 0.2)) == pytest.approx(10 - 0.5 * 20, abs=1e-4)
    else:
        assert state_of_follower(obj, np.deg2rad(20)) == pytest.approx(0.01 * (10 - 0.5 * 20), abs=1e-6)


@pytest.mark.parametrize(("schema", "rows"), [('"NewtonMimicAPI"', NEWTON), ('"MjcEqualityJointAPI"', MUJOCO)])
def test_slides_follow_in_the_units_of_the_stage(schema: str, rows: str, tmp_path: Path) -> None:
    head = HEAD.replace("metersPerUnit = 1", "metersPerUnit = 0.01")
    rows = rows.replace(str(np.deg2rad(10)), "10")
    obj = load(written(tmp_path, following(schema, rows, "Prismatic", "Prismatic"), head))
    assert state_of_follower(obj, 0.3) == pytest.approx(0.01 * 10 - 0.5 * 0.3, abs=1e-6)


@pytest.mark.parametrize(
    ("schema", "rows", "text"),
    [
        ('"NewtonMimicAPI"', NEWTON.replace(LEAD_OF_NEWTON, ""), "no joint to follow: left free"),
        ('"MjcEqualityJointAPI"', MUJOCO.replace("rel mjc:target = </o/lead>", ""), "held at 0.174533"),
        ('"MjcEqualityJointAPI"', f"{MUJOCO}double mjc:coef2 = 1\n", "along a curve: read as its tangent at 0"),
        ('"NewtonMimicAPI", "MjcEqualityJointAPI"', f"{NEWTON}double mjc:coef3 = 1\n", "along a curve"),
    ],
)  # fmt: skip
def test_what_is_assumed_of_a_follower_is_said(schema: str, rows: str, text: str, tmp_path: Path) -> None:
    said = repairs_of(load(written(tmp_path, following(schema, rows))))
    assert "prim /o/f: " in said
    assert text in said


def test_a_follower_that_is_switched_off_is_free(tmp_path: Path) -> None:
    rows = f"{NEWTON}bool newton:mimicEnabled = 0\n"
    obj = load(written(tmp_path, following('"NewtonMimicAPI", "MjcEqualityJointAPI"', rows)))
    assert all(joint.mimic is None for joint in obj.tree.joints)


def test_a_follower_of_nothing_is_refused(tmp_path: Path) -> None:
    rows = NEWTON.replace("/o/lead", "/o/nobody")
    with pytest.raises(AssetError, match=r"prim /o/f: newton:mimicJoint names /o/nobody, which is no joint"):
        load(written(tmp_path, following('"NewtonMimicAPI"', rows)))


def test_one_axis_of_several_follows_one_axis_of_several(tmp_path: Path) -> None:
    free = limited(rotX=(-90.0, 90.0), rotZ=(-90.0, 90.0))
    lead = generic(free, "base", "a").replace('"j"', '"lead"')
    rows = PHYSX.replace("rotX", "rotZ") + 'uniform token physxMimicJoint:rotZ:referenceJointAxis = "rotX"\n'
    follow = generic(free + "\n" + rows, "a", "b").replace('"j"', '"f"')
    follow = follow.replace("apiSchemas = [", 'apiSchemas = ["PhysxMimicJointAPI:rotZ", ')
    obj = load(written(tmp_path, CHAIN + lead + follow))
    names = [joint.name for joint in obj.tree.joints]
    q = np.zeros(len(names))
    q[names.index("lead_rotX")] = np.deg2rad(20)
    followed = np.rad2deg(obj.tree.complete_state(q))
    assert followed[names.index("f_rotZ")] == pytest.approx(0.0, abs=1e-4)
    assert obj.tree.joints[names.index("f_rotX")].mimic is None
