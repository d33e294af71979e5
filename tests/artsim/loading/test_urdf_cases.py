"""The awkward URDF files of tests/cases: each loads with the right geometry and limits and says so, or says why not."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from artsim import load
from artsim.errors import ArtsimError, AssetError
from artsim.model.draws import StateOptions, sample_state
from artsim.model.objects import ArticulatedObject
from tests.conftest import CASES, absent


def said(obj: ArticulatedObject) -> str:
    return "\n".join(map(str, obj.repairs))


@pytest.mark.parametrize(
    ("case", "kind", "repair"),
    [
        ("U01", "continuous", "without lower and upper in its limit: read as continuous"),
        ("U05", "continuous", "limits -inf and inf mean that it has no end"),
        ("U05b", "continuous", "mean that it has no end: read as continuous"),
        ("U10", "revolute", "its declaration does not come first"),
        ("U10g", "revolute", "declares version '0.0': read as version 1.0"),
        ("N_degrees/degrees.urdf", "revolute", "18.3 turns: they look like degrees"),
        ("N_scale4", "revolute", "has 4 numbers: the first three count"),
        ("U09/urdf", "revolute", "package 'my_robot' is not declared: taken to be 'U09'"),
        ("N_ros/urdf/pkg.urdf", "revolute", ""),
        ("N_ros/urdf/rel.urdf", "revolute", ""),
        ("hostile/robot_material", "revolute", ""),
        ("hostile/meta_surrogate", "revolute", "meta.json: ignored: not JSON"),
    ],
)
def test_a_case_loads_and_says_what_was_assumed(case: str, kind: str, repair: str) -> None:
    obj = load(CASES / case)
    assert obj.tree.types == ("free", kind)
    assert repair in said(obj)
    if not repair:
        assert obj.repairs == ()
    drawn = sample_state(obj, StateOptions(), np.random.default_rng(0))
    assert kind != "continuous" or abs(drawn[1]) <= np.pi  # within a turn


@pytest.mark.parametrize(
    ("case", "what", "fix"),
    [
        ("U03", "xacro file that is not expanded", "xacro {}/U03/r.urdf > {}/U03/r_expanded.urdf"),
        ("U14", "link 'b' flies free of 'a'", 'write type="fixed"'),
        ("M15", "link 'part': mesh 'm.obj' has scale='0 0 0'", 'write scale="1 1 1"'),
    ],
)
def test_a_case_is_refused_with_what_to_do(case: str, what: str, fix: str) -> None:
    with pytest.raises(AssetError) as error:
        load(CASES / case)
    assert what in str(error.value)
    assert fix.replace("{}", str(CASES)) in str(error.value)


def test_a_capsule_has_its_half_spheres_beyond_its_length() -> None:
    assert load(CASES / "U02").box_size[1] == pytest.approx([0.1, 0.1, 0.4])


def test_numbers_written_as_text_are_not_zero() -> None:
    obj = load(CASES / "U18")
    assert obj.tree.joints[1].axis == (0.0, 1.0, 0.0)
    assert np.subtract(obj.box_center[1], obj.box_center[0]) == pytest.approx([0.1, 0.0, 0.0])
    assert "<origin> has its numbers as text" in said(obj)
    assert "<axis> has its xyz as text" in said(obj)


@pytest.mark.parametrize("case", ["fixed_axis", "fuzz_urdf_091dc5a0_zero_axis__zero_axis.urdf"])
def test_what_a_joint_that_does_not_move_says_of_motion_has_no_meaning(case: str) -> None:
    assert len(load(CASES / "hostile" / case)) == 1


@pytest.mark.slow
def test_pybullets_own_robots_load_as_given() -> None:
    """Of its files, those without the thousand random ones that are alike; each failure is known by its reason."""
    spec = importlib.util.find_spec("pybullet_data")
    if spec is None or not spec.submodule_search_locations:
        absent("pybullet_data is not installed: its files are not loaded")
    folder = Path(spec.submodule_search_locations[0])
    known = {
        "biped2d_pybullet.urdf": "lower='-1.57.'",
        "humanoid.urdf": "'spherical' is not supported",
        "husky.urdf": "not expanded",
        "microtaur.urdf": "is not 3 numbers",
        "racecar_differential.urdf": "--package-root",
        "spherical_joint_limit.urdf": "'spherical' is not supported",
        "torus_deform.urdf": "has no <link>",
    }
    for file in sorted(folder.rglob("*.urdf")):
        if "random_urdfs" in file.parts or file.stat().st_size > 40_000 or "vhacd" in file.name:
            continue  # alike, or slow
        if file.name in known:
            with pytest.raises(ArtsimError) as error:
                load(file)
            assert known[file.name] in str(error.value)
        else:
            assert len(load(file))
