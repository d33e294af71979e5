"""MJCF files are the objects that MuJoCo makes of them, and read nothing outside their folder."""

from __future__ import annotations

import builtins
import itertools
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artsim.errors import AssetError, ConfigError
from artsim.export import export
from artsim.export.options import ExportOptions
from artsim.families import make
from artsim.loading.sources import find_sources
from artsim.loading.urdf import load
from artsim.model.convex_bodies import add_surface_bodies
from artsim.model.draws import ViewOptions, sample_view
from artsim.model.object_file import load_object, save_object
from artsim.model.objects import ArticulatedObject, JointDynamics
from artsim.model.part_inertia import part_inertia
from artsim.model.robot import as_robot
from artsim.model.transforms import transform_points
from artsim.renderers import render
from tests.artsim.loading.round_trip import FAMILIES, assert_same_geometry, assert_same_object
from tests.conftest import installed, valve

BOX = '<geom type="box" size="0.1 0.2 0.3"/>'
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


def written(folder: Path, body: str, before: str = "", after: str = "") -> Path:
    """An MJCF file with these elements in its world, and others around it."""
    path = folder / "object.xml"
    path.write_text(f"<mujoco>{before}<worldbody>{body}</worldbody>{after}</mujoco>")
    return path


def repairs_of(obj: ArticulatedObject) -> str:
    return "\n".join(map(str, obj.repairs))


# --- what artsim wrote ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("category", FAMILIES)
def test_an_exported_object_comes_back_as_it_was(category: str, tmp_path: Path) -> None:
    obj = valve() if category == "valve" else make(category, 3)
    export(obj, tmp_path / "o", ["mjcf"])
    assert_same_object(load(tmp_path / "o"), obj)


@pytest.mark.parametrize("options", [ExportOptions("free", "motor"), ExportOptions("fixed", "position")])
def test_base_and_actuators_are_no_part_of_the_object(options: ExportOptions, tmp_path: Path) -> None:
    export(valve(), tmp_path / "o", ["mjcf"], options=options)
    assert_same_object(load(tmp_path / "o" / "mobility.xml"), valve())


def test_a_real_object_comes_back_as_it_was(partnet_dir: Path, tmp_path: Path) -> None:
    folder = min(partnet_dir.glob("StorageFurniture/*/mobility.urdf")).parent
    obj = add_surface_bodies(load(folder))
    export(obj, tmp_path / "o", ["mjcf"])
    assert_same_geometry(load(tmp_path / "o"), obj)


def test_a_folder_of_mjcf_files_is_a_source_of_objects(tmp_path: Path) -> None:
    for seed in (0, 1):
        export(make("drawer", seed), tmp_path / "drawer" / str(seed), ["mjcf"])
    sources = find_sources([tmp_path])
    assert [source.path for source in sources] == [tmp_path / "drawer" / n / "mobility.xml" for n in "01"]
    obj = sources[0].load()
    save_object(obj, tmp_path / "o.npz")
    assert load_object(tmp_path / "o.npz").tree == obj.tree


# --- what others write ---------------------------------------------------------------------------------------------


def test_shapes_are_where_mujoco_has_them_in_every_state(tmp_path: Path) -> None:
    """Angles in degrees, Euler angles, a frame, defaults, reference values, and a mesh that its asset moves."""
    mujoco = installed("mujoco")
    (tmp_path / "shapes").mkdir()
    (tmp_path / "shapes" / "tetra.obj").write_text(TETRAHEDRON)
    path = written(
        tmp_path,
        """<body name="base" euler="0 0 90"><geom type="mesh" mesh="tetra" pos="1 2 3" euler="10 20 30"/>
             <frame pos="0.1 0 0" axisangle="0 1 0 30"><body name="arm" pos="0 0 0.5" quat="0.9 0.1 0.2 0.3">
               <joint name="swing" class="hinges" pos="0.1 0.2 0" axis="0 1 1" range="-30 60" ref="15"/>
               <joint name="push" type="slide" axis="1 0 0" range="0 0.2"/>
               <geom type="capsule" fromto="0 0 0 0.2 0.1 0.3" size="0.05"/><geom type="ellipsoid" size="0.1 0.2 0.3"/>
               <geom type="cylinder" size="0.1 0.2" pos="0 0.3 0"/><geom type="sphere" size="0.1"/>
             </body></frame></body>""",
        '<compiler meshdir="shapes"/><default><default class="hinges"><joint axis="1 0 0"/></default></default>'
        '<asset><mesh name="tetra" file="tetra.obj" scale="1 2 -3" refpos="0.1 0.2 0.3" refquat="0.9 0.1 0.2 0.3"/>'
        "</asset>",
    )
    obj = load(path)
    assert obj.tree.types == ("free", "revolute", "prismatic")
    assert [part.name for part in obj.parts] == ["base", "arm_swing", "arm"]
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    for swing, push in ((0.0, 0.0), (0.4, 0.1), (-0.5, 0.2)):
        data.joint("swing").qpos[0], data.joint("push").qpos[0] = swing, push
        mujoco.mj_kinematics(model, data)
        T_base_part = obj.T_base_rest @ obj.tree.forward_kinematics([0.0, swing, push])
        tetra = data.geom_xpos[0] + model.mesh_vert @ data.geom_xmat[0].reshape(3, 3).T
        own = transform_points(T_base_part[0], obj.parts[0].vertices)
        np.testing.assert_allclose(own, tetra, atol=1e-6)
        # The other shapes are symmetric: the middle of each's vertices is where it stands.
        moved = transform_points(T_base_part[2], obj.parts[2].vertices)
        counts = np.cumsum([0, *(len(vertices) for vertices, _ in obj.parts[2].body.pieces)])
        for g, (first, last) in enumerate(itertools.pairwise(counts), start=1):
            np.testing.assert_allclose(moved[first:last].mean(axis=0), data.geom_xpos[g], atol=1e-6)


def test_masses_are_those_that_mujoco_computes(tmp_path: Path) -> None:
    path = written(
        tmp_path,
        f'<body name="a">{BOX}<body name="b" pos="0 0 1"><joint/><geom size="0.1" density="500"/></body></body>',
    )
    obj = load(path)
    box, ball = part_inertia(obj, 0), part_inertia(obj, 1)
    assert box.mass == pytest.approx(1000 * 0.2 * 0.4 * 0.6)
    np.testing.assert_allclose(box.tensor.diagonal(), box.mass / 3 * np.array([0.13, 0.1, 0.05]))
    assert ball.mass == pytest.approx(500 * 4 / 3 * np.pi * 0.1**3)
    whole = load(written(tmp_path, f'<body name="a">{BOX}</body>', '<compiler settotalmass="3"/>'))
    assert part_inertia(whole, 0).mass == pytest.approx(3)
    np.testing.assert_allclose(part_inertia(whole, 0).tensor, box.tensor * 3 / box.mass, atol=1e-12)
    assert part_inertia(obj.scaled(2.0), 0).mass == pytest.approx(8 * box.mass)


def test_a_joint_keeps_its_strength_damping_and_friction(tmp_path: Path) -> None:
    door = f'<joint name="j" damping="3" frictionloss="2" actuatorfrcrange="-5 5"/>{BOX}'
    obj = load(written(tmp_path, f'<body name="a">{BOX}<body name="b" pos="1 0 0">{door}</body></body>'))
    assert obj.parts[1].body is not None
    assert obj.parts[1].body.joint == JointDynamics(effort=5, damping=3, friction=2)
    (joint,) = as_robot(obj).joints
    assert (joint.effort, joint.damping, joint.friction) == (5, 3, 2)
    assert joint.velocity > 0
    (scaled,) = as_robot(obj.scaled(0.5)).joints
    assert scaled.effort != 5  # of a smaller object, it follows from what the joint carries


@pytest.mark.parametrize("name", ["humanoid", "walker2d", "half_cheetah", "reacher", "pusher"])
def test_robots_of_others_move_as_in_mujoco(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The centre of mass of every part, in random states of files that come with Gymnasium."""
    monkeypatch.chdir(tmp_path)  # MuJoCo itself writes its warnings there
    mujoco, gymnasium = installed("mujoco"), installed("gymnasium")
    path = Path(gymnasium.__file__).parent / "envs" / "mujoco" / "assets" / f"{name}.xml"
    obj, model = load(path), mujoco.MjModel.from_xml_path(str(path))
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    limits = np.clip(obj.tree.limits, -3.0, 3.0)
    for q in rng.uniform(limits[:, 0], limits[:, 1], (5, len(obj))):
        for joint, value in obj.source_state(q).items():
            data.joint(joint).qpos[0] = value
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        T_base_part = obj.T_base_rest @ obj.tree.forward_kinematics(q)
        for k, part in enumerate(obj.parts):
            if part.name == "world" or part.body is None or part.body.inertia is None:
                continue
            rigid = [model.body(part.name).id]  # and the bodies that are held by it
            for b in range(rigid[0] + 1, model.nbody):
                if model.body_parentid[b] in rigid and model.body_jntnum[b] == 0:
                    rigid.append(b)
            center = np.average(data.xipos[rigid], axis=0, weights=model.body_mass[rigid])
            own = transform_points(T_base_part[k], part.body.inertia.center[None])[0]
            np.testing.assert_allclose(own, center, atol=1e-9)


@pytest.mark.parametrize(
    ("body", "after", "types", "limits"),
    [
        ('<joint name="j" axis="0 0 2"/>', "", ("free", "continuous"), (-np.inf, np.inf)),
        ('<joint name="j" range="-90 45"/>', "", ("free", "revolute"), (-np.pi / 2, np.pi / 4)),
        ('<joint name="j" range="-90 45" limited="false"/>', "", ("free", "continuous"), (-np.inf, np.inf)),
        ('<joint name="j" type="slide" range="-1 2"/>', "", ("free", "prismatic"), (-1, 2)),
        ('<joint name="j" type="slide"/>', "", ("free", "prismatic"), (-1, 1)),
        (
            '<joint name="j" type="slide" range="-1 2"/>',
            '<equality><joint joint1="j" polycoef="0.5 0 0 0 0"/></equality>',
            ("free", "prismatic"),
            (0.5, 0.5),
        ),
    ],
)
def test_joints_have_the_types_and_limits_of_mujoco(
    body: str, after: str, types: tuple[str, ...], limits: tuple[float, float], tmp_path: Path
) -> None:
    world = f'<body name="a">{BOX}<body name="b" pos="1 0 0">{body}{BOX}</body></body>'
    obj = load(written(tmp_path, world, after=after))
    assert obj.tree.types == types
    np.testing.assert_allclose(obj.tree.limits[1], limits)


def test_a_body_that_hangs_on_the_world_has_the_world_as_root(tmp_path: Path) -> None:
    body = f'<geom type="plane" size="1 1 1"/><body name="door"><joint name="j" range="0 90"/>{BOX}</body>'
    obj = load(written(tmp_path, body))
    assert [part.name for part in obj.parts] == ["world", "door"]
    assert len(obj.parts[0].faces) == 0
    assert "of type plane left out" in repairs_of(obj)


def test_a_hinge_and_a_slide_that_nothing_relates_are_no_screw(tmp_path: Path) -> None:
    knob = f'<joint name="turn"/><joint name="push" type="slide" range="0 0.01"/>{BOX}'
    obj = load(written(tmp_path, f'<body name="a">{BOX}<body name="b" pos="1 0 0">{knob}</body></body>'))
    assert obj.tree.types == ("free", "continuous", "prismatic")


def test_what_is_seen_is_not_what_collides_where_groups_tell_them_apart(tmp_path: Path) -> None:
    seen = '<geom type="sphere" size="0.1" group="1" contype="0" conaffinity="0"/>'
    obj = load(written(tmp_path, f'<body name="a">{BOX}{seen}<body name="b"><joint/>{BOX}</body></body>'))
    assert obj.box_size[0] == pytest.approx([0.2, 0.2, 0.2])
    assert obj.box_size[1] == pytest.approx([0.2, 0.4, 0.6])  # nothing else of it is to be seen
    assert obj.parts[0].body is not None
    assert np.ptp(obj.parts[0].body.pieces[0][0], axis=0) == pytest.approx([0.2, 0.4, 0.6])


def test_included_files_of_the_folder_are_read(tmp_path: Path) -> None:
    (tmp_path / "part.xml").write_text(f'<mujocoinclude><body name="b"><joint/>{BOX}</body></mujocoinclude>')
    before = load(written(tmp_path, f'<body name="a">{BOX}<include file="part.xml"/></body>'))
    assert len(before) == 2
    (tmp_path / "part.xml").write_text(f'<mujocoinclude><body name="c"><joint/>{BOX}</body></mujocoinclude>')
    assert load(tmp_path / "object.xml").sha256 != before.sha256


def test_a_loaded_object_is_rendered(tmp_path: Path) -> None:
    export(make("drawer", 0), tmp_path / "o", ["mjcf"])
    loaded, obj = load(tmp_path / "o"), make("drawer", 0)
    camera = sample_view(obj, obj.tree.rest, ViewOptions(), np.random.default_rng(0))
    frames = [render(one, obj.tree.rest, camera) for one in (loaded, obj)]
    assert (frames[0].depth > 0).any()
    np.testing.assert_allclose(frames[0].depth, frames[1].depth, atol=1e-5)


# --- what is refused -----------------------------------------------------------------------------------------------

MESH = '<body name="a"><geom type="mesh" mesh="m"/></body>'


def asset(text: str) -> str:
    return f"<asset>{text}</asset>"


REFUSED: dict[str, tuple[str, str, str, str]] = {
    "mesh outside": (MESH, asset('<mesh name="m" file="../secret.obj"/>'), "", "outside the asset's folder"),
    "absolute mesh": (MESH, asset('<mesh name="m" file="/secret.obj"/>'), "", "outside the asset's folder"),
    "folder outside": (
        MESH, '<compiler meshdir=".."/>' + asset('<mesh name="m" file="secret.obj"/>'), "", "outside the asset's folder"
    ),
    "missing mesh": (MESH, asset('<mesh name="m" file="gone.obj"/>'), "", "gone.obj' is missing"),
    "include outside": ('<include file="../secret.xml"/>', "", "", "outside the asset's folder.*--package-root"),
    "circular include": ('<include file="object.xml"/>', "", "", "twice"),
    "another model": (BOX, asset('<model name="m" file="m.xml"/>'), "", "<model> is not read"),
    "many copies": (
        f'<replicate count="100000"><body>{BOX}</body></replicate>', "", "", "more than [0-9]+ <"
    ),
    "copies of copies": (
        "<replicate count='100'>" * 4 + BOX + "</replicate>" * 4, "", "", "more than [0-9]+ <"
    ),
    "mesh of many sides": (MESH, asset('<mesh name="m" builtin="cone" params="1e6 1"/>'), "", "over 100 sides"),
    "two objects": (
        f"<body><freejoint/>{BOX}</body><body><freejoint/>{BOX}</body>", "", "", "holds 2 objects: body1, body2"
    ),
    "no mass": ('<body name="a"><joint/></body>', "", "", "MuJoCo refuses it"),
    "nothing to see": ('<body><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>', "", "", "no geom that is"),
    "not a number": ('<body name="a" pos="nan 0 0"><geom size="1"/></body>', "", "", "pos of <body> is not a number"),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_or_may_not_be_read_is_refused(case: str, tmp_path: Path) -> None:
    body, before, after, message = REFUSED[case]
    (tmp_path / "secret.obj").write_text(TETRAHEDRON)
    (tmp_path / "secret.xml").write_text(f"<mujocoinclude><body>{BOX}</body></mujocoinclude>")
    folder = tmp_path / "object"
    folder.mkdir()
    with pytest.raises(AssetError, match=message) as caught:
        load(written(folder, body, before, after))
    assert caught.value.fix


def test_a_document_type_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, f'<body name="a">{BOX}</body>')
    path.write_text('<!DOCTYPE mujoco [<!ENTITY a "b">]>' + path.read_text())
    with pytest.raises(AssetError, match="document type"):
        load(path)


def test_mujoco_opens_no_file(tmp_path: Path) -> None:
    """Pictures, height fields and further files that a document names need not exist."""
    path = written(
        tmp_path,
        f'<body name="a">{BOX}<geom size="0.1" material="m"/></body>',
        asset(
            '<texture name="t" type="2d" file="/etc/passwd"/><material name="m" texture="t"/>'
            '<hfield name="h" file="/etc/passwd" size="1 1 1 1"/>'
        )
        + '<size memory="900G"/><extension><plugin plugin="no.such.plugin"/></extension>',
    )
    assert len(load(path)) == 1


def test_mujoco_writes_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By itself it writes what it warns of into the current folder."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(AssetError):
        load(written(tmp_path, '<body name="a" pos="nan 0 0"><geom size="1"/></body>'))
    assert [path.name for path in tmp_path.iterdir()] == ["object.xml"]


def test_without_mujoco_the_error_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found: Callable[..., Any] = builtins.__import__

    def lacking(name: str, *more: Any, **named: Any) -> Any:
        if name.partition(".")[0] == "mujoco":
            raise ModuleNotFoundError("No module named 'mujoco'", name="mujoco")
        return found(name, *more, **named)

    path = written(tmp_path, f'<body name="a">{BOX}</body>')
    monkeypatch.setattr(builtins, "__import__", lacking)
    with pytest.raises(ConfigError, match=r"sim"):
        load(path)


def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "o").mkdir()
    (tmp_path / "secret.obj").write_text(TETRAHEDRON)
    (tmp_path / "o" / "inner.obj").symlink_to(tmp_path / "secret.obj")
    path = written(tmp_path / "o", MESH, asset('<mesh name="m" file="inner.obj"/>'))
    with pytest.raises(AssetError, match="outside"):
        load(path)
    shutil.copy(tmp_path / "secret.obj", tmp_path / "o" / "own.obj")
    path.write_text(path.read_text().replace("inner", "own"))
    assert len(load(path)) == 1


def test_percent_signs_are_no_formats_of_c(tmp_path: Path) -> None:
    """MuJoCo's messages take names for formats: with ``%n`` it ends the process."""
    installed("mujoco")
    body = '<body name="50%n"><joint type="hinge" range="0 1"/><geom name="%s%n" type="box" size="1 1 1"{}/></body>'
    path = tmp_path / "a.xml"
    path.write_text(f"<mujoco><worldbody>{body.format('')}</worldbody></mujoco>")
    obj = load(path)
    assert "each % in a name is read as _" in " ".join(map(str, obj.repairs))
    path.write_text(f"<mujoco><worldbody>{body.format(' class=' + chr(34) + '%s%n' + chr(34))}</worldbody></mujoco>")
    with pytest.raises(AssetError, match="MuJoCo refuses it"):
        load(path)
