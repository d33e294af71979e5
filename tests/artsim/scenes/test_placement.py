"""Things stand steadily and keep their distance."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from artsim import make
from artsim.making.solids import box
from artsim.model.appearance import Material, plain_coat
from artsim.renderers.scene import Thing, rigid_object
from artsim.scenes.placement import Area, Arrangement, are_apart, resting_rotation
from artsim.scenes.props import place_solid

pytestmark = pytest.mark.slow

GREY = Material((0.5, 0.5, 0.5), specular=0.0)


def block(size: tuple[float, float, float], center: tuple[float, float, float]) -> Thing:
    half, middle = np.array(size) / 2, np.array(center)
    return place_solid("block", box(middle - half, middle + half), GREY)


def test_upright_things_stand_and_pencils_lie() -> None:
    for category in ("refrigerator", "storage_furniture", "laptop", "stapler", "kitchen_pot"):
        assert np.array_equal(resting_rotation(make(category, 0)), np.eye(3))
    assert resting_rotation(make("scissors", 0))[2, 2] > 0.999  # flat, but for the thickness of one blade
    pencil = trimesh.creation.cylinder(0.003, 0.15, sections=12)
    lying = resting_rotation(rigid_object("pencil", (np.asarray(pencil.vertices), np.asarray(pencil.faces, np.int32))))
    assert abs(lying[2, 2]) < 1e-6
    cone = trimesh.creation.cone(0.05, 0.1)
    cone.apply_transform(trimesh.transformations.rotation_matrix(np.pi, [1, 0, 0]))
    turned = resting_rotation(rigid_object("cone", (np.asarray(cone.vertices), np.asarray(cone.faces, np.int32))))
    assert turned[2, 2] != 1.0


@pytest.mark.parametrize(("gap", "free"), [(0.0039, False), (0.0041, True)])
def test_things_keep_their_distance(gap: float, free: bool) -> None:
    one = block((0.2, 0.2, 0.2), (0.0, 0.0, 0.1))
    turn = trimesh.transformations.rotation_matrix(np.pi / 4, [0, 0, 1])
    turn[0, 3] = 0.1 + gap + 0.1 * np.sqrt(2.0)
    assert are_apart(one, place_solid("block", box((-0.1, -0.1, 0.0), (0.1, 0.1, 0.2)), GREY, turn)) == free


def test_boxes_that_overlap_do_not_matter_where_surfaces_do_not_meet() -> None:
    frame = make("eyeglasses", 0)
    thing = Thing(frame, frame.tree.rest, np.eye(4), ())
    low, high = thing.vertices.min(axis=0), thing.vertices.max(axis=0)
    between = block((0.01, 0.01, 0.01), tuple(0.5 * (low + high) + [0.02, 0.0, 0.0]))  # type: ignore[arg-type]
    assert are_apart(thing, between)
    assert ((between.vertices > low) & (between.vertices < high)).all()


def test_no_room_is_said() -> None:
    arrangement = Arrangement(Area((-0.1, -0.1), (0.1, 0.1)))
    obj = rigid_object("slab", (np.asarray(trimesh.creation.box((0.15, 0.15, 0.1)).vertices),
                         np.asarray(trimesh.creation.box((0.15, 0.15, 0.1)).faces, np.int32)))  # fmt: skip
    coats = (plain_coat(obj.parts[0], GREY),)
    assert arrangement.put(obj, np.zeros(1), coats, np.random.default_rng(0)) is not None
    assert arrangement.put(obj, np.zeros(1), coats, np.random.default_rng(0)) is None
