"""The verb ``artperl train``."""

from __future__ import annotations

import importlib
import logging
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from artperl.methods import StoredMethod
from artperl.methods.estimator_folders import RUNS, WEIGHTS
from artsim.common.files import read_json
from artsim.common.names import safe_name
from artsim.common.program import Figures, resumable
from artsim.errors import ConfigError
from artsim.loading.roots import PackageRoots
from artsim.model.draws import StateMode, ViewPreset

if TYPE_CHECKING:
    from artperl.training.options import TrainOptions
    from artperl.training.recipes import Recipe

log = logging.getLogger(__name__)

_FILE_VIEWS = 40
"""Views of files, at least, that an estimator is tested with."""


@dataclass(frozen=True)
class Train(Figures):
    """Train an estimator on new procedural objects, or on given objects, and test it as it learns.

    Prints the table of errors at intervals and keeps the best estimator in OUT/best. Stop it at any moment with Ctrl-C:
    rerun the command to resume, with the same result. Curves: tensorboard --logdir OUT.

    To see it learn: artperl train --category laptop --preset quick

    To train well: artperl train --category eyeglasses --preset long --out out/eyeglasses

    A category of your own, from 5 files or more: artperl train --objects my_urdfs/ --name mydoor

    Then: artperl estimate cloud.npy --category mydoor

    For your robot, from the estimator for any tree:
    artperl train --objects robot.urdf --preset joint --start-from generic --perception-steps 2000

    To make an estimator that comes with the package: artperl train --recipe laptop

    On several processors or GPUs, with the same result:
    torchrun --nproc-per-node 2 -m artperl train --category laptop --out out/laptop

    Defaults are those of the preset or the recipe.
    """

    preset: Literal["quick", "long", "joint", "own"] | None = None
    """quick: under five minutes on two cores, to see it learn; long: within the hour; joint: one estimator for many
    categories, with any parts; own: a category of your objects. By default the recipe's, with --name own, else
    quick."""
    recipe: str | None = None
    """A recipe that comes with the package, by the name of its estimator, or a JSON file. With a preset, the run is as
    long as that preset's. A finished run is unchanged."""
    out: Path | None = None
    """Folder of the run; by default out/train/NAME, or out/train/CATEGORY-PRESET."""
    workers: int = 1
    """Processes that make clouds while the network learns, and estimates that boxes learn from; the result does not
    depend on it."""
    threads: int | None = None
    """Processor threads of the network; by default torch's choice."""
    device: Literal["cpu", "cuda"] = "cpu"
    """Where the networks learn. A run may resume on another device."""

    wandb: str | None = None
    """Project of Weights & Biases that gets the curves, too. It takes pip install wandb; WANDB_MODE=offline needs no
    account."""

    # From here on: fields of TrainOptions under their own names, then those of its parts.
    method: StoredMethod | None = None
    """full: the default method; artperl: the paper's, section 4; the others: the
    baselines that the paper compares with."""
    categories: Annotated[tuple[str, ...] | None, tyro.conf.arg(name="category")] = None
    """Procedural categories, or 'all'; several share one estimator, and one named twice is seen twice as often. By
    default laptop."""
    objects: tuple[Path, ...] | None = None
    """Learn from these objects instead: URDF files, object folders, or folders of them. Without --name they are tested,
    too, in other states and from other sides."""
    name: str | None = None
    """Learn the category that these objects are of: two fifths of them are held out, to choose the best estimator and
    to test it. OUT/split.json says which. Every other object is one of --category, by default of generic's."""
    package_roots: Annotated[PackageRoots, tyro.conf.arg(name="package-root")] = field(default_factory=dict)
    """Folders that package:// names of their files stand for, where they are not found as they are; repeatable."""
    parts: Literal["artimage", "any"] | None = None
    """artimage: objects with the parts that their category has in ArtImage or ReArtMix, such as body and three drawers;
    any: all objects of the families."""
    seed: int | None = None
    perception_steps: int | None = None
    """Batches that perception learns from."""
    dense_steps: int | None = None
    """More batches, of fewer, denser clouds: of as many points as the estimator looks at."""
    denser: int | None = None
    """Times the points of a training cloud that the estimator looks at."""
    stretched: float | None = None
    """Share of perception's training clouds that are stretched, so that rows of drawers are seldom of equal ones."""
    noisy: float | None = None
    """Share of perception's other training clouds with the noise of one of four depth sensors."""
    degraded: float | None = None
    """Share of all of perception's training clouds that are cut, dirty or sparse, as detectors' masks are."""
    perception_rate: float | None = None
    """Highest learning rate of perception; a lower one changes less of what --start-from brings along."""
    patience: int | None = None
    """Validations in a row without a gain after which a stage ends early; by default none does."""
    agent_rollouts: int | None = None
    """Batches of episodes that the agent of the method artperl learns from."""
    box_views: int | None = None
    """Fresh views whose estimates teach where boxes end, 0 to keep those of the references."""
    box_width: int | None = None
    """Channels of the network that says where boxes end."""
    real: bool = False
    """Learn from real objects, too: every other one, of the half of ArtImage's frozen split that is not for testing."""
    dataset: Path | None = None
    """Learn from the train split of a dataset that artsim generate wrote, instead of from fresh clouds. By default its
    categories are learnt, and the estimator is tested on fresh clouds with its noise, states and views."""
    start_from: Path | None = None
    """Folder of an estimator whose networks are trained further; by default they start at random."""
    noise: Literal["none", "kinect_v1", "d435", "azure", "gaussian3mm"] | None = None
    """Depth sensor of the clouds."""
    states: StateMode | None = None
    """Joint states in training and test: anywhere within their limits; at rest; at the ends; or mixed,
    every other object anywhere, the others at rest or at the ends, as things at home mostly are."""
    views: ViewPreset | None = None
    """From where objects are seen: from the front, as in ArtImage, from all round, or half of them each way."""

    def run(self) -> None:
        import torch

        from artperl.training.recipes import Recipe, is_made
        from artperl.training.run import Training

        if self.threads is not None:
            torch.set_num_threads(self.threads)
        recipe = None if self.recipe is None else Recipe.read(self.recipe)
        options = self._options(recipe)
        preset = self.preset or (recipe.preset if recipe else "quick")
        given = Path((*options.objects, options.dataset or "laptop")[0]).stem
        name = recipe.name if recipe else "-".join(self.categories or ()) or given
        method = "" if options.method == "full" else f"{options.method}-"
        out = self.out or RUNS / (options.name or f"{name}-{method}{preset}")
        if recipe is None or not is_made(out, recipe):
            with resumable("checkpoints are kept", out):
                training = Training(options, out, self.workers, recipe=recipe, device=self.device)
                if self.wandb is not None and training.context.ranks.first:
                    _open_wandb(self.wandb, out, asdict(options))
                training.run()
                training.context.ranks.close()
                if not training.context.ranks.first:
                    return
        self.say((out / "table.txt").read_text().rstrip("\n"))
        self.finish(read_json(out / "figures.json", "the figures of the run", ConfigError))
        log.info(f"estimator: {out / 'best'}")

    def _options(self, recipe: Recipe | None) -> TrainOptions:
        """Those of the preset or the recipe, with what is given."""
        from artperl.training.options import TrainOptions, changed, preset_of
        from artsim.families import FAMILIES

        known = {own.name for own in fields(TrainOptions)}
        changes = {
            own.name: _plain(value)
            for own in fields(self)
            if own.name in known
            and (value := getattr(self, own.name)) is not None
            and value is not False
            and value != {}
        }
        seen = {"noise": self.noise, "states": self.states and {"mode": self.states},
                "views": self.views and {"preset": self.views}}  # fmt: skip
        if any(seen.values()):
            changes["sample"] = {name: value for name, value in seen.items() if value is not None}
        if recipe is not None:
            if changes:
                raise ConfigError(
                    f"the recipe says that itself: {', '.join(changes)}", "recipe", "give no other options with it"
                )
            return recipe.train_options(self.preset)
        preset = preset_of(self.method or "full", self.preset or ("own" if self.name else "quick"))
        if self.name is not None:
            _check_name(self.name, self.objects)
        if self.objects:
            if (self.categories and self.name is None) or self.real or self.parts == "artimage":
                raise ConfigError(
                    "given objects are learnt from alone, with all of their parts", "objects", "give no --category"
                )
            views = max(preset.test_objects, _FILE_VIEWS)
            changes |= {"parts": "any", "test_objects": views}
            if self.name is None or self.preset not in (None, "own"):
                changes.setdefault("categories", [])
        elif self.dataset is not None:
            preset = _like_dataset(preset, self.dataset)
        if self.categories == ("all",):
            changes["categories"] = list(FAMILIES)
        return changed(preset, changes)


def _like_dataset(options: TrainOptions, folder: Path) -> TrainOptions:
    """Options with the categories, noise, states and views of a dataset."""
    from artsim.datasets.dataset import open_dataset

    plan = open_dataset(folder).plan
    categories = tuple(dict.fromkeys(planned.category for planned in plan.objects))
    sample = replace(plan.sample, renderer="raycast", images=(), details=False)
    return replace(options, categories=categories, sample=sample)


def _check_name(name: str, objects: tuple[Path, ...] | None) -> None:
    """Refuse a name that is not one of a folder, or is that of an estimator of the package."""
    if not objects:
        raise ConfigError("there are no objects to name", "--name", "say which: --objects my_urdfs/")
    if safe_name(name) != name:
        raise ConfigError(f"{name!r:.80} is no name", "--name", "use letters, digits, - and _")
    if (WEIGHTS / name).is_dir():
        raise ConfigError(f"{name} comes with the package", "--name", f"use another name, such as my_{name}")


def _open_wandb(project: str, out: Path, options: dict[str, Any]) -> None:
    """Let Weights & Biases read what is written for TensorBoard."""
    try:
        wandb: Any = importlib.import_module("wandb")
    except ImportError as error:
        raise ConfigError(f"Weights & Biases cannot be imported ({error})", "wandb", "pip install wandb") from error
    wandb.init(project=project, name=out.name, group=out.name, dir=str(out), config=options, sync_tensorboard=True)


def _plain(value: Any) -> Any:
    """A value as JSON has it."""
    if isinstance(value, dict):
        return [[name, str(root)] for name, root in value.items()]
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return str(value) if isinstance(value, Path) else value
