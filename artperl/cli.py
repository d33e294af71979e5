"""The program ``artperl``: train, evaluate, estimate."""

from __future__ import annotations

import json
import os
import sys
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Literal

import tyro

from artperl.commands.estimate import Estimate
from artsim.cli import run_program
from artsim.common.files import write_atomic
from artsim.common.progress import say
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError
from artsim.loading.roots import PackageRoots
from artsim.model.draws import StateMode, StateOptions, ViewOptions, ViewPreset

_FILE_VIEWS = 40
"""Views of files, at least, that an estimator is tested with."""


@dataclass(frozen=True)
class Train:
    """Train an estimator on fresh procedural objects, or on objects of your own, and test it as it learns.

    Prints the table of errors at intervals and keeps the best estimator in OUT/best. Stop it at any moment with Ctrl-C:
    the same command goes on where it stopped, with the same result. Curves: tensorboard --logdir OUT.

    To see it learn: python train.py --category laptop --preset quick

    To train well: python train.py --category eyeglasses --preset full --out out/eyeglasses

    For a robot of your own, from the estimator for any tree:
    python train.py --files robot.urdf --preset joint --start-from any --perception-steps 2000 --agent-rollouts 0
    """

    category: tuple[str, ...] = ()
    """Procedural categories, or 'all'; several share one estimator, and one named twice is seen twice as often. By
    default laptop."""
    files: tuple[Path, ...] = ()
    """Learn from these objects instead: URDF files, object folders, or folders of them. They are tested in other states
    and from other sides; for objects that were not learnt from use artperl evaluate --files."""
    package_root: PackageRoots = field(default_factory=dict)
    """Folders that package:// names of these files stand for, where they are not found as they are; repeatable."""
    parts: Literal["artimage", "any"] | None = None
    """artimage: objects with the parts that their category has in ArtImage, such as body and three drawers; any: all
    objects of the families. By default the preset's."""
    method: Literal["full", "artperl"] = "full"
    """full: the method that comes with trained weights; artperl: that of the paper, section 4 as printed."""
    preset: Literal["quick", "full", "gpu", "joint"] = "quick"
    """quick: under five minutes on two cores, to see it learn; full: within the hour; gpu: longer, on a
    GPU; joint: one estimator for many categories, with any parts."""
    out: Path | None = None
    """Folder of the run; by default out/train/CATEGORY-PRESET."""
    seed: int = 0
    perception_steps: int | None = None
    """Batches that perception learns from; by default the preset's."""
    dense_steps: int | None = None
    """More batches, of fewer, denser clouds: of as many points as the estimator looks at. By default the preset's."""
    denser: int | None = None
    """Times the points of a training cloud that the estimator looks at; by default the preset's."""
    stretched: float = 0.0
    """Share of perception's training clouds that are stretched, so that rows of drawers are seldom of equal ones."""
    noisy: float = 0.0
    """Share of perception's other training clouds that are as a depth sensor, a D435, sees them."""
    perception_rate: float = 2e-3
    """Highest learning rate of perception; a lower one changes less of what --start-from brings along."""
    agent_rollouts: int | None = None
    """Batches of episodes that the agent learns from, 0 for no agent; by default the preset's."""
    box_views: int | None = None
    """Fresh views whose estimates teach where boxes end, 0 to keep those of the references; by default the preset's."""
    box_width: int | None = None
    """Channels of the network that says where boxes end; by default the preset's."""
    learning: Literal["both", "cloning", "reinforcement"] = "both"
    """How the agent learns: behaviour cloning and PPO, or one of them alone."""
    real: bool = False
    """Learn from real objects, too: every other one, of the half of ArtImage's frozen split that is not for testing."""
    dataset: Path | None = None
    """Learn from the train split of a dataset that generate.py wrote, instead of from fresh objects."""
    start_from: Path | None = None
    """Folder of an estimator whose networks are learnt on; by default they begin at random."""
    noise: Literal["none", "kinect_v1", "d435", "azure", "gaussian3mm"] = "none"
    """Depth sensor of the clouds."""
    states: StateMode = "uniform"
    """In which states objects are learnt and tested: anywhere within their limits; at rest; at the ends; or mixed,
    every other object anywhere, the others at rest or at the ends, as things at home mostly are."""
    views: ViewPreset = "artimage"
    """From where objects are seen: from the front, as in ArtImage, from all round, or half of them each way."""
    device: Literal["cpu", "cuda"] | None = None
    """Where the networks learn; by default the preset's."""
    workers: int = 1
    """Processes that make clouds while the network learns, and estimates that boxes learn from; the result does not
    depend on it."""
    threads: int | None = None
    """Processor threads of the network; by default torch's choice."""

    def run(self) -> None:
        import torch

        from artperl.training.options import PAPER_PRESETS, PRESETS
        from artperl.training.paper_run import train
        from artperl.training.run import Training
        from artsim.families import FAMILIES

        if self.threads is not None:
            torch.set_num_threads(self.threads)
        presets = PRESETS if self.method == "full" else PAPER_PRESETS
        if self.preset not in presets:
            raise ConfigError(f"the method {self.method} has no such preset", "preset", f"use {' or '.join(presets)}")
        if self.method == "artperl" and (self.files or self.real or self.start_from):
            raise ConfigError(
                "the method artperl learns from procedural objects or a dataset", "files, real, start_from",
                "leave them out",
            )  # fmt: skip
        preset = presets[self.preset]
        if self.denser is not None and self.denser < 1:
            raise ConfigError(f"{self.denser} times the points are none", "denser", "use 1 or more")
        if self.box_width is not None and self.box_width < 1:
            raise ConfigError(f"{self.box_width} channels are none", "box_width", "use 1 or more")
        if not 0.0 < self.perception_rate < 1.0:
            raise ConfigError(f"{self.perception_rate} is no learning rate", "perception_rate", "use 1e-4 to 1e-2")
        for name, share in (("stretched", self.stretched), ("noisy", self.noisy)):
            if not 0.0 <= share <= 1.0:
                raise ConfigError(f"{share} is no share", name, "use 0 to 1")
        if self.noisy and (self.dataset or self.noise != "none"):
            raise ConfigError("clouds that have their noise get no other", "noisy", "use one of noise, dataset, noisy")
        if self.files and (self.category or self.real or self.parts == "artimage"):
            raise ConfigError("files are learnt from alone, with all of their parts", "files", "give no --category")
        category = self.category or (() if self.files else ("laptop",))
        categories = tuple(FAMILIES) if category == ("all",) else category
        parts = "any" if self.files else self.parts or preset.parts
        steps, rollouts = self.perception_steps, self.agent_rollouts
        options = replace(
            preset, categories=categories, files=tuple(map(str, self.files)),
            package_roots=tuple((name, str(root)) for name, root in self.package_root.items()),
            parts=parts, real=self.real, seed=self.seed,
            device=self.device or preset.device,
            dataset=None if self.dataset is None else str(self.dataset),
            start_from=None if self.start_from is None else str(self.start_from),
            test_objects=max(preset.test_objects, _FILE_VIEWS) if self.files else preset.test_objects,
            sample=SampleOptions(
                states=StateOptions(self.states), noise=self.noise, views=ViewOptions(preset=self.views)
            ),
            perception_steps=preset.perception_steps if steps is None else steps,
            dense_steps=preset.dense_steps if self.dense_steps is None else self.dense_steps,
            denser=preset.denser if self.denser is None else self.denser,
            stretched=self.stretched,
            noisy=self.noisy,
            perception_rate=self.perception_rate,
            agent_rollouts=preset.agent_rollouts if rollouts is None else rollouts,
            box_views=preset.box_views if self.box_views is None else self.box_views,
            box_width=preset.box_width if self.box_width is None else self.box_width,
            learning=self.learning,
        )  # fmt: skip
        name = "-".join(category) or self.files[0].stem
        run = self.preset if self.method == "full" else f"{self.method}-{self.preset}"
        out = self.out or Path("out/train") / f"{name}-{run}"
        try:
            if self.method == "artperl":
                train(options, out, self.workers)
            else:
                Training(options, out, self.workers).run()
        except KeyboardInterrupt:
            print(f"stopped; the same command goes on from {out}", file=sys.stderr)
            sys.exit(130)
        print((out / "table.txt").read_text(), end="")
        print(f"estimator: {out / 'best'}")


@dataclass(frozen=True)
class Evaluate:
    """Test an estimator on unseen objects, procedural ones or those of files, and print the table of its errors.

    Or fill the rows of a benchmark with the estimators that come with the package:
    artperl evaluate --benchmark artimage --json figures.json
    """

    estimator: tyro.conf.Positional[Path | None] = None
    """Folder of the estimator, or the name of one that comes with the package. For a benchmark, folder of the
    estimators by category; by default those that come with the package."""
    method: Literal["full", "artperl"] = "full"
    """Method of the estimator."""
    benchmark: Literal["artimage"] | None = None
    """artimage: regenerated ArtImage, at least 500 views of each category in each row."""
    ablation: bool = False
    """Test the estimator with one stage after the other left out or changed."""
    cloned: Path | None = None
    """For the ablation: estimator whose agent learnt by behaviour cloning alone."""
    reinforced: Path | None = None
    """For the ablation: estimator whose agent learnt by PPO alone."""
    rows: tuple[Literal["procedural", "real", "real_trained", "procedural_sphere", "real_sphere"], ...] = ()
    """Rows of the benchmark; by default all that there are objects and weights for."""
    real_weights: Path | None = None
    """For the row real_trained: folder of the estimators that have learnt from real objects, too."""
    partnet: Path | None = Path(os.environ["ARTSIM_PARTNET_DIR"]) if "ARTSIM_PARTNET_DIR" in os.environ else None
    """For the rows of real objects: unpacked PartNet-Mobility; by default what ARTSIM_PARTNET_DIR names."""
    category: tuple[str, ...] = ()
    """Procedural categories; by default those that it was trained on."""
    objects: int = 40
    """Unseen procedural objects of each category."""
    files: tuple[Path, ...] = ()
    """Instead of procedural objects: URDF files, object folders, or folders of them. An estimator of one category of
    ArtImage is tested on them as ArtImage has it: parts that move otherwise stay at rest, and drawers open to the
    front."""
    package_root: PackageRoots = field(default_factory=dict)
    """Folders that package:// names of these files stand for, where they are not found as they are; repeatable."""
    views: int | None = None
    """Views of each object, by default 4; of a benchmark, the least number of views of each category."""
    states: StateMode = "uniform"
    """In which states objects are: anywhere within their limits, at rest (shut, but for eyeglasses), at the ends, or
    mixed. A benchmark has them anywhere."""
    preset: ViewPreset = "artimage"
    """From where objects are seen."""
    seen_from: tuple[float, float] | None = None
    """Azimuths that the estimator is told that the camera is within, degrees about the object's vertical, 0 for its
    front. By default it is not told."""
    noise: Literal["none", "kinect_v1", "d435", "azure", "gaussian3mm"] = "none"
    """Depth sensor of the clouds."""
    num_points: int = 8192
    """Points of a cloud: pixels of the object, drawn at random."""
    json: Path | None = None
    """Write the figures to this file."""

    def run(self) -> None:
        figures = self._single() if self.benchmark is None else self._rows()
        if self.json is not None:
            write_atomic(self.json, _json(figures))

    def _rows(self) -> dict[str, Any]:
        from artperl.data.categories import ARTIMAGE
        from artperl.evaluation.artimage import ROWS, VIEWS
        from artperl.evaluation.benchmark_rows import run_rows

        if (self.states, self.preset, self.noise) != ("uniform", "artimage", "none"):
            raise ConfigError(
                "a benchmark has states, viewpoints and noise of its own", "states, preset, noise",
                "leave them out, or name an estimator instead of the benchmark",
            )  # fmt: skip
        rows = self.rows or tuple(
            row
            for row in ROWS
            if not (row == "real_trained" and self.real_weights is None)
            and not (row.startswith("real") and self.partnet is None)
        )
        for row in (row for row in ROWS if not self.rows and row not in rows):
            print(f"{row}: left out, since {'--real-weights' if self.partnet else '--partnet'} is not given")
        return run_rows(
            rows, self.category or tuple(ARTIMAGE), self.estimator, self.real_weights, self.partnet, self.objects,
            self.views or VIEWS, self.num_points, True, say, self.seen_from,
        )  # fmt: skip

    def _single(self) -> dict[str, Any]:
        from artperl.estimator import folder_of, load_estimator, read_settings
        from artperl.evaluation.artimage import as_known
        from artperl.evaluation.scoring import evaluate, frozen_samples, samples_of, summary, table
        from artperl.methods.full import Estimator
        from artsim.loading.sources import find_sources

        if self.estimator is None:
            raise ConfigError("which estimator is to be tested?", "evaluate", "name its folder, or a --benchmark")
        told = {} if self.seen_from is None else {"seen_from": self.seen_from}
        estimator = load_estimator(self.estimator, method=self.method, **told)
        learnt = read_settings(folder_of(self.estimator))["about"]["options"]
        options = SampleOptions(
            self.num_points, states=StateOptions(self.states), views=ViewOptions(preset=self.preset), noise=self.noise
        )
        views, parts = self.views or 4, learnt.get("parts", "artimage")
        categories = self.category or tuple(learnt["categories"])
        if self.files:
            objects = (
                as_known(source.load(), categories, parts) for source in find_sources(self.files, self.package_root)
            )
            samples = samples_of(objects, views, options)
        elif not categories:
            raise ConfigError("it knows objects of files, no category", "evaluate", "name them with --files")
        else:
            samples = frozen_samples(categories, self.objects, views, options, parts=parts)
        if self.ablation:
            if not isinstance(estimator, Estimator):
                raise ConfigError("the ablation leaves out stages of the method full", "ablation", "leave it out")
            from artperl.evaluation.ablation import run_ablation, variants
            from artperl.evaluation.basin import basin_problem, run_basin

            agents = (None if path is None else load_estimator(path).agent for path in (self.cloned, self.reinforced))
            result = run_ablation(variants(estimator, *agents), samples, say, True)
            if estimator.agent is not None and not self.files:
                result["start"] = run_basin(estimator, basin_problem(estimator, categories, parts), say)
            return result
        figures = summary(evaluate(estimator, samples, progress=True))
        print(table(figures))
        return figures


def _json(record: Any) -> bytes:
    return (json.dumps(record, indent=1) + "\n").encode()


Verb = (
    Annotated[Train, tyro.conf.subcommand("train")]
    | Annotated[Evaluate, tyro.conf.subcommand("evaluate")]
    | Annotated[Estimate, tyro.conf.subcommand("estimate")]
)


def main() -> None:
    """Entry point of ``artperl``."""
    run_program(Verb, "artperl", __doc__)


def train_main() -> None:
    """Entry point of ``train.py``."""
    run_program(Train, "train.py")
