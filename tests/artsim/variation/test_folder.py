"""Folders of variations: they load as what was made, resume, and say how each came about."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import artsim
from artsim.checks.validity import check_file
from artsim.errors import AssetError, ConfigError
from artsim.export import export
from artsim.families import make
from artsim.loading.urdf import load
from artsim.variation.folder import describe_variation, load_with_bodies, write_variation, write_variations
from artsim.variation.search import draw_variation
from artsim.variation.standard import Standard
from tests.conftest import ASSETS

LOADED = [
    "laptop", "cabinet", "eyeglasses", "dishwasher", "scissors", "quirks/chain", "quirks/mimic_pair", "quirks/limits",
    "quirks/screw_helper", "quirks/screw_mimic", "quirks/range_excludes_zero", "quirks/continuous_knob",
]  # fmt: skip


def content(folder: Path) -> dict[str, bytes]:
    return {p.relative_to(folder).as_posix(): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}


@pytest.mark.parametrize("name", LOADED)
def test_a_variation_is_loaded_as_it_was_made(name: str, tmp_path: Path) -> None:
    variation = draw_variation(load(ASSETS / name), 1)
    write_variation(variation, tmp_path, ["urdf"], describe_variation(variation, {}, 1))
    same_motion(variation.obj, load(tmp_path))


def test_a_variation_of_a_real_object_is_loaded_as_it_was_made(partnet_dir: Path, tmp_path: Path) -> None:
    for number, name in enumerate(("Laptop", "StorageFurniture", "Oven")):
        folder = sorted((partnet_dir / name).iterdir())[0]
        variation = draw_variation(load(folder), number)
        write_variation(variation, tmp_path / name, ["urdf"], describe_variation(variation, {}, number))
        same_motion(variation.obj, load(tmp_path / name))


def same_motion(made: artsim.ArticulatedObject, loaded: artsim.ArticulatedObject) -> None:
    """Same category, parts and shapes, and the same poses over the range of every joint."""
    assert loaded.category == made.category
    assert len(loaded) == len(made)
    assert loaded.tree.types == made.tree.types
    assert (loaded.tree.rest == 0).all()
    np.testing.assert_allclose(loaded.box_size, made.box_size, atol=1e-6)
    for one, two in zip(made.parts, loaded.parts, strict=True):
        assert len(one.faces) == len(two.faces)
    low, high = np.clip(loaded.tree.limits, -2.0, 2.0).T
    for share in np.linspace(0, 1, 5):
        q = loaded.tree.complete_state(low + share * (high - low))
        np.testing.assert_allclose(
            loaded.tree.forward_kinematics(q), made.tree.forward_kinematics(q + made.tree.rest), atol=1e-5
        )


@pytest.mark.parametrize(("category", "seed"), [("drawer", 1), ("valve", 0), ("robot_arm", 2)])
def test_variations_of_our_own_exports_stay_ready_for_simulators(category: str, seed: int, tmp_path: Path) -> None:
    obj = make(category, seed)
    export(obj, tmp_path / "object")
    loaded, gates = load_with_bodies(tmp_path / "object")
    assert set(gates) == {"strict URDF", "convex collision geometry", "inertia"}
    for part, its in zip(obj.parts, loaded.parts, strict=True):
        assert part.body is not None
        assert its.body is not None
        assert len(its.body.pieces) == len(part.body.pieces)
        assert its.body.density == pytest.approx(part.body.density, rel=1e-4)
    write_variations(tmp_path / "object", tmp_path / "out", 3, progress=False)
    for number in range(3):
        folder = tmp_path / "out" / str(number)
        assert [str(gate) for gate in check_file(load(folder), folder) if not gate.passed] == []


@pytest.mark.slow
def test_files_pass_what_the_original_passes_and_say_how_they_were_made(partnet_dir: Path, tmp_path: Path) -> None:
    folder = sorted((partnet_dir / "StorageFurniture").iterdir())[1]
    summary = write_variations(folder, tmp_path, 4, 7, [partnet_dir / "StorageFurniture"], progress=False)
    assert (len(summary.notes), summary.made, summary.failed) == (4, 4, [])
    standard, original = Standard.of(load(folder)), load(folder)
    trees = set()
    for number in range(7, 11):
        loaded = load(tmp_path / str(number))
        assert standard.failed(loaded) == []
        assert loaded.category == "storage_furniture"
        trees.add(loaded.tree)
        notes = json.loads((tmp_path / str(number) / "meta.json").read_text())["variation"]
        assert notes["of"]["sha256"] == original.sha256
        assert notes["seed"] == number
        for step in notes["operations"]:
            assert step["operation"] in ("leave out", "exchange", "stretch", "limits", "axes")
            assert len(step) > 1
    assert len(trees) == len(summary.trees) == 4
    assert str(partnet_dir) not in (tmp_path / "7" / "meta.json").read_text()


def test_a_run_goes_on_where_it_stopped(tmp_path: Path) -> None:
    source = ASSETS / "laptop"
    write_variations(source, tmp_path / "one", 3, progress=False)
    write_variations(source, tmp_path / "two", 2, progress=False)
    kept = (tmp_path / "two/0/mobility.urdf").stat().st_mtime_ns
    (tmp_path / "two" / ".2.99.part").mkdir()
    (tmp_path / "two/1/meta.json").write_text("{")
    summary = write_variations(source, tmp_path / "two", 3, progress=False)
    assert (len(summary.notes), summary.made) == (3, 2)
    assert (tmp_path / "two/0/mobility.urdf").stat().st_mtime_ns == kept
    assert content(tmp_path / "one") == content(tmp_path / "two")
    other = write_variations(ASSETS / "scissors", tmp_path / "two", 3, progress=False)
    assert other.made == 3
    assert load(tmp_path / "two/0").category != "laptop"
    for words in ("passed at the first draw", "different trees", "operation: stretch", "gates: kinematics"):
        assert words in str(summary)


@pytest.mark.parametrize(
    ("more", "problem"),
    [
        ({"count": 0}, "count"),
        ({"seed": -1}, "seed"),
        ({"formats": ["step"]}, "step"),
        ({"others": [ASSETS / "scissors"]}, "none of 1 object is another laptop"),
        ({"path": ASSETS / "quirks/zero_axis"}, "no joint can move"),
        ({"path": ASSETS / "nowhere"}, "no such file"),
    ],
)
def test_runs_that_make_no_sense_are_refused(more: dict[str, object], problem: str, tmp_path: Path) -> None:
    options: dict[str, object] = {"path": ASSETS / "laptop", "out": tmp_path / "out", "count": 1, **more}
    with pytest.raises((AssetError, ConfigError), match=problem):
        write_variations(**options)  # type: ignore[arg-type]
    assert not (tmp_path / "out").exists()


def test_variations_of_a_procedural_object_are_made_of_other_parameters(tmp_path: Path) -> None:
    first, second = make("laptop", 3), make("laptop", 4)
    summary = write_variations("laptop:3", tmp_path / "near", 1, strength=0.2, progress=False)
    between = write_variations("laptop:3", tmp_path / "between", 1, towards="laptop:4", progress=False)
    assert not summary.failed
    assert not between.failed
    (step,) = summary.notes[0]["operations"]
    assert step["operation"] == "parameters"
    assert "width" in step["values"]
    near, middle = (artsim.load(tmp_path / name / "0" / "params.json") for name in ("near", "between"))
    assert near.sha256 == json.loads((tmp_path / "near" / "0" / "meta.json").read_text())["artsim"]["sha256"]
    assert middle.params is not None
    assert first.params is not None
    assert second.params is not None
    assert middle.params["width"] == pytest.approx(
        0.5 * (float(first.params["width"]) + float(second.params["width"])), rel=0.05
    )
    again = write_variations(tmp_path / "near" / "0" / "params.json", tmp_path / "next", 1, progress=False)
    assert not again.failed


def test_only_procedural_objects_have_parameters_to_vary(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="procedural"):
        write_variations(ASSETS / "laptop", tmp_path / "out", 1, strength=0.2, progress=False)
    with pytest.raises(ConfigError, match="between 0 and 1"):
        artsim.vary(make("laptop", 3), strength=2.0)
