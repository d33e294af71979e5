"""Procedural objects as files: they say what the object is, and read back as the same object."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from artsim.checks.strict_urdf import strict_kinematics, strict_urdf
from artsim.errors import AssetError, ConfigError
from artsim.export import export
from artsim.families import FAMILIES, make
from artsim.loading.urdf import load
from artsim.making.assembly import Assembly, revolute
from artsim.making.solids import box
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.objects import ArticulatedObject
from tests.conftest import ASSETS, valve

rng = np.random.default_rng(0)


def states(obj: ArticulatedObject, count: int = 5) -> Array:
    """Random states within limits; half a turn where there are none."""
    limits = np.where(np.isfinite(obj.tree.limits), obj.tree.limits, [-np.pi, np.pi])
    return obj.tree.complete_state(rng.uniform(limits[:, 0], limits[:, 1], (count, len(obj))))


def assert_same(loaded: ArticulatedObject, obj: ArticulatedObject) -> None:
    """Two objects are the same but for rounding."""
    assert loaded.repairs == ()
    assert (loaded.category, loaded.object_id) == (obj.category, obj.object_id)
    assert [(p.name, p.label) for p in loaded.parts] == [(p.name, p.label) for p in obj.parts]
    assert loaded.tree.types == obj.tree.types
    np.testing.assert_array_equal(loaded.tree.parents, obj.tree.parents)
    np.testing.assert_array_equal(loaded.tree.rest, 0.0)
    np.testing.assert_allclose(loaded.tree.axes, obj.tree.axes, atol=1e-12)
    np.testing.assert_allclose(loaded.tree.origins, obj.tree.origins, atol=1e-9)
    np.testing.assert_allclose(loaded.tree.limits, obj.tree.limits, atol=1e-12)
    np.testing.assert_allclose(loaded.part_bounds, obj.part_bounds, atol=1e-8)
    q = states(obj)
    np.testing.assert_allclose(loaded.tree.forward_kinematics(q), obj.tree.forward_kinematics(q), atol=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("category", FAMILIES)
def test_every_family_is_written_strictly_and_reads_back_as_it_was(category: str, tmp_path: Path) -> None:
    for seed in (0, 11):
        obj = make(category, seed)
        folder = tmp_path / str(seed)
        export(obj, folder)
        assert strict_urdf(folder) == []
        assert strict_kinematics(obj) == []
        loaded = load(folder)
        assert_same(loaded, obj)
        assert strict_kinematics(loaded) == []


def test_an_object_exports_itself(tmp_path: Path) -> None:
    obj = make("globe", 1)
    assert obj.export(tmp_path / "one") == export(obj, tmp_path / "other")
    assert (tmp_path / "one" / "mobility.urdf").read_bytes() == (tmp_path / "other" / "mobility.urdf").read_bytes()
    assert_same(load(tmp_path / "one"), obj)


def test_all_joint_types_and_the_order_of_parts_survive(tmp_path: Path) -> None:
    obj = valve()
    export(obj, tmp_path / "3")
    assert strict_urdf(tmp_path / "3") == []
    loaded = load(tmp_path / "3")
    assert_same(loaded, obj)
    assert loaded.tree.joints[2].pitch == pytest.approx(0.002)
    mimic = loaded.tree.joints[4].mimic
    assert mimic is not None
    assert (mimic.source, mimic.multiplier) == (2, pytest.approx(0.005))


def test_a_scaled_object_is_written_at_its_size(tmp_path: Path) -> None:
    obj = valve().scaled(0.5)
    export(obj, tmp_path / "3")
    assert_same(load(tmp_path / "3"), obj)


def test_a_closed_laptop_stays_as_it_is_whatever_rule_its_category_has(tmp_path: Path) -> None:
    """Rest states of PartNet's laptops are found from geometry; ours are known."""
    assembly = Assembly()
    assembly.add("base", box((-0.1, -0.1, 0), (0.1, 0.1, 0.02)))
    lid = box((-0.1, -0.1, 0.03), (0.1, 0.1, 0.04)).turned((0, 1, 0), 0.2, (0.1, 0, 0.03))  # not shut at its zero
    assembly.add("lid", lid, revolute("base", (0, 1, 0), (0.1, 0, 0.03), -0.2, 1.5))
    export(assembly.build("laptop", "5"), tmp_path / "5")
    assert load(tmp_path / "5").tree.rest[1] == 0.0
    meta = json.loads((tmp_path / "5" / "meta.json").read_text())
    del meta["artsim"]
    (tmp_path / "5" / "meta.json").write_text(json.dumps(meta))
    assert load(tmp_path / "5").tree.rest[1] == pytest.approx(-0.2, abs=0.01)


@pytest.mark.parametrize("parts", [["pipe"], ["arm", "pipe", "cap", "knob_2", "knob_1"], ["pipe", "pipe"], "pipe", [3]])
def test_a_list_of_parts_that_does_not_fit_is_not_believed(parts: object, tmp_path: Path) -> None:
    export(valve(), tmp_path / "3")
    meta = json.loads((tmp_path / "3" / "meta.json").read_text())
    meta["artsim"]["parts"] = parts
    (tmp_path / "3" / "meta.json").write_text(json.dumps(meta))
    loaded = load(tmp_path / "3")
    assert [p.name for p in loaded.parts] == ["pipe", "arm", "knob_2", "knob_1", "cap"]
    assert bool(loaded.repairs) == isinstance(parts, list)


def test_what_cannot_be_exported_says_why(tmp_path: Path) -> None:
    obj = valve()
    with pytest.raises(ConfigError, match="step"):
        export(obj, tmp_path, ["step"])
    with pytest.raises(AssetError, match="two words"):
        export(replace(obj, parts=(replace(obj.parts[0], label="two words"), *obj.parts[1:])), tmp_path)
    with pytest.raises(AssetError, match="no body"):
        export(load(ASSETS / "cabinet"), tmp_path)
    ajar = KinematicTree([obj.tree.joints[0], replace(obj.tree.joints[1], rest=0.5), *obj.tree.joints[2:]])
    with pytest.raises(AssetError, match="not at rest"):
        export(replace(obj, native_tree=ajar), tmp_path)
    assert not any(tmp_path.iterdir())
