"""The URDF objects of our own: what they are, that they are sound, and that the loader mends what is odd in them."""

from __future__ import annotations

import itertools
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import manifold3d  # type: ignore[import-not-found]  # a compiled module without stubs
import numpy as np
import pytest
import trimesh

from artsim.loading.urdf import load
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Part
from tests.conftest import ASSETS, DEMO
from tests.processors import can_run, left_out

INF, QUARTER = np.inf, np.pi / 2
QUIRKS = ASSETS / "quirks"


@dataclass(frozen=True)
class Expected:
    """What loading must find: (type, lower, upper) of each joint but the root's, and the repairs recorded."""

    joints: tuple[tuple[str, float, float], ...]
    repairs: tuple[str, ...] = ()


PARTNET = (
    "links: without geometry: base",
    "fixed joints: merged into their parent: link_0",
)
DEMOS = {
    "laptop": Expected(
        (("revolute", -QUARTER, 0.7),),
        (*PARTNET, "joint 'joint_1': rest state -90.0 deg instead of 0: a laptop is closed there"),
    ),
    "cabinet": Expected((("prismatic", 0, 0.3),) * 3, PARTNET),
    "eyeglasses": Expected((("revolute", 0, QUARTER),) * 2, PARTNET),
    "dishwasher": Expected((("revolute", 0, QUARTER), *(("prismatic", 0, 0.38),) * 2), PARTNET),
    "scissors": Expected((("revolute", 0, 0.9),), PARTNET),
}
LABELS = {
    "laptop": ("laptop", ["base_body", "screen"]),
    "cabinet": ("storage_furniture", ["cabinet_frame", "drawer", "drawer", "drawer"]),
    "eyeglasses": ("eyeglasses", ["glasses_body", "leg", "leg"]),
    "dishwasher": ("dishwasher", ["dishwasher_body", "door", "rack", "rack"]),
    "scissors": ("scissors", ["blade", "blade"]),
}
CASES = {
    "chain": Expected(
        (
            ("revolute", -2, 2),
            ("revolute", -1.5, 1.5),
            ("prismatic", 0, 0.15),
            ("revolute", -1, 1),
            ("continuous", -INF, INF),
            ("revolute", 0.2, 1.2),
        ),
        (
            "joint 'j1': axis of length 2 normalised",
            "joint 'j4': axis of length 1.41421 normalised",
            "joint 'j6': rest state 11.5 deg instead of 0: 0 is outside its limits",
        ),
    ),
    "continuous_knob": Expected(
        (("continuous", -INF, INF),), ("joint 'knob_joint': is continuous: its limits are ignored",)
    ),
    "empty_base_two_fixed": Expected(
        (("prismatic", -0.15, 0.15),),
        ("links: without geometry: base", "fixed joints: merged into their parent: left, right, crossbar"),
    ),
    "empty_leaf": Expected(
        (("prismatic", -0.1, 0.1),),
        (
            "links: without geometry: camera_frame",
            "link 'camera_frame': left out: it moves, but shows and carries nothing",
        ),
    ),
    "formats": Expected((("prismatic", 0, 0.1),) * 3),
    "limits": Expected(
        (
            ("revolute", -0.5, 1),
            ("continuous", -INF, INF),
            ("prismatic", 0, 0),
            ("revolute", 0.5, 1.5),
            ("prismatic", 0, 0.1),
        ),
        (
            "joint 'j_swapped': limits 1 and -0.5 swapped",
            "joint 'j_zero_axis': has a zero axis, along which nothing moves: read as fixed",
            "joint 'j_no_limit': is revolute without a limit: read as continuous",
            "joint 'j_no_range': is prismatic without a limit: held at 0",
            "joint 'j_negative_zero': limit -0 read as 0",
            "fixed joints: merged into their parent: zero_axis",
            "joint 'j_late': rest state 28.6 deg instead of 0: 0 is outside its limits",
        ),
    ),
    "merged": Expected(
        (("prismatic", -0.15, 0.15),),
        (
            "links: without geometry: base, camera_frame",
            "fixed joints: merged into their parent: left, right",
            "link 'camera_frame': left out: it moves, but shows and carries nothing",
        ),
    ),
    "meshes": Expected(
        (("revolute", 0, 1),),
        (
            "link 'body': mesh 'meshes/gone.obj' is missing: left out",
            "link 'body': mesh 'meshes/empty.obj' has no faces: left out",
        ),
    ),
    "mimic_pair": Expected((("revolute", -1.5, 0), ("revolute", 0, 1.6))),
    "mirrored_scale": Expected((("revolute", -1, 0),)),
    "missing_mesh": Expected((("revolute", 0, 1),), ("link 'body': mesh 'meshes/gone.obj' is missing: left out",)),
    "negative_zero": Expected((("prismatic", 0, 0.1),), ("joint 'slider_joint': limit -0 read as 0",)),
    "package": Expected((("revolute", 0, 1),)),
    "package_paths": Expected((("revolute", 0, 1),)),
    "primitives": Expected((("continuous", -INF, INF),)),
    "range_excludes_zero": Expected(
        (("revolute", 0.5, 1.5),),
        ("joint 'lever_joint': rest state 28.6 deg instead of 0: 0 is outside its limits",),
    ),
    "screw_helper": Expected(
        (("screw", 0, 2 * np.pi),),
        (
            "links: without geometry: cap_helper",
            "link 'cap_helper': helper of a screw: joints 'cap_slide' and 'cap_turn' joined into one of "
            "0.0031831 m/rad",
        ),
    ),
    "screw_mimic": Expected(
        (("screw", -15, 15),),
        (
            "links: without geometry: stem",
            "link 'stem': helper of a screw: joints 'wheel_turn' and 'wheel_slide' joined into one of -0.002 m/rad",
        ),
    ),
    "swapped_limits": Expected((("revolute", -0.5, 1),), ("joint 'lever_joint': limits 1 and -0.5 swapped",)),
    "zero_axis": Expected(
        (),
        (
            "joint 'lever_joint': has a zero axis, along which nothing moves: read as fixed",
            "fixed joints: merged into their parent: lever",
        ),
    ),
    "zero_face_mesh": Expected((("revolute", 0, 1),), ("link 'body': mesh 'meshes/empty.obj' has no faces: left out",)),
}


def quirk(name: str) -> ArticulatedObject:
    """One of the quirk cases, wherever its URDF file lies in its folder."""
    (file,) = (QUIRKS / name).rglob("*.urdf")
    return load(file)


def check_joints(obj: ArticulatedObject, expected: Expected) -> None:
    assert obj.tree.types == ("free", *(kind for kind, _, _ in expected.joints))
    limits = np.array([joint[1:] for joint in expected.joints]).reshape(-1, 2)
    np.testing.assert_allclose(obj.tree.limits[1:], limits, atol=1e-8)
    assert [str(repair) for repair in obj.repairs] == list(expected.repairs)


# --- demo objects ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("folder", DEMO, ids=lambda path: path.name)
def test_demo_objects_have_their_category_parts_and_joints(folder: Path) -> None:
    obj = load(folder)
    check_joints(obj, DEMOS[folder.name])
    assert (obj.category, [part.label for part in obj.parts]) == LABELS[folder.name]
    assert obj.object_id == folder.name


def test_demo_objects_have_real_sizes() -> None:
    sizes = {
        "laptop": (0.23, 0.33, 0.03),
        "cabinet": (0.47, 0.50, 0.76),
        "eyeglasses": (0.14, 0.14, 0.05),
        "dishwasher": (0.65, 0.60, 0.82),
        "scissors": (0.09, 0.20, 0.01),
    }
    for folder in DEMO:
        np.testing.assert_allclose(np.ptp(load(folder).bounds, axis=0), sizes[folder.name], atol=0.006)


def solids(part: Part) -> list[trimesh.Trimesh]:
    """The connected pieces of a part's surface."""
    return list(trimesh.Trimesh(part.vertices, part.faces, process=False).split(only_watertight=False))


@pytest.mark.parametrize("folder", DEMO, ids=lambda path: path.name)
def test_demo_meshes_are_closed_and_face_outwards(folder: Path) -> None:
    for part in load(folder).parts:
        for solid in solids(part):
            assert solid.is_watertight
            assert solid.is_winding_consistent
            assert solid.volume > 0


def opened(obj: ArticulatedObject, part: int) -> Array:
    """Vertices of a part in the rest frame, with its joint at the end of its range furthest from rest."""
    q = obj.tree.rest.copy()
    low, high = obj.tree.limits[part]
    q[part] = low if abs(low - q[part]) > abs(high - q[part]) else high
    return posed(obj, q)[part]


def posed(obj: ArticulatedObject, q: Array) -> list[Array]:
    """Vertices of every part in the rest frame at a state."""
    transforms = obj.tree.forward_kinematics(q)
    return [p.vertices @ T[:3, :3].T + T[:3, 3] for p, T in zip(obj.parts, transforms, strict=True)]


def test_the_laptop_is_closed_at_rest_and_its_hinge_is_at_the_back() -> None:
    obj = load(ASSETS / "laptop")
    base, lid = obj.part_bounds
    assert obj.tree.origins[1, 0] > 0.1
    np.testing.assert_allclose(lid[:, 0], base[:, 0], atol=0.006)
    assert np.ptp(lid[:, 2]) < 0.015
    open_lid = opened(obj, 1)
    assert open_lid[:, 2].max() > 0.15
    assert open_lid[:, 0].max() > base[1, 0] + 0.1, "opened wide, the lid leans away from the user in front of it"


def test_drawers_slide_out_of_the_front_of_a_cabinet_that_stands_on_its_feet() -> None:
    obj = load(ASSETS / "cabinet")
    heights = obj.box_center[1:, 2]
    assert (np.diff(heights) < 0).all()
    for k in (1, 2, 3):
        assert obj.part_bounds[k, 0, 0] < obj.part_bounds[0, 0, 0]
        assert opened(obj, k)[:, 0].min() == pytest.approx(obj.part_bounds[k, 0, 0] - 0.3)
    near_the_floor = obj.parts[0].vertices[:, 2] < obj.bounds[0, 2] + 0.07
    assert np.ptp(obj.parts[0].vertices[near_the_floor, 0]) > 0.3
    assert not any(part.vertices[:, 2].min() < obj.bounds[0, 2] + 0.07 for part in obj.parts[1:])


def test_the_dishwashers_door_has_its_handle_in_front_and_falls_open_forwards() -> None:
    obj = load(ASSETS / "dishwasher")
    door = obj.parts[1].vertices
    handle = door[door[:, 0] < door[:, 0].min() + 0.01]
    assert door[:, 0].max() < obj.part_bounds[0, 0, 0]
    assert handle[:, 2].min() > 0.2, "the handle is near the top"
    assert obj.tree.origins[1, 2] < -0.25, "the hinge is near the floor"
    assert opened(obj, 1)[:, 0].min() < obj.bounds[0, 0] - 0.5
    for rack in (2, 3):
        assert opened(obj, rack)[:, 0].min() == pytest.approx(obj.part_bounds[rack, 0, 0] - 0.38)


def test_the_legs_of_the_eyeglasses_point_backwards_and_fold_inwards() -> None:
    obj = load(ASSETS / "eyeglasses")
    assert obj.box_center[0, 0] < -0.05
    for k in (1, 2):
        assert obj.part_bounds[k, 1, 0] > 0.07
        folded = opened(obj, k)
        assert folded[:, 0].max() < -0.05
        assert folded[:, 1].min() < -0.02 < 0.02 < folded[:, 1].max(), "folded, a leg reaches past the middle"


def test_the_scissors_lie_flat_with_their_points_at_y_and_the_ring_of_the_root_towards_minus_x() -> None:
    obj = load(ASSETS / "scissors")
    points = np.concatenate([part.vertices for part in obj.parts])
    width_of_points = np.ptp(points[points[:, 1] > 0.02, 0])
    width_of_rings = np.ptp(points[points[:, 1] < -0.02, 0])
    assert width_of_rings > 4 * width_of_points
    assert obj.box_center[0, 0] < 0 < obj.box_center[1, 0]
    assert np.ptp(opened(obj, 1)[:, 0]) > 0.06


def states(obj: ArticulatedObject) -> list[Array]:
    """Rest, five states over the range of each joint, and all joints furthest from rest.

    A dishwasher's racks slide with its door open.
    """
    rest, limits = obj.tree.rest, obj.tree.limits
    furthest = np.where(np.abs(limits[:, 0] - rest) > np.abs(limits[:, 1] - rest), limits[:, 0], limits[:, 1])
    found = [rest, furthest]
    for k in range(1, len(obj)):
        for state in np.linspace(limits[k, 0], limits[k, 1], 5):
            q = rest.copy()
            if obj.parts[k].label == "rack":
                q[1] = limits[1, 1]
            q[k] = state
            found.append(q)
    return found


@pytest.mark.parametrize("folder", DEMO, ids=lambda path: path.name)
def test_parts_of_the_demo_objects_never_touch(folder: Path) -> None:
    """Over every joint's range a gap of a quarter of a millimetre stays open between any two parts."""
    obj = load(folder)
    bodies = [
        manifold3d.Manifold.batch_boolean(
            [
                manifold3d.Manifold(manifold3d.Mesh64(solid.vertices * 1e3, solid.faces.astype(np.uint64)))
                for solid in solids(part)
            ],
            manifold3d.OpType.Add,
        )
        for part in obj.parts
    ]
    for q in states(obj):
        transforms = obj.tree.forward_kinematics(q)
        transforms[:, :3, 3] *= 1e3
        placed = [body.transform(T[:3]) for body, T in zip(bodies, transforms, strict=True)]
        for a, b in itertools.combinations(placed, 2):
            assert a.min_gap(b, 1.0) > 0.25, f"overlap of {(a ^ b).volume():.2f} mm^3 at {q}"


@pytest.mark.slow
def test_rebuilding_changes_no_byte(tmp_path: Path) -> None:
    """In a process of its own: build.py tells numpy which kernels to use."""
    if not can_run("with AVX2"):
        pytest.skip(left_out("with AVX2"))
    subprocess.run([sys.executable, ASSETS / "build.py", tmp_path], check=True)
    files = [path for path in tmp_path.rglob("*") if path.is_file() and tmp_path / "procedural" not in path.parents]
    built = {path.relative_to(tmp_path): path.read_bytes() for path in files}
    assert Path("procedural.sha256") in built
    changed = [str(name) for name, content in built.items() if (ASSETS / name).read_bytes() != content]
    assert not changed
    kept = {path.relative_to(ASSETS) for folder in DEMO for path in folder.rglob("*") if path.is_file()}
    kept.add(Path("procedural.sha256"))
    assert kept == {name for name in built if name.parts[0] != "quirks"}, "a file that build.py no longer writes"


# --- quirk cases ---------------------------------------------------------------------------------------------------


def test_every_quirk_case_is_expected_and_described() -> None:
    folders = {path.name for path in QUIRKS.iterdir()}
    assert folders == set(CASES)
    readme = (ASSETS / "README.md").read_text()
    assert all(f"`{name}`" in readme for name in folders)


@pytest.mark.parametrize("name", CASES)
def test_quirks_are_mended_and_recorded(name: str) -> None:
    obj = quirk(name)
    check_joints(obj, CASES[name])
    assert all(len(part.faces) for part in obj.parts)
    assert ((obj.tree.limits[:, 0] <= obj.tree.rest) & (obj.tree.rest <= obj.tree.limits[:, 1])).all()


@pytest.mark.parametrize(
    "name", ["mirrored_scale", "meshes", "missing_mesh", "zero_face_mesh", "package", "package_paths"]
)
def test_meshes_that_are_scaled_or_mirrored_keep_facing_outwards(name: str) -> None:
    obj = quirk(name)
    for k in range(len(obj)):
        assert obj.part_mesh(k).volume == pytest.approx(np.prod(obj.box_size[k]))


def test_a_mirrored_mesh_lies_on_the_other_side_of_its_joint() -> None:
    obj = quirk("mirrored_scale")
    np.testing.assert_allclose(obj.part_bounds[1] - obj.tree.origins[1], [[-1, 0, 0], [0, 1, 1]], atol=1e-9)


def test_one_ramp_is_read_alike_from_every_file_format() -> None:
    obj = quirk("formats")
    corners = []
    for k, part in enumerate(obj.parts):
        place = obj.tree.origins[k] if k else obj.tree.origins[1] - [0, 0.3, 0]
        corners.append(np.unique(np.round(part.vertices - place, 6) + 0.0, axis=0))
        assert obj.part_mesh(k).volume == pytest.approx(0.3 * 0.1 * 0.15)
    ramp = [(x, y, z) for x in (0, 0.3) for y, z in ((0, 0), (0, 0.1), (0.1, 0), (0.1, 0.2))]
    for found in corners:
        np.testing.assert_allclose(found, ramp, atol=1e-6)


def test_a_following_door_opens_with_the_other() -> None:
    obj = quirk("mimic_pair")
    closed, ajar = (posed(obj, obj.tree.complete_state([0, q, 0])) for q in (0.0, -1.5))
    assert closed[1][:, 0].min() > obj.bounds[0, 0] - 0.02
    assert all(doors[:, 0].min() < obj.part_bounds[0, 0, 0] - 0.2 for doors in ajar[1:])


@pytest.mark.parametrize(("name", "rise"), [("screw_helper", 0.02 / (2 * np.pi)), ("screw_mimic", -0.002)])
def test_screws_travel_along_their_axis_as_they_turn(name: str, rise: float) -> None:
    obj = quirk(name)
    T = obj.tree.forward_kinematics([0.0, 1.0])[1]
    axis = obj.tree.axes[1]
    np.testing.assert_allclose(T[:3, :3] @ axis, axis, atol=1e-12)
    assert np.arccos((np.trace(T[:3, :3]) - 1) / 2) == pytest.approx(1.0)
    assert T[:3, 3] @ axis == pytest.approx(rise)


def test_fixed_links_are_merged_where_they_stand() -> None:
    merged, shelf = quirk("empty_base_two_fixed").box_size
    np.testing.assert_allclose(merged, [0.1, 0.5, 0.4])
    np.testing.assert_allclose(shelf, [0.1, 0.28, 0.02])


def test_primitives_are_turned_by_their_origins() -> None:
    obj = quirk("primitives")
    box = obj.parts[0].vertices[:8]
    angle = 0.5
    footprint = 0.4 * np.cos(angle) + 0.3 * np.sin(angle), 0.4 * np.sin(angle) + 0.3 * np.cos(angle), 0.2
    np.testing.assert_allclose(np.ptp(box, axis=0), footprint)
    cylinder = obj.parts[0].vertices[8:]
    lean = 0.3 * np.cos(1.2) + 0.1 * np.sin(1.2), 0.3 * np.sin(1.2) + 0.1 * np.cos(1.2)
    np.testing.assert_allclose(np.ptp(cylinder, axis=0), [0.1, lean[1], lean[0]], rtol=2e-3)
    np.testing.assert_allclose(obj.box_size[1], 0.2, rtol=2e-3)
