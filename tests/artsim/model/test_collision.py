"""Overlaps are found where they are, and measured: closed forms, and MuJoCo as the judge."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from artsim.making.assembly import Assembly, prismatic, revolute
from artsim.making.solids import Solid, box, tray
from artsim.model.collision import PENETRATION, Sweep, sweep_states
from artsim.model.objects import ArticulatedObject


def assembly(*parts: tuple[str, Solid, object]) -> ArticulatedObject:
    made = Assembly()
    for name, solid, joint in parts:
        made.add(name, solid, joint)  # type: ignore[arg-type]
    return made.build("test", "0")


def two_slides(gap: float) -> ArticulatedObject:
    """Two boxes 1 dm wide on one rail, each moved 1 dm towards the other, with a gap left at the end."""
    left, right = box((0, -0.05, 0.1), (0.1, 0.05, 0.2)), box((0.3 + gap, -0.05, 0.1), (0.4 + gap, 0.05, 0.2))
    return assembly(
        ("rail", box((-1, -0.1, 0), (1, 0.1, 0.05)), None),
        ("left", left, prismatic("rail", (1, 0, 0), 0.0, 0.1)),
        ("right", right, prismatic("rail", (-1, 0, 0), 0.0, 0.1)),
    )


def test_states_cover_rest_every_joint_and_their_combinations() -> None:
    obj = two_slides(0.0)
    states = sweep_states(obj)
    assert states.shape == (1 + 2 * 21 + 64, 3)
    np.testing.assert_array_equal(states[0], obj.tree.rest)
    low, high = obj.tree.limits.T
    assert (states >= low).all()
    assert (states <= high).all()
    assert states[1:22, 1].min() == 0.0
    assert states[1:22, 1].max() == 0.1
    assert (states[1:22, 2] == 0.0).all()


@pytest.mark.parametrize(("gap", "hits"), [(0.002, 0), (-0.05, 1)])
def test_boxes_that_meet_only_when_both_move_are_found(gap: float, hits: int) -> None:
    found = list(Sweep(two_slides(gap)).collisions())
    assert len(found) == hits
    for collision in found:
        assert collision.parts == (1, 2)
        assert (collision.state[1:] > 0.02).all()


@given(depth=st.floats(2e-6, 0.05))
@settings(max_examples=20, deadline=None)
def test_the_depth_is_the_thickness_of_the_overlap(depth: float) -> None:
    """Two unit squares overlapping by a slab of thickness d: 2 V / S = d / (1 + 2 d)."""
    obj = assembly(
        ("root", box((5, 5, 5), (6, 6, 6)), None),
        ("a", box((0, 0, 0), (1, 1, 1)), prismatic("root", (0, 0, 1), 0.0, 0.0)),
        ("b", box((0, 0, 1 - depth), (1, 1, 2)), prismatic("root", (0, 0, 1), 0.0, 0.0)),
    )
    (collision,) = Sweep(obj).collisions()
    np.testing.assert_allclose(collision.depth, depth / (1 + 2 * depth), rtol=1e-4)


def test_touching_is_no_penetration() -> None:
    obj = assembly(
        ("root", box((5, 5, 5), (6, 6, 6)), None),
        ("a", box((0, 0, 0), (1, 1, 1)), prismatic("root", (0, 0, 1), 0.0, 0.0)),
        ("b", box((0, 0, 1 - 0.5 * PENETRATION), (1, 1, 2)), prismatic("root", (0, 0, 1), 0.0, 0.0)),
    )
    assert list(Sweep(obj).collisions()) == []


def test_a_part_inside_another_is_found_though_no_surfaces_cross() -> None:
    obj = assembly(
        ("root", box((5, 5, 5), (6, 6, 6)), None),
        ("outer", box((0, 0, 0), (1, 1, 1)), prismatic("root", (0, 0, 1), 0.0, 0.1)),
        ("inner", box((0.4, 0.4, 0.4), (0.6, 0.6, 0.6)), prismatic("root", (0, 0, 1), 0.0, 0.1)),
    )
    (collision,) = Sweep(obj).collisions()
    assert collision.parts == (1, 2)


def test_joined_parts_may_overlap_a_little_and_not_much() -> None:
    def hinge(overlap: float) -> ArticulatedObject:
        lid = box((0, 0, 0.1 - overlap), (1, 1, 0.2))
        joint = revolute("base", (0, 1, 0), (1, 0, 0.1), 0.0, 1.0)
        return assembly(("base", box((0, 0, 0), (1, 1, 0.1)), None), ("lid", lid, joint))

    assert list(Sweep(hinge(0.00005)).joined_overlaps([[0.0, 0.0]])) == []  # type: ignore[arg-type]
    assert len(list(Sweep(hinge(0.005)).joined_overlaps())) == 1
    assert list(Sweep(hinge(0.005)).collisions()) == []  # they are joined


def test_an_open_surface_cannot_hide_a_collision() -> None:
    obj = two_slides(-0.05)
    holed = replace(obj.parts[1], faces=obj.parts[1].faces[:-1])
    broken = replace(obj, parts=(obj.parts[0], holed, obj.parts[2]))
    sweep = Sweep(broken)
    assert sweep.watertight.tolist() == [True, False, True]
    (collision,) = sweep.collisions()
    assert collision.depth == np.inf


@given(
    offset=st.tuples(*[st.floats(-0.25, 0.25)] * 3), angle=st.floats(-3.1, 3.1), axis=st.tuples(*[st.floats(-1, 1)] * 3)
)
@settings(max_examples=60, deadline=None)
def test_mujoco_agrees_on_convex_pieces(offset: tuple[float, ...], angle: float, axis: tuple[float, ...]) -> None:
    """A box anywhere near a tray: overlapping by volume exactly when MuJoCo reports penetration."""
    import mujoco

    direction = np.asarray(axis) + (0.0, 0.0, 1e-3)
    outer = tray((-0.2, -0.15, -0.1), (0.2, 0.15, 0.1), 0.02)
    inner = box((-0.05, -0.04, -0.03), (0.05, 0.04, 0.03)).turned(direction, angle).moved(offset)
    obj = assembly(
        ("root", box((5, 5, 5), (6, 6, 6)), None),
        ("tray", outer, prismatic("root", (0, 0, 1), 0.0, 0.0)),
        ("box", inner, prismatic("root", (0, 0, 1), 0.0, 0.0)),
    )
    spec = mujoco.MjSpec()
    for part in obj.parts[1:]:
        body = spec.worldbody.add_body(name=part.name)
        body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE)
        assert part.body is not None
        for i, (vertices, _) in enumerate(part.body.pieces):
            spec.add_mesh(name=f"{part.name}{i}", uservert=vertices.ravel())
            body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"{part.name}{i}")
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    deepest = -min((c.dist for c in data.contact), default=1.0)
    if abs(deepest) < 1e-4:  # too near to call: MuJoCo's own tolerance
        return
    assert bool(list(Sweep(obj).collisions())) == (deepest > 0)
