"""USD files have the bodies, masses and joints of the object."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from artsim.export import FORMATS, export
from artsim.export.options import ExportOptions
from artsim.export.usd import frame_along
from artsim.families import make
from artsim.model.inertia import Inertia
from artsim.model.robot import as_robot
from tests.conftest import installed, valve

rng = np.random.default_rng(0)


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
            alone = len(prims[link.name].GetChildren()) == 1  # a convex surface is its own shape
            assert prim.HasAPI(UsdPhysics.CollisionAPI) == (collides or alone)
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
        kind = "linear" if joint.type == "prismatic" else "angular"
        written = {
            "drive": UsdPhysics.DriveAPI(prims[joint.name], kind).GetMaxForceAttr().Get(),
            "speed": prims[joint.name].GetAttribute("physxJoint:maxJointVelocity").Get() / unit,
            "friction": prims[joint.name].GetAttribute(f"physxJointAxis:{kind}:dynamicFrictionEffort").Get(),
        }
        stop = prims[joint.name].GetAttribute("newton:limitStiffness").Get() * unit
        assert joint.effort / stop <= 0.0051 * (joint.upper - joint.lower)  # full effort hardly passes a limit
        assert written == pytest.approx({"drive": joint.effort, "speed": joint.velocity, "friction": joint.friction})
    assert prims["cap_slide"].GetAttribute("artsim:mimic:multiplier").Get() == pytest.approx(0.002)
    assert prims["cap_slide"].GetRelationship("artsim:mimic:joint").GetTargets()[0].name == "cap_joint"


def test_principal_axes_and_joint_frames_are_right_handed() -> None:
    for axis in rng.normal(size=(20, 3)):
        frame = frame_along(axis / np.linalg.norm(axis))
        assert np.linalg.det(frame) == pytest.approx(1.0)
        np.testing.assert_allclose(frame[:, 0], axis / np.linalg.norm(axis))
        tensor = frame @ np.diag([1.0, 2.0, 2.5]) @ frame.T
        moments, axes = Inertia(1.0, np.zeros(3), tensor).principal()
        assert np.linalg.det(axes) == pytest.approx(1.0)
        np.testing.assert_allclose(axes @ np.diag(moments) @ axes.T, tensor, atol=1e-12)


@pytest.mark.parametrize("base", ["fixed", "free"])
def test_the_articulation_root_is_where_simulators_look_for_it(base: Literal["fixed", "free"], tmp_path: Path) -> None:
    """Of a free base it is a rigid body, which Isaac Lab wants; a fixed one hangs on a joint to the world."""
    installed("pxr")
    from pxr import Usd, UsdPhysics

    obj = make("laptop", 0)
    export(obj, tmp_path, ["usd"], options=ExportOptions(base=base))
    stage = Usd.Stage.Open(str(tmp_path / FORMATS["usd"]))
    (root,) = [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.ArticulationRootAPI)]
    fixed = [UsdPhysics.FixedJoint(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.FixedJoint)]
    if base == "free":
        assert root.HasAPI(UsdPhysics.RigidBodyAPI)
        assert root.GetName() == obj.parts[0].name
        assert not fixed
    else:
        assert root == stage.GetDefaultPrim()
        (joint,) = fixed
        assert joint.GetBody0Rel().GetTargets() == []
        assert [path.name for path in joint.GetBody1Rel().GetTargets()] == [obj.parts[0].name]


@pytest.mark.parametrize("category", ["laptop", "drawer", "valve", "robot_arm"])
def test_the_validators_of_usd_find_nothing_wrong(category: str, tmp_path: Path) -> None:
    installed("pxr")
    from pxr import Usd, UsdValidation

    export(make(category, 0), tmp_path, ["usd"])
    file = str(tmp_path / FORMATS["usd"])
    stage = Usd.Stage.Open(file)
    context = UsdValidation.ValidationContext(UsdValidation.ValidationRegistry().GetOrLoadAllValidators())
    errors = [
        f"{error.GetName()}: {error.GetMessage()}"
        for error in context.Validate(stage)
        if error.GetType() == UsdValidation.ValidationErrorType.Error
    ]
    assert errors == []
