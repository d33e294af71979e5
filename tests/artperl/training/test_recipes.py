"""Recipes and options: every shipped estimator has a recipe, and a file says where an estimator comes from."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from artperl.commands import verbs
from artperl.data.categories import ARTIMAGE
from artperl.methods.estimator_folders import WEIGHTS, read_settings
from artperl.training.options import PRESETS, TrainOptions, changed
from artperl.training.recipes import RECIPES, Recipe, is_made, provenance
from artsim.errors import ConfigError
from tests.artperl.training.test_run import TINY


def test_every_estimator_that_comes_with_the_package_has_a_recipe_that_begins_at_random() -> None:
    shipped_names = {path.parent.name for path in WEIGHTS.glob("*/estimator.json")}
    assert {path.stem for path in RECIPES.glob("*.json")} == shipped_names >= {*ARTIMAGE, "generic"}
    for path in (RECIPES / "artperl").glob("*.json"):
        made = read_settings(WEIGHTS / "artperl" / path.stem)["about"]
        assert made["recipe"]["sha256"] == hashlib.sha256(path.read_bytes()).hexdigest()
        assert Recipe.read(f"artperl/{path.stem}").train_options().categories == (path.stem,)
    assert {path.stem for path in (RECIPES / "artperl").glob("*.json")} == set(ARTIMAGE)
    for path in RECIPES.glob("*.json"):
        options = Recipe.read(path.stem).train_options()
        assert options.start_from is None
        assert not options.real
        shipped = read_settings(WEIGHTS / path.stem)
        assert set(options.categories) == set(shipped["about"]["options"]["categories"])
        assert (options.width, options.votes) == (shipped["perception"]["width"], shipped["perception"]["votes"])


def test_a_recipe_on_another_preset_keeps_its_data_and_learns_as_long_as_that_preset() -> None:
    recipe = Recipe.read("drawer")
    whole, quick = recipe.train_options(), recipe.train_options("quick")
    assert quick.perception_steps == PRESETS["quick"].perception_steps < whole.perception_steps
    assert (quick.stretched, quick.noisy, quick.sample) == (whole.stretched, whole.noisy, whole.sample)


@pytest.mark.parametrize(
    "text",
    ["", "[1]", "{}", '{"preset": "huge", "options": {}, "lengths": {}}',
     '{"preset": "quick", "options": {"colour": 1}, "lengths": {}}',
     '{"preset": "quick", "options": {}, "lengths": {"perception_steps": "many"}}',
     '{"preset": "quick", "options": {"noisy": 2.0}, "lengths": {}}',
     '{"preset": ["quick"], "options": {}, "lengths": {}}', '{"preset": "quick", "options": 3, "lengths": {}}',
     '{"preset": "quick", "options": {"method": "artperl", "ppo": {"minibatch": 0}}, "lengths": {}}',
     '{"preset": "quick", "options": {"base_objects": 1000000000000}, "lengths": {}}'],
)  # fmt: skip
def test_a_recipe_that_is_none_is_named(text: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.json"
    path.write_text(text)
    with pytest.raises(ConfigError):
        Recipe.read(str(path))
    with pytest.raises(ConfigError, match="laptop"):
        Recipe.read("teapot")


def test_options_change_at_every_depth_and_nothing_else_does() -> None:
    options = changed(TINY, {"seed": 5, "sample": {"views": {"preset": "sphere"}}, "ppo": {"epochs": 2}})
    assert options.sample == replace(TINY.sample, views=replace(TINY.sample.views, preset="sphere"))
    assert options.ppo == replace(TINY.ppo, epochs=2)
    differing = {name for name, value in asdict(options).items() if value != asdict(TINY)[name]}
    assert differing == {"seed", "sample", "ppo"}


@pytest.mark.parametrize("change", [{"noisy": 0.5, "dataset": "d"}, {"dataset": "d", "real": True}, {"categories": []}])
def test_options_that_contradict_each_other_are_refused(change: dict[str, object]) -> None:
    with pytest.raises(ConfigError):
        changed(TrainOptions(), change)


@pytest.mark.slow
def test_an_estimator_says_which_recipe_made_it_and_from_what(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its recipe's and its parent's digests are those of the files; the command leaves a finished run as it is."""
    recipe = tmp_path / "tiny.json"
    lengths = {"perception_steps": 0, "box_views": 0}
    options = {
        "categories": ["laptop"], "start_from": "laptop", "width": 48, "base_objects": 3, "test_objects": 1,
        "foreign_categories": 1, "validation_views": 2,
    }  # fmt: skip
    recipe.write_text(json.dumps({"preset": "quick", "options": options, "lengths": lengths}))
    out = tmp_path / "run"
    monkeypatch.setattr("sys.argv", ["train.py", "--recipe", str(recipe), "--out", str(out)])
    verbs.train_main()
    about = read_settings(out / "best")["about"]
    assert about["recipe"] == {"name": "tiny", "sha256": hashlib.sha256(recipe.read_bytes()).hexdigest()}
    weights = (WEIGHTS / "laptop" / "weights.safetensors").read_bytes()
    assert about["parents"] == [{"name": "laptop", "sha256": hashlib.sha256(weights).hexdigest()}]
    assert about["commit"]
    before = (out / "best" / "estimator.json").stat().st_mtime_ns
    capsys.readouterr()
    verbs.train_main()
    assert "laptop lid" in capsys.readouterr().out
    assert (out / "best" / "estimator.json").stat().st_mtime_ns == before
    recipe.write_text(recipe.read_text() + "\n")
    assert not is_made(out, Recipe.read(str(recipe)))
    monkeypatch.setattr("sys.argv", ["train.py", "--recipe", str(recipe), "--seed", "1", "--out", str(out)])
    with pytest.raises(SystemExit):
        verbs.train_main()
    assert "seed" in capsys.readouterr().err


def test_a_run_without_a_recipe_has_none() -> None:
    assert provenance(TrainOptions(), None)["recipe"] is None
    assert provenance(TrainOptions(), None)["parents"] == []
