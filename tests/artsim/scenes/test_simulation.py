"""Scenes simulate: MuJoCo, USD and SAPIEN have every part where the scene has it, and joints move over their range."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim.renderers.scene import Scene, Thing
from artsim.scenes.random_scene import SceneOptions, make_scene
from artsim.scenes.simulation import write_simulation
from tests.conftest import installed

KITCHEN = ("refrigerator", "oven", "dishwasher", "microwave", "storage_furniture", "washing_machine", "trash_can",
           "storage_furniture", "drawer", "table")  # fmt: skip


@pytest.fixture(scope="module")
def kitchen(tmp_path_factory: pytest.TempPathFactory) -> tuple[Scene, Path]:
    installed("mujoco")
    installed("pxr")
    scene = make_scene(SceneOptions(categories=KITCHEN, place="row", distractors=0), 1)
    folder = tmp_path_factory.mktemp("kitchen") / "scene"
    assert write_simulation(scene.instances, folder).blocked == ()
    return scene, folder


def test_mujoco_has_every_part_where_the_scene_has_it_and_holds_it_there(kitchen: tuple[Scene, Path]) -> None:
    mujoco = installed("mujoco")
    scene, folder = kitchen
    record = json.loads((folder / "scene.json").read_text())["objects"]
    model = mujoco.MjModel.from_xml_path(str(folder / "scene.xml"))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    for thing, own in zip(scene.instances, record, strict=True):
        for k, part in enumerate(thing.obj.parts):
            body = data.body(f"{own['name']}/{part.name}")
            T = thing.T_world_part[k]
            np.testing.assert_allclose(body.xmat.reshape(3, 3), T[:3, :3], atol=1e-6)
            place = thing.obj.tree.origins[k] if k else np.zeros(3)
            np.testing.assert_allclose(body.xpos, T[:3, :3] @ place + T[:3, 3], atol=1e-6)
    before = data.xpos.copy()
    for _ in range(500):
        mujoco.mj_step(model, data)
    assert np.abs(data.xpos - before).max() < 0.05


def test_usd_has_the_objects_at_rest_at_their_places_and_holds_them_there(kitchen: tuple[Scene, Path]) -> None:
    from pxr import Gf, Usd, UsdGeom, UsdPhysics

    scene, folder = kitchen
    stage = Usd.Stage.Open(str(folder / "scene.usda"))
    cache, joints = UsdGeom.XformCache(), 0
    for number, thing in enumerate(scene.instances):
        root = f"/World/{thing.obj.category}_{number}"
        for k, part in enumerate(thing.obj.parts):
            own = thing.obj.tree.origins[k] if k else np.zeros(3)
            found = cache.GetLocalToWorldTransform(stage.GetPrimAtPath(f"{root}/{part.name}"))
            wanted = thing.T_world_object[:3, :3] @ own + thing.T_world_object[:3, 3]
            np.testing.assert_allclose(found.ExtractTranslation(), wanted, atol=1e-6)
        held = UsdPhysics.FixedJoint(stage.GetPrimAtPath(f"{root}/fixed_base"))
        assert held.GetLocalPos0Attr().Get() == Gf.Vec3f(*thing.T_world_object[:3, 3].tolist())
        joints += len(
            [p for p in stage.Traverse() if str(p.GetPath()).startswith(f"{root}/") and p.IsA(UsdPhysics.Joint)]
        )
    assert joints >= sum(len(thing.obj) for thing in scene.instances)


def test_sapien_has_the_parts_where_the_scene_has_them(kitchen: tuple[Scene, Path]) -> None:
    sapien = installed("sapien")
    scene, folder = kitchen
    world = sapien.Scene([sapien.physx.PhysxCpuSystem()])
    for own, thing in zip(json.loads((folder / "scene.json").read_text())["objects"], scene.instances, strict=True):
        loader = world.create_urdf_loader()
        loader.fix_root_link = True
        (builder,), _, _ = loader.parse(str(folder / own["urdf"]))
        for link in builder.link_builders:
            link.visual_records.clear()
        builder.set_initial_pose(sapien.Pose(np.array(own["T_world_object"])))
        built = builder.build()
        built.set_qpos([own["joints"][joint.name] for joint in built.get_active_joints()])
        links = {link.name: link.entity_pose for link in built.links}
        for k, part in enumerate(thing.obj.parts):
            place = thing.obj.tree.origins[k] if k else np.zeros(3)
            T = thing.T_world_part[k]
            np.testing.assert_allclose(links[part.name].p, T[:3, :3] @ place + T[:3, 3], atol=1e-4)


def test_a_joint_that_would_meet_another_object_is_named_and_what_is_written_is_kept(tmp_path: Path) -> None:
    installed("mujoco")
    installed("pxr")
    obj = artsim.make("refrigerator", 0)
    before = np.eye(4)
    before[0, 3] = -(obj.bounds[1] - obj.bounds[0])[0] - 0.05  # five centimetres in front of it
    things = tuple(Thing(obj, obj.tree.rest, T, ()) for T in (np.eye(4), before))
    scene = make_scene(SceneOptions(categories=("box",), distractors=0), 0)
    scene = Scene(things, (), scene.supports, scene.lights)
    written = write_simulation(scene.instances, tmp_path / "scene", recipe={"seed": 1})
    assert any(name.startswith("refrigerator_0/") for name in written.blocked)
    assert not any(name.startswith("refrigerator_1/door") for name in written.blocked)
    stamp = (tmp_path / "scene" / "scene.xml").stat().st_mtime_ns
    assert write_simulation(scene.instances, tmp_path / "scene", recipe={"seed": 1}) == written
    assert (tmp_path / "scene" / "scene.xml").stat().st_mtime_ns == stamp
    write_simulation(scene.instances, tmp_path / "scene", "free", {"seed": 2})
    assert json.loads((tmp_path / "scene" / "scene.json").read_text())["recipe"] == {"seed": 2}
    assert (tmp_path / "scene" / "scene.xml").read_text().count("<freejoint") == 2
