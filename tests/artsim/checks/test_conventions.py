"""Conventions: families lie in the frames that real objects have."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from artsim import make
from artsim.checks.conventions import Frame, differences, joint_sort
from artsim.checks.realism import REAL, read_split, real_objects
from artsim.families import CATEGORIES
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
