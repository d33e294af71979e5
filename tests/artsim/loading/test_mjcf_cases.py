"""MJCF as people bring it: tests/cases/second as its expected.txt says, and others of the same kinds."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from artsim.errors import AssetError, ConfigError, SceneError
from artsim.loading.sources import find_sources
from artsim.loading.urdf import load
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import transform_points
from tests.artsim.loading.test_mjcf import BOX, TETRAHEDRON, asset, repairs_of, written
from tests.conftest import BOX_LAPTOP, CASES, installed

SECOND = CASES / "second"
LID = f'<body name="lid"><joint name="h" range="0 90"/>{BOX}</body>'
SEEN = 'group="1" contype="0" conaffinity="0"'


def object_with_lid(folder: Path, body: str = "", before: str = "", after: str = "") -> ArticulatedObject:
    """A box with a lid, and more."""
    return load(written(folder, f'<body name="base">{BOX}{LID}{body}</body>', before, after))


# --- what is seen --------------------------------------------------------------------------------------------------


def test_a_ray_meets_what_mujoco_draws() -> None:
    """From the front, with the door open: the back wall, not the region that nothing is to be seen of."""
    obj = load(SECOND / "MJ1_invisible_region" / "microwave.xml")
    np.testing.assert_allclose(obj.box_size[0], [0.5, 0.4, 0.3])
    import trimesh

    q = np.array([0.0, -np.radians(1.6)])
    T = obj.T_base_rest @ obj.tree.forward_kinematics(q)
    shell = trimesh.Trimesh(transform_points(T[0], obj.parts[0].vertices), obj.parts[0].faces, process=False)
    hits, *_ = shell.ray.intersects_location([[0.1, -2.0, 0.02]], [[0.0, 1.0, 0.0]])
    assert hits[:, 1].min() == pytest.approx(0.18)
    assert "2 left out: their alpha is 0 (inside, outside)" in repairs_of(obj)


@pytest.mark.parametrize(
    ("body", "before"),
    [
        (f'<geom size="1" {SEEN} rgba="1 1 1 0"/>', ""),
        (f'<geom size="1" {SEEN} material="m"/>', asset('<material name="m" rgba="1 0 0 0"/>')),
        (
            f'<geom size="1" {SEEN} material="m"/>',
            '<default><material rgba="1 0 0 0"/></default>' + asset('<material name="m"/>'),
        ),
        (
            f'<geom size="1" class="c" {SEEN}/>',
            '<default><default class="c"><geom rgba="0 0 0 0"/></default></default>',
        ),
        (f'<geom size="1" {SEEN.replace("1", "4", 1)}/>', ""),
    ],
)
def test_what_is_not_drawn_is_no_surface(body: str, before: str, tmp_path: Path) -> None:
    obj = object_with_lid(tmp_path, body, before)
    np.testing.assert_allclose(obj.box_size[0], [0.2, 0.4, 0.6])


def test_a_colour_of_its_own_comes_before_that_of_the_material(tmp_path: Path) -> None:
    before = asset('<material name="m" rgba="1 0 0 0"/>')
    obj = object_with_lid(tmp_path, f'<geom size="1" {SEEN} material="m" rgba="1 0 0 1"/>', before)
    assert obj.box_size[0] == pytest.approx([2, 2, 2])


def test_where_nothing_is_drawn_what_collides_is_shown_and_said(tmp_path: Path) -> None:
    clear = BOX.replace("/>", ' rgba="0 0 0 0"/>')
    region = f'<geom size="3" {SEEN} rgba="1 0 0 0"/>'
    obj = load(written(tmp_path, f'<body name="a">{clear}{region}</body>'))
    np.testing.assert_allclose(obj.box_size[0], [0.2, 0.4, 0.6])
    assert "all its geoms have alpha 0: those that collide are shown" in repairs_of(obj)
    with pytest.raises(AssetError, match="none of its geoms can be seen or touched"):
        load(written(tmp_path, f'<body name="a">{region}</body>'))


def test_an_error_names_what_the_file_has(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"no geom that is a surface: .*type plane") as caught:
        load(written(tmp_path, '<geom type="plane" size="1 1 1"/>'))
    assert "link" not in str(caught.value).replace(str(tmp_path), "")


# --- files ---------------------------------------------------------------------------------------------------------


def test_an_included_file_outside_opens_with_the_option_that_the_error_names() -> None:
    file = SECOND / "MJ3_include_outside" / "objects" / "lid.xml"
    with pytest.raises(AssetError, match=r"included file '\.\./common/defaults\.xml' lies outside") as caught:
        load(file)
    assert caught.value.fix is not None
    name, _, folder = caught.value.fix.rpartition("--package-root ")[2].partition("=")
    obj = load(file, package_roots={name: folder})
    assert obj.source_joints.keys() == {"h"}
    assert obj.parts[0].body is not None
    inertia = obj.parts[0].body.inertia
    assert inertia is not None
    assert inertia.mass == pytest.approx(500 * 0.4 * 0.4 * 0.1)  # the density that the included file says


def test_one_option_opens_included_files_and_meshes(tmp_path: Path) -> None:
    (tmp_path / "common" / "parts").mkdir(parents=True)
    (tmp_path / "objects").mkdir()
    (tmp_path / "secret.obj").write_text(TETRAHEDRON)
    (tmp_path / "common" / "tetra.obj").write_text(TETRAHEDRON)
    (tmp_path / "common" / "all.xml").write_text('<mujoco><include file="parts/asset.xml"/></mujoco>')
    text = '<mujoco><asset><mesh name="tetra" file="../common/tetra.obj"/></asset></mujoco>'
    (tmp_path / "common" / "parts" / "asset.xml").write_text(text)
    body = '<body name="a"><geom type="mesh" mesh="tetra"/></body>'
    path = written(tmp_path / "objects", body, '<include file="../common/all.xml"/>')
    roots = {"any": tmp_path / "common"}
    np.testing.assert_allclose(load(path, package_roots=roots).box_size[0], [1, 1, 1])
    path.write_text(path.read_text().replace("../common/all.xml", "../common/other.xml"))
    with pytest.raises(AssetError, match=r"included file '../common/other.xml' is missing. Fix: .*--package-root"):
        load(path, package_roots=roots)
    (tmp_path / "common" / "parts" / "asset.xml").write_text(text.replace("common/tetra", "secret"))
    path.write_text(path.read_text().replace("other.xml", "all.xml"))
    with pytest.raises(AssetError, match="outside"):
        load(path, package_roots=roots)
    assert load(path, package_roots={"any": tmp_path}).parts[0].vertices.shape == (4, 3)


def test_assets_without_a_name_have_that_of_their_file(tmp_path: Path) -> None:
    obj = load(SECOND / "MJ6_nameless_hfield" / "m.xml")
    assert obj.source_joints.keys() == {"h"}
    (tmp_path / "tetra.obj").write_text(TETRAHEDRON)
    used = '<geom type="mesh" mesh="tetra"/><geom type="hfield" hfield="ground"/>'
    files = '<mesh file="tetra.obj"/><hfield file="a/ground.png" size="1 1 1 1"/><texture type="2d" file="x.png"/>'
    found = load(written(tmp_path, f'<body name="a">{used}</body>', asset(files)))
    assert "of type hfield left out" in repairs_of(found)
    np.testing.assert_allclose(found.box_size[0], [1, 1, 1])


@pytest.mark.parametrize(("normals", "textures"), [(0, 0), (4, 4)])
def test_meshes_of_mujocos_old_format_are_read(normals: int, textures: int, tmp_path: Path) -> None:
    mujoco = installed("mujoco")
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 2, 0], [0, 0, 3]], "<f4")
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], "<i4")
    header = struct.pack("<4i", 4, normals, textures, 4)
    data = header + points.tobytes() + bytes(12 * normals + 8 * textures) + faces.tobytes()
    (tmp_path / "m.msh").write_bytes(data)
    body = '<body name="a"><geom type="mesh" mesh="m" contype="0" conaffinity="0"/></body>'
    path = written(tmp_path, body, asset('<mesh file="m.msh" scale="1 1 -1"/>'))
    obj = load(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    np.testing.assert_allclose(obj.parts[0].body.inertia.mass, model.body_mass[1], rtol=1e-6)  # type: ignore[union-attr]
    np.testing.assert_allclose(obj.box_size[0], [1, 2, 3])
    (tmp_path / "m.msh").write_bytes(data[:-1])
    with pytest.raises(AssetError, match="bytes where its counts make"):
        load(path)


def test_a_primitive_fits_its_mesh_as_the_compiler_is_told(tmp_path: Path) -> None:
    (tmp_path / "tetra.obj").write_text(TETRAHEDRON)
    body = '<body name="a"><geom type="box" mesh="tetra"/></body>'
    sizes = []
    for fit in ("true", "false"):
        before = f'<compiler fitaabb="{fit}"/>' + asset('<mesh file="tetra.obj" scale="1 2 3"/>')
        path = written(tmp_path, body, before)
        size = 2.0 * installed("mujoco").MjModel.from_xml_path(str(path)).geom_size[0]
        sizes.append(size)
        volume = load(path).part_mesh(0).volume
        assert volume == pytest.approx(np.prod(size))
    assert np.prod(sizes[0]) != pytest.approx(np.prod(sizes[1]))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('<geom type="box"size="0.1 0.2 0.3"/>', "attributes that touch each other"),
        ('<geom name="a & b" type="box" size="0.1 0.2 0.3"/>', "& read as a character"),
        ("<!-- one -- two --><geom type='box'  size='0.1 0.2 0.3'/>", ""),
    ],
)
def test_text_that_mujocos_parser_takes_is_read(text: str, said: str, tmp_path: Path) -> None:
    path = written(tmp_path, f'<body name="a">{text}</body>')
    installed("mujoco").MjModel.from_xml_path(str(path))
    obj = load(path)
    np.testing.assert_allclose(obj.box_size[0], [0.2, 0.4, 0.6])
    assert said in repairs_of(obj)


# --- couplings -----------------------------------------------------------------------------------------------------


def settled(path: Path, held: dict[str, float]) -> Any:
    """MuJoCo's joints once its equalities hold, while others are kept where they are."""
    mujoco = installed("mujoco")
    spec = mujoco.MjSpec.from_file(str(path))
    spec.option.gravity = [0, 0, 0]
    for name, value in held.items():
        spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=name, data=[value] + [0.0] * 11)
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    model = spec.compile()
    model.dof_damping[:] = 5.0
    data = mujoco.MjData(model)
    for _ in range(4000):
        mujoco.mj_step(model, data)
    return {model.joint(j).name: float(data.qpos[model.jnt_qposadr[j]]) for j in range(model.njnt)}


def test_joints_follow_along_a_tendon_as_mujoco_holds_them() -> None:
    path = SECOND / "MJ5_tendon_equality" / "m.xml"
    obj = load(path)
    state = obj.source_state([0.0, 0.7, 0.0])
    assert state == {"h": pytest.approx(0.7), "g": pytest.approx(0.7)}
    assert settled(path, {"h": 0.7})["g"] == pytest.approx(0.7, abs=5e-3)


TWO = (
    f'<body name="a">{BOX}<body name="b"><joint name="p"/>{BOX}</body><body name="c"><joint name="q"/>{BOX}</body>'
    f'<body name="d"><joint name="r"/>{BOX}</body></body>'
)


def tendon(name: str, **coefficients: float) -> str:
    return f'<fixed name="{name}">' + "".join(
        f'<joint joint="{joint}" coef="{value}"/>' for joint, value in coefficients.items()
    ) + "</fixed>"  # fmt: skip


@pytest.mark.parametrize(
    ("tendons", "equality", "expected"),
    [
        (tendon("t", p=1, q=2), '<tendon tendon1="t" polycoef="0.1 1 0 0 0"/>', {"q": (0.1 - 0.5) / 2}),
        (tendon("t", q=1) + tendon("s", p=3), '<tendon tendon1="t" tendon2="s" polycoef="0 0.5 0 0 0"/>', {"q": 0.75}),
        (tendon("t", q=2), '<tendon tendon1="t" polycoef="0.4 0 0 0 0"/>', {"q": 0.2}),
    ],
)
def test_linear_couplings_are_followed(tendons: str, equality: str, expected: dict[str, float], tmp_path: Path) -> None:
    path = written(tmp_path, TWO, after=f"<tendon>{tendons}</tendon><equality>{equality}</equality>")
    obj = load(path)
    lower, upper = obj.tree.limits.T
    q = np.clip([0.0, 0.5, 0.0, 0.0], lower, upper)
    state, found = obj.source_state(q), settled(path, {"p": 0.5})
    for name, value in expected.items():
        assert state[name] == pytest.approx(value)
        assert found[name] == pytest.approx(value, abs=5e-3)


@pytest.mark.parametrize(
    ("tendons", "equality"),
    [
        (tendon("t", p=1, q=1, r=1), '<tendon tendon1="t"/>'),
        (tendon("t", p=1) + tendon("s", q=1), '<tendon tendon1="t" tendon2="s" polycoef="0 1 1 0 0"/>'),
        ('<spatial name="t"><site site="u"/><site site="v"/></spatial>', '<tendon tendon1="t"/>'),
    ],
)
def test_other_couplings_are_left_out_in_a_word(tendons: str, equality: str, tmp_path: Path) -> None:
    body = TWO.replace('<joint name="p"/>', '<joint name="p"/><site name="u"/>').replace(
        '<joint name="q"/>', '<joint name="q"/><site name="v" pos="1 0 0"/>'
    )
    obj = load(written(tmp_path, body, after=f"<tendon>{tendons}</tendon><equality>{equality}</equality>"))
    assert "the coupling is left out" in repairs_of(obj)
    assert all(joint.mimic is None for joint in obj.tree.joints)


@pytest.mark.parametrize(
    "equality",
    [
        '<connect body1="b" body2="c" anchor="0 0 0"/>', '<connect site1="u" site2="v"/>',
        '<weld site1="u" site2="v"/>', '<weld body1="b" body2="c"/>',
    ],
)  # fmt: skip
def test_a_closed_chain_is_opened_in_a_word(equality: str, tmp_path: Path) -> None:
    body = TWO.replace('<joint name="p"/>', '<joint name="p"/><site name="u"/>').replace(
        '<joint name="q"/>', '<joint name="q"/><site name="v"/>'
    )
    obj = load(written(tmp_path, body, after=f"<equality>{equality}</equality>"))
    assert f"{equality[: equality.index(' ')]}> of 'b' and 'c': left out: a closed chain is no tree" in repairs_of(obj)
    inactive = equality.replace("/>", ' active="false"/>')
    assert "left out" not in repairs_of(load(written(tmp_path, body, after=f"<equality>{inactive}</equality>")))


def test_a_ball_joint_is_three_hinges(tmp_path: Path) -> None:
    from scipy.spatial.transform import Rotation

    ball = f'<body name="arm" pos="1 0 0" quat="0.9 0.1 0.2 0.3"><joint name="j" type="ball" pos="0 0 1"/>{BOX}</body>'
    path = written(tmp_path, f'<body name="a">{BOX}{ball}</body>')
    obj = load(path)
    assert obj.source_joints.keys() == {"j_x", "j_y", "j_z"}
    assert "a ball joint: read as three hinges" in repairs_of(obj)
    model = installed("mujoco").MjModel.from_xml_path(str(path))
    data = installed("mujoco").MjData(model)
    data.qpos[:] = np.roll(Rotation.from_euler("XYZ", [0.3, -0.8, 1.2]).as_quat(), 1)
    installed("mujoco").mj_kinematics(model, data)
    T = obj.T_base_rest @ obj.tree.forward_kinematics([0.0, 0.3, -0.8, 1.2])
    inertia = obj.parts[3].body.inertia  # type: ignore[union-attr]
    np.testing.assert_allclose(transform_points(T[3], inertia.center[None])[0], data.xipos[2], atol=1e-9)  # type: ignore[union-attr]


# --- scenes --------------------------------------------------------------------------------------------------------


def free(name: str, inner: str = "") -> str:
    return f'<body name="{name}" pos="1 0 0"><freejoint/>{BOX}{inner}</body>'


def test_a_scene_of_several_objects_is_listed_and_chosen_by_name(tmp_path: Path) -> None:
    path = written(tmp_path, free("cabinet", LID) + free("robot", LID.replace('"lid"', '"arm"').replace('"h"', '"a"')))
    with pytest.raises(
        SceneError, match=r"2 articulated objects: cabinet, robot. Fix: choose one: --body cabinet"
    ) as e:
        load(path)
    assert e.value.names == ("cabinet", "robot")
    found = {name: load(path, body=name) for name in e.value.names}
    assert [part.name for part in found["robot"].parts] == ["robot", "arm"]
    assert found["robot"].object_id != found["cabinet"].object_id
    assert found["robot"].sha256 != found["cabinet"].sha256
    assert [part.name for part in load(path, body="arm").parts] == ["arm"]
    (source,) = find_sources([path], body="cabinet")
    assert source.load().tree == found["cabinet"].tree
    with pytest.raises(SceneError, match="has no body 'door'; its objects are cabinet, robot"):
        load(path, body="door")


def test_what_is_articulated_is_taken_and_the_rest_is_named(tmp_path: Path) -> None:
    path = written(tmp_path, f'<body name="table">{BOX}</body>' + free("mug") + free("cabinet", LID))
    obj = load(path)
    assert [part.name for part in obj.parts] == ["cabinet", "lid"]
    assert "other objects are left out: world, mug; --body NAME takes another" in repairs_of(obj)
    assert [part.name for part in load(path, body="world").parts] == ["table"]
    assert [part.name for part in load(path, body="mug").parts] == ["mug"]


def test_of_rigid_things_the_only_free_one_is_taken(tmp_path: Path) -> None:
    table = f'<body name="table">{BOX}</body>'
    assert [part.name for part in load(written(tmp_path, table + free("mug"))).parts] == ["mug"]
    with pytest.raises(SceneError, match="2 objects: mug, jar"):
        load(written(tmp_path, table + free("mug") + free("jar")))


def test_articulated_things_that_the_world_holds_are_named(tmp_path: Path) -> None:
    left = f'<body name="left">{BOX}<body name="l"><joint name="x"/>{BOX}</body></body>'
    path = written(tmp_path, left + left.replace("left", "right").replace('"l"', '"r"').replace('"x"', '"y"'))
    assert "2 articulated bodies are taken as one object: left, right" in repairs_of(load(path))
    assert [part.name for part in load(path, body="right").parts] == ["right", "r"]


def test_a_follower_whose_source_belongs_to_another_object_moves_by_itself(tmp_path: Path) -> None:
    equality = '<equality><joint joint1="x" joint2="y"/></equality>'
    body = free("a", LID.replace('"h"', '"x"')) + free("b", LID.replace('"lid"', '"m"').replace('"h"', '"y"'))
    assert load(written(tmp_path, body, after=equality), body="a").tree.joints[1].mimic is None


def test_a_file_of_one_object_has_none_to_choose(tmp_path: Path) -> None:
    (tmp_path / "laptop.urdf").write_text(BOX_LAPTOP)
    with pytest.raises(ConfigError, match="holds one object"):
        load(tmp_path / "laptop.urdf", body="lid")


# --- what is left out ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("body", "before", "said"),
    [
        ("", asset('<skin name="s" file="s.skn"/>'), "<skin>: left out"),
        ("", '<deformable><skin name="s" file="s.skn"/></deformable>', "<skin>: left out"),
        ('<flexcomp name="f" type="grid" count="3 3 1" spacing="1 1 1" dim="2"/>', "", "<flexcomp>: left out"),
        ('<composite type="cable" count="9 1 1"/>', "", "<composite>: left out"),
    ],
)
def test_soft_things_are_left_out_in_a_word(body: str, before: str, said: str, tmp_path: Path) -> None:
    obj = object_with_lid(tmp_path, body, before)
    assert len(obj) == 2
    assert said in repairs_of(obj)


def test_mujoco_is_blamed_for_what_it_refuses_alone(tmp_path: Path) -> None:
    soft = '<flexcomp name="f" type="grid" count="3 3 1" spacing="1 1 1" dim="2"/>'
    with pytest.raises(AssetError, match="<flexcomp> is not read, and the rest is no model"):
        load(written(tmp_path, f'<body name="a"><joint/>{soft}</body>'))
    with pytest.raises(AssetError, match="MuJoCo refuses it"):
        load(written(tmp_path, '<body name="a"><joint/></body>'))


def test_a_mesh_that_a_plugin_makes_is_left_out_in_a_word(tmp_path: Path) -> None:
    before = '<extension><plugin plugin="mujoco.sdf.torus"><instance name="t"/></plugin></extension>' + asset(
        '<mesh name="torus"><plugin instance="t"/></mesh>'
    )
    obj = object_with_lid(tmp_path, '<geom type="sdf" mesh="torus"><plugin instance="t"/></geom>', before)
    assert "of meshes that a plugin makes left out" in repairs_of(obj)


def test_what_a_program_moves_ties_nothing(tmp_path: Path) -> None:
    body = f'<body name="hand" mocap="true"><geom size="0.1" {SEEN}/></body>{free("a", LID)}'
    obj = load(written(tmp_path, body, after='<equality><weld body1="hand" body2="a"/></equality>'))
    assert "<weld> of 'hand' and 'a': left out: a program moves one of them (mocap)" in repairs_of(obj)
    assert [part.name for part in obj.parts] == ["a", "lid"]
