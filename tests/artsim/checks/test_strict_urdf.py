"""Strict checks name every element of a file, and every joint, that is not sound."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from artsim.checks.strict_urdf import strict_kinematics, strict_urdf
from artsim.export import export
from artsim.model.joints import Joint
from artsim.model.kinematics import KinematicTree
from tests.conftest import ASSETS, valve

Mutation = Callable[[etree._Element], object]


def _drop(path: str) -> Mutation:
    def mutate(root: etree._Element) -> None:
        element = root.find(path)
        element.getparent().remove(element)

    return mutate


def _set(path: str, **attributes: str) -> Mutation:
    return lambda root: [root.find(path).set(name, value) for name, value in attributes.items()]


@pytest.mark.parametrize(
    ("mutate", "problem"),
    [
        (_drop("link[@name='arm']/inertial"), "link 'arm': has no <inertial>"),
        (_drop("link[@name='arm']/visual"), "link 'arm': has no <visual>"),
        (_drop("link[@name='arm']/collision"), "link 'arm': has no <collision>"),
        (_set("link[@name='arm']/inertial/mass", value="0"), "link 'arm': has no mass above 0"),
        (_set("link[@name='arm']/inertial/inertia", ixx="-1"), "link 'arm': its inertia is not positive definite"),
        (_set("link[@name='arm']/inertial/inertia", ixx="nan"), "link 'arm': its inertia is not six finite numbers"),
        (_set("link[@name='arm']/inertial/inertia", ixx="5"), "possible body"),
        (_set("link[@name='arm']/visual/geometry/mesh", filename="meshes/lost.obj"), "'meshes/lost.obj' is missing"),
        (_set("link[@name='pipe']/collision/geometry/box", size="1 1 0"), "<box> has no size above 0"),
        (_set("link[@name='arm']", name="pipe"), "link 'pipe': 2 of them"),
        (_set("joint[@name='arm_joint']", name="cap_joint"), "joint 'cap_joint': 2 of them"),
        (_drop("joint[@name='arm_joint']"), "2 root links: arm, pipe"),
        (_set("joint[@name='arm_joint']/parent", link="knob_2"), "hangs on a cycle"),
        (_set("joint[@name='arm_joint']/parent", link="nobody"), "its parent 'nobody' is no link"),
        (_set("joint[@name='arm_joint']/child", link="cap"), "link 'cap': carried by 2 joints"),
        (_set("joint[@name='arm_joint']/axis", xyz="0 0 2"), "joint 'arm_joint': its axis has length 2"),
        (_drop("joint[@name='arm_joint']/axis"), "joint 'arm_joint': has no axis"),
        (_drop("joint[@name='arm_joint']/limit"), "joint 'arm_joint': has no limit"),
        (_set("joint[@name='arm_joint']/limit", effort="0"), "joint 'arm_joint': has no effort limit above 0"),
        (_set("joint[@name='arm_joint']/limit", lower="0.5"), "joint 'arm_joint': 0 is outside its limits [0.5, 2]"),
        (_set("joint[@name='arm_joint']/limit", lower="0", upper="0"), "joint 'arm_joint': its limits let it not move"),
        (_set("joint[@name='knob_2_joint']/limit", lower="0", upper="1"), "turns freely, but has position limits"),
        (_set("joint[@name='arm_joint']/origin", xyz="0 nan 0"), "not three finite numbers"),
        (_set("joint[@name='arm_joint']", type="planar"), "joint 'arm_joint': type 'planar' is not one of"),
        (_set("joint[@name='knob_1_joint']/mimic", joint="nobody"), "mimics 'nobody', which is no joint"),
        (_set("joint[@name='knob_1_joint']/mimic", joint="knob_1_joint"), "mimic relations form a loop"),
        (_drop("joint[@name='cap_slide']/mimic"), "link 'cap_thread': has no <visual>"),
    ],
)
def test_strictness_names_what_is_missing(mutate: Mutation, problem: str, tmp_path: Path) -> None:
    export(valve(), tmp_path)
    file = tmp_path / "mobility.urdf"
    tree = etree.parse(str(file))
    mutate(tree.getroot())
    tree.write(str(file))
    assert any(problem in found for found in strict_urdf(tmp_path)), strict_urdf(tmp_path)


def test_files_that_are_no_urdf_are_not_strict(tmp_path: Path) -> None:
    assert "no such file" in strict_urdf(tmp_path / "none.urdf")[0]
    (tmp_path / "a.urdf").write_text("<robot name='a'>")
    assert "not well-formed" in strict_urdf(tmp_path)[0]


def test_a_folder_in_partnets_manner_is_not_strict() -> None:
    problems = strict_urdf(ASSETS / "laptop")
    assert {"link 'base': has no <visual>", "link 'base': has no <inertial>"} <= set(problems)
    assert "joint 'joint_1': has no effort limit above 0" in problems


@pytest.mark.parametrize(
    ("joint", "problem"),
    [
        (Joint("a", "revolute", 0, lower=-np.inf, upper=np.inf), "is revolute without limits"),
        (Joint("a", "continuous", 0, lower=-1, upper=1), "turns freely, but has limits"),
        (Joint("a", "prismatic", 0, lower=0.1, upper=1, rest=0.1), "0 or its rest state is outside"),
        (Joint("a", "prismatic", 0, lower=0, upper=1, rest=2), "0 or its rest state is outside"),
        (Joint("a", "prismatic", 0), "let it not move"),
        (Joint("a", "screw", 0, lower=0, upper=1), "without a pitch"),
    ],
)
def test_strict_kinematics_names_the_joint(joint: Joint, problem: str) -> None:
    obj = valve()
    tree = KinematicTree([Joint("root", "free", -1), joint])
    problems = strict_kinematics(replace(obj, parts=obj.parts[:2], native_tree=tree))
    assert len(problems) == 1
    assert problems[0].startswith("joint 'a': ")
    assert problem in problems[0]


def test_a_follower_must_not_be_driven_beyond_its_limits() -> None:
    obj = valve()
    joints = list(obj.tree.joints)
    joints[4] = replace(joints[4], upper=0.05)
    assert strict_kinematics(obj) == []
    assert "is carried to [0, 0.1]" in strict_kinematics(replace(obj, native_tree=KinematicTree(joints)))[0]
