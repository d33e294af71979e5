"""Constraints on procedural objects: met, reproducible, and refused in plain words."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import artsim
from artsim.datasets.repair import repair
from artsim.errors import ConfigError
from artsim.families import FAMILIES, make
from artsim.families.catalogue import describe_family, parameters
from artsim.families.constraints import Constraints
from artsim.loading.sources import FamilySource, family_sources
from artsim.making.draws import Draws

CATEGORIES = sorted(FAMILIES)


@pytest.mark.parametrize("category", CATEGORIES)
def test_objects_without_constraints_are_those_of_category_and_seed_alone(category: str) -> None:
    draws = Draws(np.random.default_rng([zlib.crc32(category.encode()), 3]))
    drawn = FAMILIES[category](draws).build(category, "3")
    made = make(category, 3)
    assert made.sha256 == drawn.sha256
    assert made.source == f"{category}:3"
    assert make(category, 3, joints=(0, None)).sha256 == drawn.sha256  # the seed's own object, where it will do


@pytest.mark.parametrize("seed", range(3))
def test_furniture_has_as_many_doors_and_drawers_as_are_asked_for(seed: int) -> None:
    obj = make("storage_furniture", seed, doors=2, drawers=(1, 3))
    labels = [part.label for part in obj.parts]
    assert labels.count("door") == 2
    assert 1 <= labels.count("drawer") <= 3
    again = make("storage_furniture", seed, drawers=(1, 3), door=2)
    assert again.sha256 == obj.sha256
    assert again.source == obj.source == f"storage_furniture[door=2,drawer=1..3]:{seed}"


def test_joints_types_and_sizes_are_as_asked_for() -> None:
    obj = make("storage_furniture", 1, joint_types="revolute", joints=2, width=(0.5, 0.9))
    assert obj.tree.types[1:] == ("revolute", "revolute")
    assert 0.5 <= obj.bounds[1, 1] - obj.bounds[0, 1] <= 0.9
    both = make("storage_furniture", 1, joint_types={"revolute", "prismatic"}, height=(1.2, None))
    assert set(both.tree.types[1:]) == {"revolute", "prismatic"}
    assert both.bounds[1, 2] - both.bounds[0, 2] >= 1.2
    exact = make("laptop", 1, size=0.4)
    assert abs(exact.diagonal / 0.4 - 1) <= 0.05
    assert len(make("eyeglasses", 0, temples=2)) == 3  # temple_left, temple_right


def test_objects_of_different_seeds_differ() -> None:
    digests = {make("drawer", seed, drawers=3).sha256 for seed in range(8)}
    assert len(digests) == 8


@pytest.fixture
def few_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is not reached is given up after 30 objects."""
    monkeypatch.setattr(artsim.families, "DRAWS", 30)


@pytest.mark.slow
@pytest.mark.usefixtures("few_draws")
def test_what_a_category_does_not_reach_is_told_with_what_it_does() -> None:
    with pytest.raises(ConfigError) as refused:
        make("laptop", 0, doors=3)
    for words in ("laptop", "no object drawn has door=3", "no parameter and no part door", "Fix:", "lid"):
        assert words in str(refused.value)
    with pytest.raises(ConfigError, match=r"size 0\.\d+ to 0\.\d+ m"):
        make("laptop", 0, size=(30, 40))
    with pytest.raises(ConfigError, match=r"joints 2 \(30 times\)"):
        make("eyeglasses", 0, joints=9)


@pytest.mark.parametrize(
    ("constraints", "problem"),
    [
        ({"joints": 2.5}, "whole"),
        ({"doors": (3, 1)}, "no range"),
        ({"joints": -1}, "no range"),
        ({"doors": (1, 2, 3)}, "range"),
        ({"joints": True}, "range"),
        ({"size": "big"}, "range"),
        ({"size": float("nan")}, "no range"),
        ({"handles": 3}, "handles=True or handles=False"),
        ({"joint_types": "hinge"}, "revolute"),
        ({"joint_types": ()}, "revolute"),
        ({"Doors!": 1}, "no constraint"),
    ],
)
def test_constraints_that_make_no_sense_are_refused(constraints: dict[str, Any], problem: str) -> None:
    with pytest.raises(ConfigError, match=problem):
        make("drawer", 0, **constraints)


@pytest.mark.parametrize("text", ["doors", "doors=", "=2", "doors=two!", "doors=1..2..3", "handles=maybe"])
def test_texts_that_are_no_constraints_are_refused(text: str) -> None:
    with pytest.raises(ConfigError, match="Fix:"):
        Constraints.parse([text])


def test_a_constraint_is_named_once() -> None:
    with pytest.raises(ConfigError, match="twice"):
        Constraints.parse(["doors=1", "door=2"])


NUMBERS = st.integers(0, 99)
RANGES = st.tuples(NUMBERS, NUMBERS).map(lambda ends: tuple(sorted(ends)))
LENGTHS = st.floats(0.0, 1e3, allow_subnormal=False)
GIVEN = st.fixed_dictionaries(
    {},
    optional={
        "door": NUMBERS | RANGES,
        "crumb_tray": NUMBERS,
        "joints": RANGES,
        "size": LENGTHS,
        "width": st.tuples(LENGTHS, st.none()),
        "handles": st.booleans(),
        "joint_types": st.sets(st.sampled_from(["revolute", "prismatic", "screw"]), min_size=1),
    },
)


@given(given_=GIVEN, seed=st.integers(0, 10**18))
def test_the_name_of_a_source_says_all_that_makes_its_object(given_: dict[str, Any], seed: int) -> None:
    source = FamilySource("drawer", seed, Constraints.of(given_))
    assert FamilySource.named(source.name) == source


@pytest.mark.parametrize(
    "name", ["", "laptop", "lapdog:3", "laptop:03", "laptop[]:3", "laptop[door]:3", "laptop[b=1,a=2]:3", "laptop:-1"]
)
def test_other_names_are_of_no_procedural_object(name: str) -> None:
    assert FamilySource.named(name) is None


@pytest.mark.slow
def test_a_dataset_of_constrained_objects_is_made_again_from_its_plan(tmp_path: Path) -> None:
    sources = family_sources(["drawer"], 2, constraints=Constraints.parse(["drawers=3"]))
    artsim.generate(sources, tmp_path / "out", num_samples=4, shard_size=4, progress=False)
    assert all(len(obj.parts) == 4 for obj in (source.load() for source in sources))
    objects = sorted((tmp_path / "out" / "objects").glob("*.npz"))
    before = [path.read_bytes() for path in objects]
    for path in objects:
        path.unlink()
    assert not repair(tmp_path / "out").failed
    assert [path.read_bytes() for path in objects] == before


@pytest.mark.parametrize("category", CATEGORIES)
def test_every_family_says_what_it_is_and_what_varies(category: str) -> None:
    paragraphs = parameters(category).split("\n\n")
    assert len(paragraphs) >= 2
    text = describe_family(category, 2)
    assert paragraphs[0].split("\n")[0] in text
    objects = [make(category, seed) for seed in range(2)]
    for obj in objects:
        assert all(kind in text for kind in obj.tree.types[1:])
        assert all(part.label in text for part in obj.parts[1:])


def test_no_description_of_an_unknown_category_or_of_nothing() -> None:
    with pytest.raises(ConfigError, match="lapdog"):
        describe_family("lapdog")
    with pytest.raises(ConfigError, match="count"):
        describe_family("laptop", 0)


def feet(obj: artsim.ArticulatedObject) -> int:
    """How many separate things an object stands on: pieces of a level cut a centimetre above the floor."""
    from manifold3d import Manifold, Mesh64

    body = obj.parts[0]
    solid = Manifold(Mesh64(body.vertices, body.faces.astype(np.uint64)))
    return len(solid.slice(float(body.bounds[0, 2]) + 0.01).decompose())


@pytest.mark.parametrize("seed", range(3))
def test_furniture_stands_on_legs_and_has_handles_where_that_is_asked_for(seed: int) -> None:
    for category in ("drawer", "storage_furniture"):
        with_legs = make(category, seed, legs=True, handles=False)
        assert with_legs.features == ("legs",)
        assert feet(with_legs) >= 4
        without = make(category, seed, legs=False, handles=True)
        assert without.features == ("handles",)
    assert make("microwave", seed, handles=False).features == ()


@pytest.mark.slow
@pytest.mark.usefixtures("few_draws")
def test_handles_that_are_parts_count_as_handles() -> None:
    assert make("bucket", 0, handles=True).sha256 == make("bucket", 0).sha256
    with pytest.raises(ConfigError, match=r"handles yes \(30 times\)"):
        make("bucket", 0, handles=False)
