"""Realism: distances between objects, and what is said of a category from them."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim.checks.realism import (
    MEASURES,
    REAL,
    Realism,
    distances,
    draw_split,
    likeness,
    pair_distances,
    read_split,
    real_objects,
)
from artsim.errors import AssetError
from artsim.making.assembly import Assembly, JointSpec, prismatic, revolute
from artsim.making.solids import Solid, box
from artsim.model.objects import ArticulatedObject
from tests.conftest import ROOT

pytestmark = pytest.mark.slow

SPLIT = ROOT / "benchmarks" / "splits" / "partnet_dev.json"
SURFACE, PARTS, BOXES, JOINTS, RANGES = range(5)

BODY = box((0, 0, 0), (0.4, 0.6, 0.3))
DOOR = box((-0.03, 0, 0), (-0.01, 0.6, 0.3))


def cabinet(joint: JointSpec | None, body: Solid = BODY, door: Solid = DOOR, size: float = 1.0) -> ArticulatedObject:
    """A block with a plate before it; the block alone without a joint."""
    assembly = Assembly()
    assembly.add("body", body.scaled([size] * 3), density=500.0)
    if joint is not None:
        assembly.add("door", door.scaled([size] * 3), joint, density=500.0)
    return assembly.build("cabinet", "0")


def hinge(y: float = 0.0, tilt: float = 0.0, upper: float = 1.5, sign: float = 1.0) -> JointSpec:
    axis = (0.0, sign * np.sin(tilt), sign * np.cos(tilt))
    return revolute("body", axis, (-0.02, y, 0.15), *((0.0, upper) if sign > 0 else (-upper, 0.0)))


def compare(a: ArticulatedObject, b: ArticulatedObject) -> np.ndarray:
    """Distances; the same in both directions."""
    there, back = distances(likeness(a), likeness(b)), distances(likeness(b), likeness(a))
    assert there == pytest.approx(back, abs=1e-12)
    return there


def test_an_object_is_at_no_distance_from_itself() -> None:
    obj = artsim.make("drawer", 3)
    assert compare(obj, obj) == pytest.approx(np.zeros(5), abs=1e-12)


def test_size_does_not_count() -> None:
    small = revolute("body", (0, 0, 1), (-0.0002, 0, 0.0015), 0.0, 1.5)
    found = compare(cabinet(hinge()), cabinet(small, size=0.01))
    assert found == pytest.approx(np.zeros(5), abs=1e-6)


def test_surfaces_lie_as_far_apart_as_they_are() -> None:
    other = compare(cabinet(None), cabinet(None, box((0, 0, 0), (0.4, 0.6, 0.06))))
    low, high = np.array([0.4, 0.6, 0.3]), np.array([0.4, 0.6, 0.06])
    low, high = low / np.linalg.norm(low), high / np.linalg.norm(high)
    assert other[BOXES] == pytest.approx(np.linalg.norm(low - high), abs=1e-9)
    assert 0.02 < other[SURFACE] < np.linalg.norm(low - high)
    assert other[PARTS] == pytest.approx(other[SURFACE], rel=0.1)
    assert other[JOINTS] == other[RANGES] == 0.0


def test_inner_surfaces_do_not_count() -> None:
    inside = box((0.1, 0.2, 0.1), (0.3, 0.4, 0.2)).union()
    plain = cabinet(None)
    part = plain.parts[0]
    center = 0.5 * np.array([0.4, 0.6, 0.3])
    vertices = np.concatenate([part.vertices, inside[0] - center])
    faces = np.concatenate([part.faces, inside[1] + len(part.vertices)])
    filled = ArticulatedObject(
        "0", "cabinet", (type(part)("body", "body", vertices, faces),), plain.native_tree, sha256="0" * 64
    )
    assert compare(plain, filled) == pytest.approx(np.zeros(5), abs=1e-9)


def test_joints_are_compared_by_axis_and_place() -> None:
    diagonal = cabinet(hinge()).diagonal
    moved = compare(cabinet(hinge()), cabinet(hinge(y=0.1)))
    assert moved[JOINTS] == pytest.approx(0.1 / diagonal, abs=1e-9)
    assert moved[RANGES] == 0.0
    tilted = compare(cabinet(hinge()), cabinet(hinge(tilt=0.2)))
    assert tilted[JOINTS] > 0.5 * 0.2 - 1e-9
    wider = compare(cabinet(hinge(upper=1.5)), cabinet(hinge(upper=2.0)))
    assert wider[RANGES] == pytest.approx(0.5 * 0.5)
    assert wider[JOINTS] == pytest.approx(0.0, abs=1e-9)


def test_an_axis_the_other_way_round_is_the_same_joint() -> None:
    found = compare(cabinet(hinge()), cabinet(hinge(sign=-1.0)))
    assert found[JOINTS] == pytest.approx(0.0, abs=1e-9)
    assert found[RANGES] == pytest.approx(0.0, abs=1e-9)


def test_a_sliding_door_is_not_a_hinged_one_nor_none() -> None:
    slide = prismatic("body", (0, 1, 0), 0.0, 0.3)
    for other in (cabinet(slide), cabinet(None)):
        found = compare(cabinet(hinge()), other)
        assert found[JOINTS] == found[RANGES] == 1.0
    assert compare(cabinet(hinge()), cabinet(None))[BOXES] > 0.3  # as far as the door is large


def test_parts_are_matched_whatever_their_order() -> None:
    shelves = {"left": (0.0, 0.28), "right": (0.3, 0.6)}
    objects = []
    for names in (("left", "right"), ("right", "left")):
        assembly = Assembly()
        assembly.add("body", BODY, density=500.0)
        for name in names:
            y0, y1 = shelves[name]
            joint = prismatic("body", (-1, 0, 0), 0.0, 0.1 if name == "left" else 0.3)
            assembly.add(name, box((-0.03, y0, 0), (-0.01, y1, 0.3)), joint, density=500.0)
        objects.append(assembly.build("cabinet", "0"))
    found = compare(*objects)
    assert found[[BOXES, JOINTS, RANGES]] == pytest.approx(np.zeros(3), abs=1e-12)
    assert found[PARTS] < 0.01


def test_what_is_said_of_a_category() -> None:
    to_real = np.empty((3, 2, 5))
    to_real[:] = np.array([[1.0, 4.0], [2.0, 3.0], [0.5, 2.5]])[:, :, None]
    realism = Realism(to_real, np.full((1, 5), 2.0))
    assert realism.coverage == pytest.approx([0.5] * 5)  # the second real object is nobody's nearest
    assert realism.minimum_matching_distance == pytest.approx([1.5] * 5)
    assert realism.near.tolist() == [[True] * 5, [False] * 5]
    assert realism.near_at_once.tolist() == [True, False]


def test_near_by_every_measure_need_not_be_near_at_once() -> None:
    to_real = np.zeros((2, 1, 5))
    to_real[0, 0, BOXES] = to_real[1, 0, RANGES] = 3.0
    realism = Realism(to_real, np.ones((1, 5)))
    assert realism.near.all()
    assert not realism.near_at_once.any()


def test_without_a_pair_of_real_objects_nothing_is_near() -> None:
    realism = Realism(np.zeros((1, 1, 5)), pair_distances([likeness(cabinet(None))]))
    assert np.isnan(realism.yardstick).all()
    assert not realism.near.any()


def test_the_split_is_frozen(partnet_dir: Path) -> None:
    split = read_split(SPLIT)
    assert split == draw_split(partnet_dir)
    for category, halves in split.items():
        dev, test = set(halves["dev"]), set(halves["test"])
        assert not dev & test, category
        total = len(dev) + len(test)
        assert len(test) == (1 if total == 2 else round(total / 3))


def test_another_file_in_place_of_a_split_one_is_refused(tmp_path: Path) -> None:
    folder = tmp_path / "Laptop" / "1"
    folder.mkdir(parents=True)
    split = {"Laptop": {"dev": {"1": "0" * 64}, "test": {}}}
    with pytest.raises(AssetError, match="missing"):
        list(real_objects("laptop", tmp_path, split, "dev"))
    (folder / "mobility.urdf").write_text("<robot/>")
    with pytest.raises(AssetError, match="differs"):
        list(real_objects("laptop", tmp_path, split, "dev"))


def test_real_objects_of_a_category_move_as_it_says(partnet_dir: Path) -> None:
    split = json.loads(SPLIT.read_text())
    for category in ("drawer", "cutter", "folding_knife"):
        found = list(real_objects(category, partnet_dir, split, "dev"))
        assert found
        for obj in found:
            assert set(obj.tree.types[1:]) <= set(REAL[category].moves), obj.object_id


def test_every_real_laptop_has_a_procedural_neighbour(partnet_dir: Path) -> None:
    real = [likeness(obj) for obj in real_objects("laptop", partnet_dir, read_split(SPLIT), "dev")]
    made = [likeness(artsim.make("laptop", seed)) for seed in range(100)]
    to_real = np.array([[distances(a, b) for b in real] for a in made])
    near = Realism(to_real, pair_distances(real)).near
    assert near.mean() > 0.93, dict(zip(MEASURES, near.mean(axis=0), strict=True))
