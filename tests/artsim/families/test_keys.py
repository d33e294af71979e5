"""Keys on flat faces, and the bodies around them."""

import numpy as np
import pytest

from artsim.families import make
from artsim.families.keys import (
    Face,
    add_key,
    front_face,
    key_cells,
    key_outline,
    sleeve,
    top_face,
)
from artsim.making.assembly import Assembly
from artsim.making.outlines import cross_sections
from artsim.making.solids import hull, loft
from artsim.model.collision import Sweep
from artsim.model.transforms import transform_points

DEVICES = ["keyboard", "mouse", "phone", "printer", "remote"]


def test_faces_look_where_they_are_said_to() -> None:
    np.testing.assert_allclose(front_face(0.0).outward, (-1, 0, 0))
    np.testing.assert_allclose(top_face(0.0).outward, (0, 0, 1))
    np.testing.assert_allclose(top_face(2.0, 3.0).at(0.5, 1.0, 0.25), (4.0, -0.5, 2.25))  # u to the right is -Y


@pytest.mark.parametrize("face", [front_face(0.0), top_face(0.0)], ids=["front", "top"])
def test_a_pressed_key_comes_close_to_its_face_and_does_not_touch_it(face: Face) -> None:
    assembly = Assembly()
    rim = face.raised(np.array([(-0.1, -0.1), (-0.1, 0.1), (0.1, -0.1), (0.1, 0.1)]), 0.0)
    assembly.add("body", hull(np.concatenate([rim, rim - 0.02 * face.outward])))
    add_key(assembly, "body", "key_0", face, (0.03, 0.02), key_outline("pill", (0.01, 0.02)), 0.004, 0.001)
    obj = assembly.build("device", "0")
    assert list(Sweep(obj).joined_overlaps()) == []

    def gap(q: float) -> float:
        posed = transform_points(obj.tree.forward_kinematics(np.array([0.0, q]))[1], obj.parts[1].vertices)
        return float((posed @ face.outward).min() - (obj.parts[0].vertices @ face.outward).max())

    assert gap(0.0) == pytest.approx(0.0013)
    assert gap(obj.tree.limits[1, 1]) == pytest.approx(0.0003)


def test_cells_go_from_the_upper_left_along_the_rows() -> None:
    cells = list(key_cells((-3.0, 3.0), (0.0, 4.0), 3, 2))
    assert cells[0] == (-2.0, 3.0)
    assert cells[2] == (2.0, 3.0)
    assert cells[-1] == (2.0, 1.0)


def test_a_sleeve_is_a_box_less_its_hole_and_its_round_edges() -> None:
    solid = sleeve((0, -2, -1), (5, 2, 1), (-1.2, -0.4), (1.2, 0.4), 0.5, steps=16)
    vertices, faces = solid.union()
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    volume = np.einsum("fi,fi->", a, np.cross(b, c)) / 6.0
    assert volume == pytest.approx(5 * (4 * 2 - (4 - np.pi) * 0.25 - 2.4 * 0.8), rel=1e-3)


def test_cross_sections_have_the_widths_and_depths_that_are_asked_for() -> None:
    body = loft(cross_sections([0.0, 1.0, 2.0], [0.0, -0.1, 0.0], 0.5, [1.0, 2.0, 1.0], 0.5))
    np.testing.assert_allclose(body.bounds(), [(-0.1, -2.0, 0.0), (0.5, 2.0, 2.0)])


@pytest.mark.parametrize("category", DEVICES)
def test_keys_are_up_at_rest_and_travel_a_little_towards_their_part(category: str) -> None:
    seen = 0
    for seed in range(8):
        obj = make(category, seed)
        for k in obj.tree.free_joints:
            joint = obj.tree.joints[k]
            if joint.type != "prismatic" or not obj.parts[k].label.endswith(("key", "keys", "button")):
                continue
            seen += 1
            assert joint.lower == 0.0
            assert 1e-4 < joint.upper < 8e-3
            # The key's part lies further along the way that the key travels.
            parent = obj.parts[joint.parent].vertices @ joint.axis
            assert parent.max() > (obj.parts[k].vertices @ joint.axis).max() + joint.upper
    assert seen > 0
