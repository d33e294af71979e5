"""What links and joints of a URDF say, in the ways in which people write it, against simulators and closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from artsim import load
from artsim.errors import AssetError
from artsim.loading.xml_values import rotation_of
from artsim.model.objects import ArticulatedObject
from tests.conftest import installed

BOX = '<box size="0.2 0.1 0.05"/>'


def write(folder: Path, joint: str = "", kind: str = "revolute", shape: str = BOX, more: str = "") -> Path:
    """Two links, of which the second has this shape, and a joint of this content."""
    path = folder / "object.urdf"
    path.write_text(
        f'<robot name="r"><link name="a"><visual><geometry><box size="1 1 0.1"/></geometry></visual></link>'
        f'<link name="b"><visual>{more}<geometry>{shape}</geometry></visual></link>'
        f'<joint name="j" type="{kind}"><parent link="a"/><child link="b"/>{joint}</joint></robot>'
    )
    return path


def said(obj: ArticulatedObject) -> str:
    return "\n".join(map(str, obj.repairs))


def limits(obj: ArticulatedObject) -> tuple[str, float, float]:
    joint = obj.tree.joints[1]
    return joint.type, joint.lower, joint.upper


# --- limits --------------------------------------------------------------------------------------------------------

INF = np.inf


@pytest.mark.parametrize(
    ("kind", "limit", "expected", "repair"),
    [
        ("revolute", '<limit lower="-1" upper="2"/>', ("revolute", -1, 2), ""),
        ("revolute", '<limit effort="x" velocity="" lower="0" upper="1"/>', ("revolute", 0, 1), ""),
        ("revolute", "", ("continuous", -INF, INF), "without a limit: read as continuous"),
        ("revolute", '<limit effort="1"/>', ("continuous", -INF, INF), "URDF's text would hold it at 0"),
        ("revolute", '<limit lower="-inf" upper="+INF"/>', ("continuous", -INF, INF), "has no end"),
        ("revolute", '<limit lower="-1e308" upper="1e308"/>', ("continuous", -INF, INF), "has no end"),
        ("revolute", '<limit lower="-1e400" upper="1e400"/>', ("continuous", -INF, INF), "has no end"),
        ("revolute", '<limit lower="-1e10" upper="1e10"/>', ("continuous", -INF, INF), "has no end"),
        ("revolute", '<limit lower="0.5" upper="inf"/>', ("revolute", 0.5, 0.5 + 2 * np.pi), "a whole turn"),
        ("revolute", '<limit lower="-1e38" upper="0"/>', ("revolute", -2 * np.pi, 0), "a whole turn"),
        ("revolute", '<limit upper="1"/>', ("revolute", 0, 1), "limit without lower: 0, as URDF has it"),
        ("revolute", '<limit lower="-1"/>', ("revolute", -1, 0), "limit without upper: 0, as URDF has it"),
        ("revolute", '<limit lower="0" upper="0"/>', ("revolute", 0, 0), "cannot move: both of its limits are 0"),
        ("revolute", '<limit lower="1" upper="-1"/>', ("revolute", -1, 1), "limits 1 and -1 swapped"),
        ("revolute", "<limit>0 1.5</limit>", ("revolute", 0, 1.5), "numbers as text: read as lower and upper"),
        ("revolute", "<limit><lower>0</lower><upper>1</upper></limit>", ("revolute", 0, 1), "lower as text"),
        ("revolute", "<axis><xyz>0 0 1</xyz><limit><lower>0</lower><upper>1</upper></limit></axis>",
         ("revolute", 0, 1), "<limit> inside <axis>"),
        ("revolute", '<limit lower="0" upper="2"/><limit lower="0" upper="1"/>', ("revolute", 0, 2), "first counts"),
        ("continuous", '<limit lower="0" upper="1"/>', ("continuous", -INF, INF), "its limits are ignored"),
        ("continuous", '<limit effort="1"/>', ("continuous", -INF, INF), ""),
        ("prismatic", "", ("prismatic", 0, 0), "without a limit: held at 0"),
        ("prismatic", '<limit effort="1"/>', ("prismatic", 0, 0), "without lower and upper in its limit: held at 0"),
        ("prismatic", '<limit lower="-1e38" upper="1e38"/>', ("prismatic", -1, 1), "bounded to -1 and 1 m"),
        ("prismatic", '<limit lower="0.5" upper="inf"/>', ("prismatic", 0.5, 1.5), "bounded to 0.5 and 1.5 m"),
        ("prismatic", '<limit lower="0" upper="9"/>', ("prismatic", 0, 9), ""),
            ("prismatic", '<limit lower="0" upper="90"/>', ("prismatic", 0, 90), 'write lower="0" upper="0.09"'),
    ],
)  # fmt: skip
def test_limits_are_taken_as_written_or_said(
    kind: str, limit: str, expected: tuple[str, float, float], repair: str, tmp_path: Path
) -> None:
    obj = load(write(tmp_path, limit, kind))
    assert limits(obj)[0] == expected[0]
    assert limits(obj)[1:] == pytest.approx(expected[1:])
    assert repair in said(obj) if repair else not obj.repairs


@pytest.mark.parametrize("value", ["nan", "wide", "1_0", "1,5", "90deg", "0x1", "", "\u0661"])
def test_a_limit_that_is_no_number_is_refused(value: str, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="joint 'j': upper="):
        load(write(tmp_path, f'<limit lower="0" upper="{value}"/>'))


@pytest.mark.parametrize(
    ("low", "high"), [(0, 90), (0, 115), (-180, 180), (0, 360), (-45, 45), (0, 20), (-12.5, 100.5)]
)
def test_limits_in_degrees_are_pointed_out_with_the_fix(low: float, high: float, tmp_path: Path) -> None:
    obj = load(write(tmp_path, f'<limit lower="{low}" upper="{high}"/>'))
    assert limits(obj)[1:] == pytest.approx((low, high))  # as they are
    assert f'write lower="{np.deg2rad(low):.6g}" upper="{np.deg2rad(high):.6g}"' in said(obj)


@pytest.mark.parametrize(("low", "high"), [(0, 2), (-3.15, 3.15), (-6.2832, 6.2832), (-7.85, 7.85), (0, 12)])
def test_wrists_of_robots_are_no_degrees(low: float, high: float, tmp_path: Path) -> None:
    assert not load(write(tmp_path, f'<limit lower="{low}" upper="{high}"/>')).repairs


# --- axes ----------------------------------------------------------------------------------------------------------


def test_a_slide_travels_metres_whatever_the_length_of_its_axis(tmp_path: Path) -> None:
    """MuJoCo and URDF's text agree; PyBullet and SAPIEN stretch travel by the axis's length."""
    mujoco = installed("mujoco")
    path = write(tmp_path, '<axis xyz="0 3 4"/><limit lower="0" upper="0.5"/>', "prismatic")
    obj = load(path)
    assert limits(obj) == ("prismatic", 0.0, 0.5)
    assert "axis of length 5 normalised, travel stays in metres" in said(obj)
    mass = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
    model = mujoco.MjModel.from_xml_string(path.read_text().replace('<link name="b">', f'<link name="b">{mass}'))
    data = mujoco.MjData(model)
    data.qpos[0] = obj.source_state([0.0, 0.25])["j"]
    before = data.xpos.copy()
    mujoco.mj_kinematics(model, data)
    moved = data.xpos[-1] - before[-1]
    assert obj.tree.forward_kinematics([0.0, 0.25])[1, :3, 3] == pytest.approx(moved)
    assert np.linalg.norm(moved) == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("axis", "expected", "repair"),
    [
        ("", (1, 0, 0), ""),
        ('<axis xyz="0 0 2"/>', (0, 0, 1), "axis of length 2 normalised"),
        ('<axis xyz="1e300 0 0"/>', (1, 0, 0), "axis of length 1e+300 normalised"),
        ("<axis>0 1 0</axis>", (0, 1, 0), "xyz as text"),
        ("<axis><xyz>0 1 0</xyz></axis>", (0, 1, 0), "xyz as text"),
        ('<axis xyz="0, 1, 0"/>', (0, 1, 0), "commas read as separators"),
        ("<axis/>", (1, 0, 0), "has no xyz: read as 1 0 0"),
        ('<axis xyz="0 1 0" rpy="1 2 3"/>', (0, 1, 0), "has rpy, which is not read"),
    ],
)
def test_axes_in_all_their_spellings(axis: str, expected: tuple[float, ...], repair: str, tmp_path: Path) -> None:
    obj = load(write(tmp_path, f'{axis}<limit lower="0" upper="1"/>'))
    assert obj.tree.joints[1].axis == pytest.approx(expected)
    assert repair in said(obj) if repair else not obj.repairs


# --- origins -------------------------------------------------------------------------------------------------------


@given(st.lists(st.floats(-7, 7), min_size=3, max_size=3))
def test_rpy_is_roll_then_pitch_then_yaw_about_fixed_axes(rpy: list[float]) -> None:
    theirs = trimesh.transformations.euler_matrix(*rpy, "sxyz")[:3, :3]
    assert rotation_of(np.array(rpy)) == pytest.approx(theirs, abs=1e-12)


@pytest.mark.parametrize(
    ("origin", "center", "size", "repair"),
    [
        ("", (0, 0, 0), (0.2, 0.1, 0.05), ""),
        ('<origin xyz="0 0 1"/>', (0, 0, 1), (0.2, 0.1, 0.05), ""),
        ('<origin rpy="0 0 1.5707963267948966"/>', (0, 0, 0), (0.1, 0.2, 0.05), ""),
        ("<origin>0 0 1</origin>", (0, 0, 1), (0.2, 0.1, 0.05), "numbers as text: read as xyz"),
        ("<origin>0 0 1 0 0 1.5707963267948966</origin>", (0, 0, 1), (0.1, 0.2, 0.05), "read as xyz and rpy"),
        ("<origin><xyz>0 0 1</xyz></origin>", (0, 0, 1), (0.2, 0.1, 0.05), "xyz as text"),
        ("<pose>0 0 1 0 0 0</pose>", (0, 0, 1), (0.2, 0.1, 0.05), "<pose> read as <origin>"),
        ('<origin xyz="0,0,1"/>', (0, 0, 1), (0.2, 0.1, 0.05), "commas read as separators"),
        ('<origin xyz="0 0 1" quat_xyzw="0 0 0.70710678 0.70710678"/>', (0, 0, 1), (0.1, 0.2, 0.05), ""),
        ('<origin rpy="0 0 0" quat_xyzw="0 0 2 2"/>', (0, 0, 0), (0.1, 0.2, 0.05), "normalised"),
        ('<origin xyz="0 0 1" degrees="true"/>', (0, 0, 1), (0.2, 0.1, 0.05), "has degrees, which is not read"),
    ],
)
def test_origins_in_all_their_spellings(
    origin: str, center: tuple[float, ...], size: tuple[float, ...], repair: str, tmp_path: Path
) -> None:
    obj = load(write(tmp_path, '<limit lower="0" upper="1"/>', more=origin))
    assert obj.box_center[1] - obj.box_center[0] == pytest.approx(center, abs=1e-6)
    assert obj.box_size[1] == pytest.approx(size, abs=1e-6)
    assert repair in said(obj) if repair else not obj.repairs


@pytest.mark.parametrize(
    ("origin", "what"),
    [
        ('<origin xyz="0 0"/>', "is not 3 numbers"),
        ('<origin xyz="0,5 0 0"/>', "is not 3 numbers"),
        ('<origin xyz="0 inf 0"/>', "is not finite"),
        ("<origin>0 0 1 0</origin>", "is not 3 or 6 numbers"),
        ('<origin rpy="0 0 1" quat_xyzw="0 0 0 1"/>', "has both rpy and quat_xyzw"),
        ('<origin quat_xyzw="0 0 0 0"/>', "is no rotation"),
        ('<pose relative_to="c">0 0 1 0 0 0</pose>', "is SDF"),
    ],
)
def test_an_origin_that_says_nothing_sure_is_refused(origin: str, what: str, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=what) as error:
        load(write(tmp_path, more=origin))
    assert "link 'b'" in str(error.value)


# --- shapes --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shape", "size", "repair"),
    [
        ('<capsule radius="0.05" length="0.3"/>', (0.1, 0.1, 0.4), ""),
        ('<capsule radius="0.05" length="0"/>', (0.1, 0.1, 0.1), ""),
        ('<x:capsule xmlns:x="u:v" radius="0.05" length="0.3"/>', (0.1, 0.1, 0.4), ""),
        ('<box size="0.2 0.1 0"/>', (0.2, 0.1, 0), ""),
        ('<cylinder radius="0.1" length="0"/>', (0.2, 0.2, 0), ""),
        ("<box>0.2 0.1 0.3</box>", (0.2, 0.1, 0.3), "size as text"),
        ("<box><size>0.2 0.1 0.3</size></box>", (0.2, 0.1, 0.3), "size as text"),
        ("<sphere><radius>0.1</radius></sphere>", (0.2, 0.2, 0.2), "radius as text"),
        ('<box size="0.2 0.1 0.3"/><sphere radius="1"/>', (0.2, 0.1, 0.3), "its first <box> counts"),
        ('<mesh filename="m.obj"/>', (1, 2, 3), ""),
        ('<mesh filename="m.obj" scale="0.1"/>', (0.1, 0.2, 0.3), ""),
        ('<mesh filename="m.obj" scale="1 0.5 0.1 1 1"/>', (1, 1, 0.3), "has 5 numbers: the first three count"),
        ('<mesh filename="m.obj" scale="-1 1 1"/>', (1, 2, 3), ""),
        ("<mesh><uri>m.obj</uri></mesh>", (1, 2, 3), "elsewhere than in filename"),
        ("<mesh>m.obj</mesh>", (1, 2, 3), "elsewhere than in filename"),
    ],
)
def test_shapes_have_the_size_that_is_written(shape: str, size: tuple[float, ...], repair: str, tmp_path: Path) -> None:
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "m.obj")
    obj = load(write(tmp_path, '<limit lower="0" upper="1"/>', shape=shape))
    assert obj.box_size[1] == pytest.approx(size, abs=1e-3)
    assert repair in said(obj) if repair else not obj.repairs
    if min(size) > 0:
        assert obj.part_mesh(1).volume > 0  # faces outwards, mirrored too


@pytest.mark.parametrize(
    ("shape", "what"),
    [
        ('<cone radius="1" length="1"/>', "geometry <cone> is not one of"),
        ('<plane normal="0 0 1"/>', "geometry <plane> is not one of"),
        ('<mesh filename="m.obj" scale="1 1"/>', "numbers"),
        ('<mesh filename="m.obj" scale="1 0 1"/>', "mesh 'm.obj' has scale='1 0 1'"),
        ('<mesh filename="m.obj" scale="1 nan 1"/>', "is not finite"),
        ("<mesh/>", "its mesh has no filename"),
        ('<box size="0 0 0"/>', "a part has no extent: link 'b'"),
        ('<box size="0 0 1"/>', "a part has no extent: link 'b'"),
        ('<box size="-1 1 1"/>', "a part has no extent: link 'b'"),
        ('<sphere radius="0"/>', "a part has no extent: link 'b'"),
        ('<mesh filename="point.obj"/>', "link 'b' can be used: mesh 'point.obj' has no extent"),
        ('<mesh filename="line.obj"/>', "link 'b' can be used: mesh 'line.obj' has no extent"),
    ],
)
def test_a_part_of_which_nothing_is_left_is_an_error(shape: str, what: str, tmp_path: Path) -> None:
    trimesh.creation.box((1, 2, 3)).export(tmp_path / "m.obj")
    (tmp_path / "point.obj").write_text("v 1 2 3\nv 1 2 3\nv 1 2 3\nf 1 2 3\n")
    (tmp_path / "line.obj").write_text("v 0 0 0\nv 1 2 3\nv 2 4 6\nf 1 2 3\n")
    with pytest.raises(AssetError, match=what):
        load(write(tmp_path, '<limit lower="0" upper="1"/>', shape=shape))


def test_a_flat_mesh_is_a_surface(tmp_path: Path) -> None:
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 2 3\nv 2 0 6\nf 1 2 3\n")
    obj = load(write(tmp_path, '<limit lower="0" upper="1"/>', shape='<mesh filename="flat.obj"/>'))
    assert len(obj.parts[1].faces) == 1


@pytest.mark.parametrize(
    ("kind", "advice"), [("planar", "two prismatic joints"), ("ball", "three revolute joints"), ("screw", "<mimic>")]
)
def test_joints_of_more_freedom_are_refused_with_what_to_write(kind: str, advice: str, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=f"joint type '{kind}' is not supported.*{advice}"):
        load(write(tmp_path, kind=kind))


def test_ends_written_as_text_are_read(tmp_path: Path) -> None:
    path = write(tmp_path, '<limit lower="0" upper="1"/>')
    path.write_text(path.read_text().replace('<parent link="a"/>', "<parent>a</parent>"))
    assert "<parent> has its link as text" in said(load(path))
