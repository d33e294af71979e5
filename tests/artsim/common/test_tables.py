"""What is printed fits a screen, says what matters, and never writes to the terminal what a file wants it to."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import artsim
from artsim.common.tables import HEIGHT, WIDTH, table
from artsim.model.joints import Joint
from artsim.model.kinematics import KinematicTree
from artsim.model.objects import ArticulatedObject, Part, Repair
from artsim.observing.sample import Sample
from tests.conftest import ASSETS, valve

HOSTILE = "\x1b[2J\x1b]0;owned\x07\nrm -rf\u202e" + "x" * 300


def view(obj: ArticulatedObject, **options: Any) -> Sample:
    reach = 1.5 * obj.diagonal
    camera = artsim.Camera.look_at((-reach, 0.4 * reach, 0.6 * reach), (0, 0, 0))
    return artsim.observe(obj, obj.tree.rest, camera, num_points=500, **options)


def many_parts(count: int = 200, name: str = HOSTILE) -> ArticulatedObject:
    """A root and drawers that all lie beside each other, with names that a terminal should not see."""
    vertices = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], dtype=np.int32)
    parts = tuple(Part(name, name, vertices + [0, 0.2 * k, 0], faces) for k in range(count))
    joints = [Joint("root", "free", -1)]
    joints += [Joint(f"j{k}", "prismatic", 0, axis=(1, 0, 0), lower=0.0, upper=1e8) for k in range(1, count)]
    repairs = (Repair(name, name),) * 1000
    return ArticulatedObject(name, name, parts, KinematicTree(joints), "0" * 64, repairs=repairs, source=name)


def fits(text: str) -> None:
    lines = text.split("\n")
    assert len(lines) <= HEIGHT
    assert max(map(len, lines)) <= WIDTH
    assert all(line.isprintable() for line in lines)


@pytest.mark.parametrize(
    "obj", [artsim.make("laptop", 7), valve(), many_parts(), artsim.load(ASSETS / "cabinet")], ids=len
)
def test_objects_and_samples_fit_a_screen(obj: ArticulatedObject) -> None:
    fits(str(obj))
    fits(repr(obj))
    fits(repr(obj.parts[0]).replace(" ", "")[:WIDTH])
    assert repr(obj).count("\n") == 0
    sample = view(obj, images=("depth", "part_mask"))
    fits(str(sample))
    fits(repr(sample))


def test_an_object_says_its_parts_joints_limits_and_sizes() -> None:
    obj = artsim.load(ASSETS / "laptop")
    text = str(obj)
    assert f"{len(obj.repairs)} repairs" in text
    assert "2 parts, 1 free joint" in text
    screen = text.splitlines()[-1].split()
    low, high = np.rad2deg(obj.tree.limits[1])
    assert screen[:3] == ["1", obj.parts[1].label, "revolute"]
    assert screen[3:7] == [f"{low:.1f}", "deg", f"{high:.1f}", "deg"]
    size = [float(word) for word in screen[7:12:2]]
    np.testing.assert_allclose(size, 100 * obj.box_size[1], rtol=5e-3)
    assert screen[-1] == str(len(obj.parts[1].faces))


def test_a_slide_is_told_in_centimetres_and_a_free_turn_as_any() -> None:
    obj = valve()
    rows = dict(zip([part.name for part in obj.parts], str(obj).splitlines()[-len(obj) :], strict=True))
    assert "10.0 cm" in rows["knob_1"]
    assert "follows" in rows["knob_1"]
    assert rows["knob_2"].split()[3:5] == ["any", "any"]


def test_a_sample_says_its_view_and_what_is_seen_of_each_part() -> None:
    obj = artsim.make("laptop", 7)
    sample = view(obj, images=("depth",))
    text = str(sample)
    assert f"{np.linalg.norm(sample.T_camera_part[0][:3, 3]):.2f} m from the camera" in text
    assert "images depth\n" in text
    assert "noise none" in text
    rows = [line.split() for line in text.splitlines()[-len(obj) :]]
    assert [int(row[3]) for row in rows] == np.bincount(sample.part, minlength=len(obj)).tolist()
    assert sum(int(row[3]) for row in rows) == 500
    stored = replace(sample, seed=3, index=12)
    assert "sample 12 of seed 3" in str(stored)


def test_arrays_are_told_by_shape() -> None:
    obj = artsim.make("laptop", 7)
    frame = artsim.render(obj, obj.tree.rest, artsim.Camera.look_at((-1, 0, 1), (0, 0, 0), 64, 48))
    assert repr(frame).startswith("Frame(depth=float32 (48, 64), part_ids=uint8 (48, 64)")
    assert f"faces=int32 {obj.parts[0].faces.shape}" in repr(obj.parts[0])
    assert "array" not in repr([obj, obj.parts[0], obj.parts[0].body, frame, view(obj)])
    assert repr(artsim.Camera.look_at((-1, 0, 0.5), (0, 0, 0), 64, 48)).startswith(
        "<Camera 64 x 48, focal lengths 57.9"
    )


def test_an_object_without_any_surface_prints() -> None:
    empty = Part("a", "a", np.zeros((0, 3)), np.zeros((0, 3), np.int32))
    obj = ArticulatedObject("x", "y", (empty,), KinematicTree([Joint("root", "free", -1)]), "0" * 64)
    assert "no geometry" in str(obj)


def test_a_table_is_as_wide_as_its_cells_and_counts_what_it_leaves_out() -> None:
    lines = table([("name", "n"), ("a", "1"), ("longer", "200"), ("b", "3")], most=2)
    assert lines == ["name      n", "a         1", "longer  200", "... and 1 more"]


def test_the_version_is_that_of_the_package() -> None:
    from importlib.metadata import version

    assert artsim.__version__ == version("artsim")
