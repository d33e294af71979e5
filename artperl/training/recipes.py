"""Recipes: one file for each estimator that comes with the package, from which a training run makes it."""

from __future__ import annotations

import hashlib
import subprocess
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from artperl.methods.estimator_files import weights_sha256
from artperl.methods.estimator_folders import WEIGHTS, folder_of, read_settings
from artperl.training.options import FORMER_PRESETS, TrainOptions, changed, preset_of
from artsim.common.files import parse_json, read_bounded
from artsim.errors import ConfigError, DatasetError

RECIPES = Path(__file__).parents[1] / "recipes"
"""Folder of the recipes that come with the package."""

_MAX_BYTES = 100_000


@dataclass(frozen=True)
class Recipe:
    """How an estimator is made."""

    name: str
    preset: str
    """Of :data:`artperl.training.options.PRESETS`."""
    options: dict[str, Any]
    """What it learns from, as :func:`artperl.training.options.changed` takes it."""
    lengths: dict[str, Any]
    """How long it learns; another preset than the recipe's has its own."""
    sha256: str
    """Digest of its file."""

    @classmethod
    def read(cls, name: str) -> Recipe:
        """A recipe that comes with the package by its name, such as laptop or artperl/laptop, or one of a JSON file.

        Raises
        ------
        ConfigError
            When there is none, or it is not one.
        """
        path = Path(name) if name.endswith(".json") else RECIPES / f"{name}.json"
        known = ", ".join(sorted(str(own.relative_to(RECIPES).with_suffix("")) for own in RECIPES.rglob("*.json")))
        if not path.is_file():
            raise ConfigError(f"there is no recipe {name!r:.80}", "recipe", f"use one of {known}, or a JSON file")
        data = read_bounded(path, _MAX_BYTES, "the recipe", ConfigError)
        try:
            recipe = parse_json(data)
        except ValueError as error:
            raise ConfigError(f"the recipe is not JSON ({error})", path) from error
        fields = {"preset": str, "options": dict, "lengths": dict}
        if (
            not isinstance(recipe, dict)
            or recipe.keys() != fields.keys()
            or not all(isinstance(recipe[name], kind) for name, kind in fields.items())
        ):
            raise ConfigError("a recipe has a preset, options and lengths", path, f"write it like {known}")
        recipe["preset"] = FORMER_PRESETS.get(recipe["preset"], recipe["preset"])
        made = cls(path.stem, sha256=hashlib.sha256(data).hexdigest(), **recipe)
        made.train_options()
        return made

    def train_options(self, preset: str | None = None) -> TrainOptions:
        """Options of the run that makes the estimator; with another preset it learns as long as that preset has it."""
        method = self.options.get("method", "full")
        lengths = self.lengths if preset in (None, self.preset) else {}
        return changed(preset_of(method, preset or self.preset), self.options | lengths)


def provenance(options: TrainOptions, recipe: Recipe | None) -> dict[str, Any]:
    """Where an estimator comes from: the recipe, the commit or version of this package, and its parents.

    Returns
    -------
    dict
        ``recipe``: name and SHA-256, or None; ``commit``: str; ``parents``: name and SHA-256 of the weights of each
        estimator that it started from.
    """
    parents = [] if options.start_from is None else [folder_of(options.start_from)]
    return {
        "recipe": None if recipe is None else {"name": recipe.name, "sha256": recipe.sha256},
        "commit": commit(),
        "parents": [{"name": folder.name, "sha256": weights_sha256(folder)} for folder in parents],
    }


def is_made(out: Path, recipe: Recipe) -> bool:
    """Whether the run in a folder has made and tested the estimator of this very recipe."""
    found = about_tested(out).get("recipe")
    return isinstance(found, dict) and found.get("sha256") == recipe.sha256


def about_tested(out: Path) -> dict[str, Any]:
    """What the estimator of a run says of itself; nothing before the run has come to its end, its test."""
    try:
        about: dict[str, Any] = read_settings(out / "best")["about"]
    except DatasetError:
        return {}
    return about if "test" in about else {}


def commit() -> str:
    """The commit of the clone that this package is in, with + for changed files; outside a clone its version."""
    clone = WEIGHTS.parents[1]
    if (clone / ".git").exists():
        try:
            command = ["git", "-C", str(clone), "describe", "--always", "--abbrev=40", "--exclude=*", "--dirty=+"]
            return subprocess.run(command, capture_output=True, text=True, check=True, timeout=60).stdout.strip()
        except (OSError, subprocess.SubprocessError):  # git is not installed, or refuses somebody else's clone
            pass
    return version("artsim")
