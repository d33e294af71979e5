"""Conventions: families lie in the frames that real objects have."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from artsim import make
from artsim.checks.conventions import Frame, differences, doubts, joint_sort
from artsim.checks.realism import REAL, read_split, real_objects
from artsim.families import CATEGORIES
from artsim.loading.urdf import load
from artsim.model.joints import Joint
from artsim.model.kinematics import KinematicTree
from artsim.model.objects import ArticulatedObject
from tests.artsim.checks.test_realism import SPLIT

_OBJECTS = 30
EDITED = ("toaster",)
"""Of whose real objects someone edited the files: an empty root, along which the whole body slides."""


@pytest.mark.slow
@pytest.mark.parametrize("category", sorted((set(REAL) & set(CATEGORIES)) - set(EDITED)))
def test_a_family_lies_as_the_real_objects_of_its_category_do(category: str, partnet_dir: Path) -> None:
    real = list(real_objects(category, partnet_dir, read_split(SPLIT), "dev"))
    family = Frame.of(make(category, seed) for seed in range(_OBJECTS))
    assert differences(family, Frame.of(real)) == []


def turned(obj: ArticulatedObject, rotation: np.ndarray) -> ArticulatedObject:
    """The object in a frame that differs by a rotation."""
    joints = [
        replace(joint, axis=tuple(rotation @ joint.axis), origin=tuple(rotation @ joint.origin))
        for joint in obj.native_tree.joints
    ]
    parts = tuple(replace(part, vertices=part.vertices @ rotation.T, body=None) for part in obj.parts)
    return replace(obj, parts=parts, native_tree=KinematicTree(joints))


@pytest.mark.parametrize("category", ["laptop", "scissors", "stapler", "window"])
def test_a_family_that_is_turned_by_a_quarter_differs(category: str) -> None:
    objects = [make(category, seed) for seed in range(12)]
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    frame = Frame.of(objects)
    assert differences(frame, frame) == []
    assert differences(Frame.of(turned(obj, quarter) for obj in objects), frame)


def test_a_laptop_that_opens_the_other_way_differs() -> None:
    objects = [make("laptop", seed) for seed in range(6)]
    half = np.diag([-1.0, -1.0, 1.0])
    found = differences(Frame.of(turned(obj, half) for obj in objects), Frame.of(objects))
    assert found == ["turns y: real ones towards +, the family's the other way"]


def test_a_joints_sort_says_where_it_goes_from_rest() -> None:
    def sort(kind: str, axis: tuple[float, float, float], lower: float, upper: float, rest: float = 0.0) -> str:
        return joint_sort(Joint("j", kind, 0, axis, (0.0, 0.0, 0.0), lower, upper, rest))

    assert sort("revolute", (0, 1, 0), 0.0, 2.0) == "+turns y"
    assert sort("revolute", (0, 1, 0), -2.0, 0.0) == "-turns y"
    assert sort("revolute", (0, -1, 0), -2.0, 0.0) == "+turns y"
    assert sort("revolute", (0, 0, 1), -0.6, 0.0, -0.6) == "+turns z"
    assert sort("revolute", (0, 0, 1), -1.0, 1.0) == "turns z"
    assert sort("continuous", (1, 0, 0), -np.inf, np.inf) == "turns x"
    assert sort("prismatic", (-1, 0, 0), 0.0, 0.3) == "-slides x"
    assert sort("revolute", (0.6, 0.8, 0), 0.0, 1.0) == "turns oblique"


def fridge(path: Path, size: float = 1.0, turns: tuple[str, ...] = (), span: str = "1.9") -> Path:
    """URDF file of a body and a door at -X; each turn is a fixed joint above all that there was."""
    shapes = {"body": ("0 0 0", 0.5 * size), "door": (f"0 {-0.3 * size} 0", 0.02 * size)}
    links = [
        f'<link name="{name}"><visual><origin xyz="{at}"/><geometry>'
        f'<box size="{depth} {0.6 * size} {1.6 * size}"/></geometry></visual></link>'
        for name, (at, depth) in shapes.items()
    ]
    links.append(
        '<joint name="hinge" type="revolute"><parent link="body"/><child link="door"/><axis xyz="0 0 -1"/>'
        f'<origin xyz="{-0.26 * size} {0.3 * size} 0"/><limit lower="0" upper="{span}"/></joint>'
    )
    below = "body"
    for n, turn in enumerate(turns):
        links.append(
            f'<link name="above{n}"/><joint name="turn{n}" type="fixed"><parent link="above{n}"/>'
            f'<child link="{below}"/>{turn}</joint>'
        )
        below = f"above{n}"
    path.write_text(f'<robot name="fridge">{"".join(links)}</robot>')
    return path


def doubts_of(files: list[Path]) -> dict[str, str]:
    return dict(doubts([load(file) for file in files], [file.stem for file in files]))


@pytest.mark.parametrize("yaw", [90, 180, -90])
def test_an_object_that_faces_elsewhere_is_named_and_its_fix_mends_it(yaw: int, tmp_path: Path) -> None:
    others = [fridge(tmp_path / f"{n}.urdf", 1.0 + 0.1 * n) for n in range(3)]
    assert doubts_of(others) == doubts_of([]) == {}
    wrong = f'<origin rpy="0 0 {np.deg2rad(yaw)}"/>'
    found = doubts_of([*others, fridge(tmp_path / "turned.urdf", turns=(wrong,))])
    assert list(found) == ["turned"]
    fix = found["turned"][found["turned"].index("<origin") :]
    mended = fridge(tmp_path / "mended.urdf", turns=(wrong, fix))
    assert doubts_of([*others, mended]) == {}
    np.testing.assert_allclose(load(mended).box_center, load(fridge(tmp_path / "right.urdf")).box_center, atol=1e-3)


def test_files_that_all_face_backwards_lie_down_are_in_millimetres_or_in_degrees_are_named(tmp_path: Path) -> None:
    back = '<origin rpy="0 0 3.14159265"/>'
    assert "towards +X" in doubts_of([fridge(tmp_path / f"{n}.urdf", 1 + n / 9, (back,)) for n in range(3)])["all"]
    right = [fridge(tmp_path / f"{n}.urdf", 1 + n / 9) for n in range(3)]
    lying = fridge(tmp_path / "lying.urdf", turns=('<origin rpy="0 1.57079633 0"/>',))
    assert "upright" in doubts_of([*right, lying])["lying"]
    assert "millimetres" in doubts_of([*right, fridge(tmp_path / "large.urdf", 1000.0)])["large"]
    assert "radians" in doubts_of([*right, fridge(tmp_path / "degrees.urdf", span="110")])["degrees"]
    assert "nothing moves" in doubts_of([*right, fridge(tmp_path / "stiff.urdf", span="0")])["stiff"]


@pytest.mark.slow
@pytest.mark.parametrize("category", ["laptop", "dishwasher", "refrigerator", "box"])
def test_real_objects_are_not_doubted(category: str, partnet_dir: Path) -> None:
    real = list(real_objects(category, partnet_dir, read_split(SPLIT), "dev"))
    assert list(doubts(real, [obj.object_id for obj in real])) == []
