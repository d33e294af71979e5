"""Procedural objects: new each time, the same for the same seed, and ready for a simulator."""

from __future__ import annotations

import re
import tempfile
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim.checks.realism import REAL
from artsim.checks.validity import check, check_file
from artsim.errors import ConfigError
from artsim.export import export
from artsim.families import FAMILIES, PARTNET_MOBILITY, make
from artsim.loading.sources import FamilySource

CATEGORIES = sorted(FAMILIES)


def failed_gates(source: FamilySource) -> dict[str, tuple[str, ...]]:
    """Problems of an object and its exported file, by gate."""
    obj = source.load()
    with tempfile.TemporaryDirectory() as folder:
        export(obj, Path(folder))
        return {gate.name: gate.problems for gate in check_file(obj, Path(folder)) if not gate.passed}


@pytest.fixture(scope="session")
def outcomes() -> dict[str, dict[str, tuple[str, ...]]]:
    """Of two objects of each category, the gates that they fail; ``make audit`` takes 10,000."""
    sources = [FamilySource(category, seed) for category in CATEGORIES for seed in range(2)]
    with ProcessPoolExecutor(2, get_context("spawn")) as team:
        failed = team.map(failed_gates, sources, chunksize=16)
        return {source.name: gates for source, gates in zip(sources, failed, strict=True)}


def test_there_are_at_least_26_categories() -> None:
    assert len(FAMILIES) >= 26


@pytest.mark.slow
@pytest.mark.parametrize("gate", ["strict URDF", "kinematics", "inertia", "watertight", "convex collision geometry"])
def test_every_object_passes(gate: str, outcomes: dict[str, dict[str, tuple[str, ...]]]) -> None:
    assert [(name, failed[gate]) for name, failed in outcomes.items() if gate in failed] == []


@pytest.mark.slow
@pytest.mark.parametrize("gate", ["collision free", "joined parts apart"])
def test_hardly_any_object_runs_into_itself(gate: str, outcomes: dict[str, dict[str, tuple[str, ...]]]) -> None:
    failed = [(name, failed[gate]) for name, failed in outcomes.items() if gate in failed]
    assert len(failed) <= 0.01 * len(outcomes), failed


@pytest.mark.parametrize("category", CATEGORIES)
def test_the_seed_decides_everything(category: str) -> None:
    digests = [make(category, seed).sha256 for seed in (0, 1, 2, 0)]
    assert digests[0] == digests[3]
    assert len(set(digests)) == 3


@pytest.mark.parametrize("category", CATEGORIES)
def test_objects_stand_in_their_rest_frame(category: str) -> None:
    obj = make(category, 5)
    np.testing.assert_allclose(obj.bounds.mean(axis=0), 0.0, atol=1e-9)
    assert (obj.tree.rest == 0).all()
    assert 0.01 < obj.diagonal < 10.0  # metres, as things are
    assert len({part.name for part in obj.parts}) == len(obj)
    assert all(re.fullmatch(r"[a-z]+(_[a-z0-9]+)*", part.name) for part in obj.parts)
    assert len(obj.tree.free_joints) >= 1


def test_each_of_the_46_categories_of_partnet_mobility_has_a_family() -> None:
    assert len(PARTNET_MOBILITY) == 46
    assert all(PARTNET_MOBILITY.values())
    assert {
        name: set(names) - set(FAMILIES) for name, names in PARTNET_MOBILITY.items() if set(names) - set(FAMILIES)
    } == {}
    assert {folder for source in REAL.values() for folder in source.folders} <= set(PARTNET_MOBILITY)


@pytest.mark.parametrize("seed", [2750, 4487])
def test_the_narrowest_tables_have_room_for_drawers(seed: int) -> None:
    obj = make("drawer", seed)
    assert [str(gate) for gate in check(obj) if not gate.passed] == []
    assert (obj.box_size[1:].min(axis=1) > 0.02).all()


@pytest.mark.slow
def test_topology_varies_as_well_as_size() -> None:
    objects = {category: [make(category, seed) for seed in range(5)] for category in CATEGORIES}
    assert sum(len({len(obj) for obj in own}) > 1 for own in objects.values()) >= 12
    trees = [obj.tree for own in objects.values() for obj in own]
    assert {"revolute", "prismatic", "continuous", "screw"} <= {kind for tree in trees for kind in tree.types}
    assert any(joint.mimic for tree in trees for joint in tree.joints)


def test_unknown_categories_and_seeds_are_refused() -> None:
    with pytest.raises(ConfigError, match=r"no category 'lapptop'.*laptop"):
        make("lapptop")
    with pytest.raises(ConfigError, match="negative"):
        make("laptop", -1)


@pytest.mark.slow
def test_a_dataset_of_made_objects_is_sound(tmp_path: Path) -> None:
    from artsim.datasets.verify import verify
    from artsim.loading.sources import family_sources

    sources = family_sources(["drawer", "scissors"], 3)
    artsim.generate(sources, tmp_path / "out", num_samples=60, shard_size=20, progress=False)
    assert verify(tmp_path / "out") == []
    dataset = artsim.open_dataset(tmp_path / "out")
    assert {o.source for o in dataset.plan.objects} == {source.name for source in sources}
