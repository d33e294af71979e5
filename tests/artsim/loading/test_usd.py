"""USD files are the objects that UsdPhysics describes, and read nothing outside their folder."""

from __future__ import annotations

import builtins
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
from artsim.model.part_inertia import part_inertia
from tests.artsim.loading.round_trip import FAMILIES, assert_same_geometry, assert_same_object
from tests.artsim.loading.usd_files import AT_LID, BODY, CUBE, HEAD, HINGE, PAIR, body, joint, repairs_of, written
from tests.conftest import installed, valve

# --- what artsim wrote ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("category", FAMILIES)
def test_an_exported_object_comes_back_as_it_was(category: str, tmp_path: Path) -> None:
    obj = valve() if category == "valve" else make(category, 3)
    export(obj, tmp_path / "o", ["usd"])
    assert_same_object(load(tmp_path / "o"), obj)


def test_a_free_base_is_no_part_of_the_object(tmp_path: Path) -> None:
    export(valve(), tmp_path / "o", ["usd"], options=ExportOptions("free"))
    assert_same_object(load(tmp_path / "o" / "mobility.usda"), valve())


@pytest.mark.parametrize("suffix", ["usd", "usdc"])
def test_binary_files_say_the_same_as_text(suffix: str, tmp_path: Path) -> None:
    installed("pxr")
    from pxr import Sdf

    export(valve(), tmp_path / "o", ["usd"])
    text = tmp_path / "o" / "mobility.usda"
    Sdf.Layer.FindOrOpen(str(text)).Export(str(text.with_suffix(f".{suffix}")))
    text.unlink()
    assert_same_object(load(tmp_path / "o"), valve())
    assert [source.path.suffix for source in find_sources([tmp_path])] == [f".{suffix}"]


def test_a_real_object_comes_back_as_it_was(partnet_dir: Path, tmp_path: Path) -> None:
    folder = min(partnet_dir.glob("StorageFurniture/*/mobility.urdf")).parent
    obj = add_surface_bodies(load(folder))
    export(obj, tmp_path / "o", ["usd"])
    assert_same_geometry(load(tmp_path / "o"), obj)


# --- what others write ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "more", "types", "limits"),
    [
        ("Revolute", HINGE + AT_LID, ("free", "revolute"), np.deg2rad([-30, 90])),
        ("Revolute", AT_LID, ("free", "continuous"), [-np.inf, np.inf]),
        (
            "Prismatic",
            "float physics:lowerLimit = 0\nfloat physics:upperLimit = 0.5\n",
            ("free", "prismatic"),
            [0, 0.5],
        ),
        ("Prismatic", "", ("free", "prismatic"), [-1, 1]),
        ("Fixed", AT_LID, ("free",), None),
        ("Revolute", "bool physics:jointEnabled = 0", None, None),
    ],
)
def test_joints_have_their_types_and_limits(
    kind: str, more: str, types: tuple[str, ...] | None, limits: Any, tmp_path: Path
) -> None:
    path = written(tmp_path, PAIR + joint(kind, "base", "lid", more))
    if types is None:  # two bodies that nothing joins are two objects
        with pytest.raises(AssetError, match="holds 2 objects: base, lid"):
            load(path)
        return
    obj = load(path)
    assert obj.tree.types == types
    if limits is not None:
        np.testing.assert_allclose(obj.tree.limits[1], limits, atol=1e-7)


def test_lengths_are_metres_and_z_is_up(tmp_path: Path) -> None:
    """In centimetres with Y up, a lid 100 above its base slides up to 50 further up, and weighs 7 kg."""
    head = HEAD.replace("metersPerUnit = 1", "metersPerUnit = 0.01").replace('"Z"', '"Y"')
    weight = "float physics:mass = 7\nfloat3 physics:diagonalInertia = (10000, 20000, 30000)\n"
    cube = CUBE.replace("0.2", "20")
    content = body("base", shape=cube) + body("lid", (0, 100, 0), weight, cube)
    slide = 'uniform token physics:axis = "Y"\nfloat physics:lowerLimit = 0\nfloat physics:upperLimit = 50\n'
    slide += "point3f physics:localPos0 = (0, 100, 0)\n"
    drive = joint("Prismatic", "base", "lid", slide + "float drive:linear:physics:maxForce = 400\n")
    drive = drive.replace('"j" {', '"j" (prepend apiSchemas = ["PhysicsDriveAPI:linear"]) {')
    obj = load(written(tmp_path, content + drive, head))
    np.testing.assert_allclose(obj.tree.axes[1], [0, 0, 1], atol=1e-12)
    np.testing.assert_allclose(obj.tree.limits[1], [0, 0.5])
    np.testing.assert_allclose(obj.box_center[1] - obj.box_center[0], [0, 0, 1], atol=1e-9)
    np.testing.assert_allclose(obj.box_size, 0.2)
    inertia = part_inertia(obj, 1)
    assert obj.parts[1].body is not None
    assert obj.parts[1].body.joint.effort == pytest.approx(4)  # N: 400 kg cm/s2
    assert inertia.mass == pytest.approx(7)
    np.testing.assert_allclose(inertia.tensor.diagonal(), [1, 3, 2], rtol=1e-6)


def test_a_joint_is_zero_where_its_frames_meet(tmp_path: Path) -> None:
    """The lid stands 1 m up in the stage, but at the zero of its slide it lies on the base."""
    slide = 'uniform token physics:axis = "Z"\nfloat physics:lowerLimit = 0\nfloat physics:upperLimit = 2\n'
    obj = load(written(tmp_path, PAIR + joint("Prismatic", "base", "lid", slide)))
    np.testing.assert_allclose(obj.box_center[1], obj.box_center[0], atol=1e-9)


def test_a_joint_may_name_its_parent_second(tmp_path: Path) -> None:
    """The lid turns against the base as the base turns against the lid, the other way round."""
    place = "point3f physics:localPos0 = (0, 0, 0.5)\npoint3f physics:localPos1 = (0, 0, -0.5)\n"
    other = "point3f physics:localPos0 = (0, 0, -0.5)\npoint3f physics:localPos1 = (0, 0, 0.5)\n"
    hold = 'def PhysicsFixedJoint "hold" { rel physics:body1 = </o/base> }\n'
    first = load(written(tmp_path, PAIR + hold + joint("Revolute", "base", "lid", HINGE + place)))
    second = load(written(tmp_path, PAIR + hold + joint("Revolute", "lid", "base", HINGE + other)))
    assert first.tree.types == second.tree.types == ("free", "revolute")
    np.testing.assert_allclose(first.tree.origins, second.tree.origins, atol=1e-9)
    np.testing.assert_allclose(first.tree.axes[1], -second.tree.axes[1], atol=1e-9)


def test_scales_belong_to_shapes_and_anchors(tmp_path: Path) -> None:
    scaled = (
        'def Xform "lid" (' + BODY + ") {\ndouble3 xformOp:translate = (0, 0, 1)\nfloat3 xformOp:scale = (1, 2, 3)\n"
    )
    scaled += 'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]\n' + CUBE + "\n}\n"
    anchor = HINGE + "point3f physics:localPos0 = (0, 0, 0.7)\npoint3f physics:localPos1 = (0, 0, -0.1)\n"
    obj = load(written(tmp_path, body("base") + scaled + joint("Revolute", "base", "lid", anchor)))
    np.testing.assert_allclose(obj.box_size[1], [0.2, 0.4, 0.6], atol=1e-9)
    np.testing.assert_allclose(obj.tree.origins[1] - obj.box_center[0], [0, 0, 0.7], atol=1e-6)
    np.testing.assert_allclose(obj.box_center[1] - obj.box_center[0], [0, 0, 1], atol=1e-6)
    assert part_inertia(obj, 1).mass == pytest.approx(1000 * 0.2 * 0.4 * 0.6)  # of water, where nothing is said


def test_shapes_have_their_sizes(tmp_path: Path) -> None:
    shapes = {
        'Sphere "a" { double radius = 0.1 }': [0.2, 0.2, 0.2],
        'Cylinder "a" { double radius = 0.1\ndouble height = 0.6\nuniform token axis = "X" }': [0.6, 0.2, 0.2],
        'Capsule "a" { double radius = 0.1\ndouble height = 0.6\nuniform token axis = "Y" }': [0.2, 0.8, 0.2],
        'Cone "a" { double radius = 0.1\ndouble height = 0.6 }': [0.2, 0.2, 0.6],
        'Mesh "a" { point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 2, 0), (0, 2, 0)]\n'
        "int[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2, 3] }": [1, 2, 0],
    }
    for text, size in shapes.items():
        obj = load(written(tmp_path, body("base", shape=f"def {text}"), name=f"{text[:4]}.usda"))
        np.testing.assert_allclose(obj.box_size[0], size, atol=1e-3)
        if "Cone" in text:
            assert obj.part_mesh(0).volume == pytest.approx(np.pi * 0.01 * 0.2, rel=0.01)
            assert obj.part_mesh(0).is_watertight


def test_what_is_only_a_guide_collides_unseen(tmp_path: Path) -> None:
    guide = CUBE.replace("double size", 'uniform token purpose = "guide"\ndouble size')
    obj = load(written(tmp_path, body("base", shape=guide + '\ndef Sphere "seen" { double radius = 0.3 }')))
    np.testing.assert_allclose(obj.box_size[0], 0.6, atol=1e-3)
    assert obj.parts[0].body is not None
    np.testing.assert_allclose(np.ptp(obj.parts[0].body.pieces[0][0], axis=0), 0.2)
    unseen = load(written(tmp_path, body("base", shape=guide)))
    assert "its collision geometry is shown" in repairs_of(unseen)


def test_layers_of_the_folder_are_taken_in(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    written(tmp_path / "parts", body("base") + body("lid", (0, 0, 1)), name="p.usda")
    text = f'{HEAD}def "o" (prepend references = @parts/p.usda@) {{\n{joint("Revolute", "base", "lid", HINGE)}\n}}\n'
    (tmp_path / "object.usda").write_text(text)
    obj = load(tmp_path / "object.usda")
    assert len(obj) == 2
    written(tmp_path / "parts", body("base") + body("lid", (0, 0, 2)), name="p.usda")
    assert load(tmp_path / "object.usda").sha256 != obj.sha256


# --- what is refused -----------------------------------------------------------------------------------------------

TRIANGLE = "".join(body(name, (place, 0, 0)) for name, place in (("a", 0), ("b", 1), ("c", 2)))
LOOP = TRIANGLE + "".join(
    joint("Revolute", first, second, HINGE, f"j_{first}") for first, second in (("a", "b"), ("b", "c"), ("c", "a"))
)

REFUSED: dict[str, tuple[str, str]] = {
    "reference outside": ('def "a" (references = @../secret.usda@) {}', "outside the file's folder"),
    "absolute reference": ('def "a" (references = @/etc/hostname.usda@) {}', "outside the file's folder"),
    "payload of the web": ('def "a" (payload = @https://example.org/x.usda@) {}', "outside the file's folder"),
    "in a variant": (
        'def "a" (variantSets = "v") { variantSet "v" = { "x" { def "b" (references = @../secret.usda@) {} } } }',
        "outside the file's folder",
    ),
    "no layer": ('def "a" (references = @picture.png@) {}', "no USD layer"),
    "distance": (PAIR + joint("Distance", "base", "lid"), "a PhysicsDistanceJoint is not supported"),
    "loop": (LOOP, "closes a chain"),
    "no such body": (PAIR + joint("Revolute", "base", "nobody"), "does not exist"),
    "itself": (PAIR + joint("Revolute", "base", "base"), "joins a body to itself"),
    "nothing to see": ('def Xform "a" {}', "no prim of the object is a surface"),
    "flat": (
        f'def Xform "a" ({BODY}) {{ float3 xformOp:scale = (1, 0, 1)\n'
        'uniform token[] xformOpOrder = ["xformOp:scale"] }',
        "a scale of 0",
    ),
    "a word for a mass": (body("base", more='string physics:mass = "heavy"'), "'heavy', which is not a number"),
    "an unknown axis": (
        PAIR + joint("Revolute", "base", "lid", 'uniform token physics:axis = "W"'), "which is not one of X, Y, Z"
    ),
    "a shape without extent": (
        body("base", shape='def Cube "s" { double size = 0 }'),
        "prim /o/base: none of its shapes can be used: /o/base/s has no extent",
    ),
    "a shape too far away": (body("base", shape='def Cube "s" { double size = 3e6 }'), "over 1e.06 m"),
    "a frame that is not finite": (
        PAIR + joint("Revolute", "base", "lid", "point3f physics:localPos0 = (inf, 0, 0)"),
        "prim /o/j: its frame in body 0 is not finite",
    ),
    "a circle of followers": (
        PAIR + joint("Revolute", "base", "lid", "rel artsim:mimic:joint = </o/j>"),
        "prim /o/j: joints follow each other in a circle",
    ),
    "a number out of range": (
        PAIR + joint("Revolute", "base", "lid", "rel artsim:mimic:joint = </o/j>\ndouble artsim:mimic:offset = 1e30"),
        "prim /o/j: follows another by 1 and 1e.30",
    ),
    "broken": ("def {", "no USD layer that can be read"),
}  # fmt: skip


def test_a_binary_file_that_declares_more_than_it_holds_is_refused(tmp_path: Path) -> None:
    installed("pxr")
    from pxr import Sdf

    text = written(tmp_path, PAIR + joint("Revolute", "base", "lid"))
    binary = text.with_suffix(".usdc")
    Sdf.Layer.FindOrOpen(str(text)).Export(str(binary))
    whole = binary.read_bytes()
    assert len(load(binary)) == 2
    table = int.from_bytes(whole[16:24], "little")
    first = int.from_bytes(whole[table + 24 : table + 32], "little")
    for at in (16, table, table + 24, first, first + 8, first + 16):
        binary.write_bytes(whole[:at] + (1 << 40).to_bytes(8, "little") + whole[at + 8 :])
        with pytest.raises(AssetError, match=r"no USD layer that can be read|usd-core ends|takes over"):
            load(binary)
    binary.write_bytes(whole[:100])
    with pytest.raises(AssetError, match="no USD layer that can be read"):
        load(binary)


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_or_may_not_be_read_is_refused(case: str, tmp_path: Path) -> None:
    content, message = REFUSED[case]
    (tmp_path / "secret.usda").write_text(HEAD + 'def Cube "o" {}')
    folder = tmp_path / "object"
    folder.mkdir()
    (folder / "picture.png").write_bytes(b"x")
    with pytest.raises(AssetError, match=message) as caught:
        load(written(folder, content))
    assert caught.value.fix
    # Words of other formats, and names of what is not in the file.
    assert not {"link", "links", "urdf", "mjcf", "mujoco", "<robot>", "geom", "type="} & set(
        str(caught.value).lower().split()
    )


@pytest.mark.parametrize("pair", ['def Xform "a" {\n|}\n', "custom double[] x = [|]", "{dictionary a = |}", "(|)"])
def test_brackets_inside_each_other_end_no_process_of_ours(pair: str, tmp_path: Path) -> None:
    opened, closed = pair.split("|")
    path = tmp_path / "deep.usda"
    path.write_text(f"{HEAD}{opened * 20_000}{closed * 20_000}")
    with pytest.raises(AssetError, match=r"usd-core ends without an answer|no USD layer that can be read"):
        load(path)


def test_without_usd_core_the_error_names_the_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    found: Callable[..., Any] = builtins.__import__

    def lacking(name: str, *more: Any, **named: Any) -> Any:
        if name.partition(".")[0] == "pxr":
            raise ModuleNotFoundError("No module named 'pxr'", name="pxr")
        return found(name, *more, **named)

    path = written(tmp_path, body("base"))
    monkeypatch.setattr(builtins, "__import__", lacking)
    with pytest.raises(ConfigError, match=r"sim"):
        load(path)
