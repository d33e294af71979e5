"""The verb ``artperl evaluate``."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import tyro

from artsim.common.files import write_atomic
from artsim.common.outputs import check_output
from artsim.common.progress import say
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError
from artsim.loading.roots import PackageRoots
from artsim.model.draws import StateMode, StateOptions, ViewOptions, ViewPreset


@dataclass(frozen=True)
class Evaluate:
    """Test an estimator on unseen objects, procedural ones or those of files, and print the table of its errors.

    Or fill the rows of a benchmark with the estimators that come with the package:
    artperl evaluate --benchmark artimage --json figures.json
    """

    estimator: tyro.conf.Positional[Path | None] = None
    """Folder of the estimator, or the name of one that comes with the package. For a benchmark and the
    ablation, folder of the estimators by category; by default those that come with the package."""
    method: str = "full"
    """Method of the estimator: full, which comes with the package; artperl, the paper's, with weights for laptop,
    eyeglasses, dishwasher, scissors and drawer; a
    baseline that you trained (ancsh, omad, sporeagent); or one that you add (CONTRIBUTING.md). A benchmark and the
    ablation are of the method full."""
    benchmark: Literal["artimage", "robustness", "reartmix"] | None = None
    """artimage: regenerated ArtImage, at least 500 views of each category in each row. robustness: sensors, occluders,
    bad masks and few points, at least 100 views in each row. reartmix: several objects in each image, average precision
    at 5 degrees, 5 cm and IoU 0.5. With --json, a run of the last two that was stopped goes on."""
    ablation: bool = False
    """Measure what each stage brings: the estimators of all categories without one stage after the other, on validation
    objects. With --json, a run that was stopped goes on from the rows of the file."""
    rows: tuple[Literal["procedural", "real", "real_all", "real_trained", "procedural_sphere", "real_sphere"], ...] = ()
    """Rows of the benchmark; by default all that there are objects and weights for. real_all, both halves of the real
    objects, is of robustness; real_trained and the rows from all round are of artimage."""
    conditions: tuple[str, ...] = ()
    """Conditions of robustness, such as occluded_40 leak_7; by default all."""
    real_weights: Path | None = None
    """For the row real_trained: folder of the estimators that have learnt from real objects, too."""
    root: Path | None = None
    """For the benchmark artimage: folder of the original ArtImage, whose test split is read instead of views that are
    made here. Any --method then; without --views, all frames. For reartmix: folder that artsim scene wrote, or that has
    the layout of ReArtMix; by default --views scenes, 50, are made in out/reartmix."""
    detector: str | None = None
    """For reartmix: what finds the objects: tabletop, which comes with the package, or a folder that artperl
    train-detector wrote. By default detections are realistic ones, made from the truth."""
    detections: Path | None = None
    """For reartmix: COCO's results instead, with image_id as artperl detections writes it."""
    apart: bool = False
    """For reartmix: move estimates whose boxes overlap apart, as artperl estimate --apart does."""
    skip_bad: bool = False
    """For reartmix: leave out detections that cannot be used, and list them, instead of refusing the file."""
    estimators: tuple[str, ...] = ()
    """For reartmix: CATEGORY=NAME, such as box=out/train/box-full, or a folder with one for each category, of any
    method. By default those that come with the package, by their names, and any for drawers, whose number varies."""
    picture: Path | None = None
    """For reartmix: write the first 12 images with the estimates over them here, as PNG."""
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
    """Views of each object, by default 4; of a benchmark, the least number of views of each category; of the
    ablation, the least number of each row, by default 32."""
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
        if self.benchmark == "reartmix":
            from artperl.commands.reartmix import evaluate_reartmix

            evaluate_reartmix(self)
            return
        names = ("detections", "detector", "estimators", "skip_bad", "picture", "apart")
        given = [name for name in names if getattr(self, name)]
        if given:
            raise ConfigError("these are of a benchmark", ", ".join(given), "add --benchmark reartmix")
        if self.root is not None and (self.benchmark != "artimage" or self.ablation or self.rows):
            raise ConfigError("the original images are those of a benchmark", "root", "use --benchmark artimage alone")
        if self.method != "full" and self.root is None and (self.ablation or self.benchmark):
            raise ConfigError("a benchmark and the ablation are of the method full", "method", "leave it out")
        if self.json is not None:
            check_output(self.json)
        if self.ablation:
            self._ablation()
            return
        if self.conditions and self.benchmark != "robustness":
            raise ConfigError("conditions are of a benchmark", "conditions", "use --benchmark robustness")
        figures = self._single() if self.benchmark is None else self._benchmark()
        if self.json is not None:  # it may have been read: a stopped run goes on from it
            write_atomic(self.json, _json(figures))

    def _ablation(self) -> None:
        from artperl.data.categories import ARTIMAGE
        from artperl.evaluation.ablation import run_ablation, verdict_lines

        own = ("benchmark", "rows", "real_weights", "objects", "files", "package_root", "states", "preset",
               "seen_from", "noise", "num_points")  # fmt: skip
        default = Evaluate()
        given = [name for name in own if getattr(self, name) != getattr(default, name)]
        if given:
            raise ConfigError("the ablation has objects, views and noise of its own", ", ".join(given), "leave it out")
        categories = self.category or tuple(ARTIMAGE)
        record = run_ablation(categories, self.estimator, self.partnet, self.views or 32, self.json, True, say)
        print("\n".join(verdict_lines(record)))

    def _robustness(self) -> dict[str, Any]:
        from artperl.data.categories import ARTIMAGE
        from artperl.evaluation.conditions import CONDITIONS
        from artperl.evaluation.robustness import run_robustness

        own = ("real_weights", "files", "package_root", "states", "preset", "seen_from", "noise", "num_points")
        given = [name for name in own if getattr(self, name) != getattr(Evaluate(), name)]
        if given:
            raise ConfigError("robustness has conditions of its own", ", ".join(given), "leave it out")
        sources = self.rows or (("procedural",) if self.partnet is None else ("procedural", "real"))
        return run_robustness(
            sources, self.category or tuple(ARTIMAGE), self.conditions or tuple(CONDITIONS), self.estimator,
            self.partnet, self.objects, self.views or 100, self.json, True, say,
        )  # fmt: skip

    def _benchmark(self) -> dict[str, Any]:
        from artperl.data.categories import ARTIMAGE
        from artperl.evaluation.artimage import ROWS, VIEWS
        from artperl.evaluation.benchmark import run_benchmark

        if self.root is not None:
            return self._original(self.root)
        if self.benchmark == "robustness":
            return self._robustness()
        if self.conditions or "real_all" in self.rows:
            raise ConfigError("artimage has no such rows", "conditions, rows", "use --benchmark robustness")
        if (self.states, self.preset, self.noise) != ("uniform", "artimage", "none"):
            raise ConfigError(
                "a benchmark has states, viewpoints and noise of its own", "states, preset, noise",
                "leave them out, or name an estimator instead of the benchmark",
            )  # fmt: skip
        rows = tuple(row for row in self.rows if row != "real_all") or tuple(
            row
            for row in ROWS
            if not (row == "real_trained" and self.real_weights is None)
            and not (row.startswith("real") and self.partnet is None)
        )
        for row in (row for row in ROWS if not self.rows and row not in rows):
            print(f"{row}: left out, since {'--real-weights' if self.partnet else '--partnet'} is not given")
        return run_benchmark(
            rows, self.category or tuple(ARTIMAGE), self.estimator, self.real_weights, self.partnet, self.objects,
            self.views or VIEWS, self.num_points, True, say, self.seen_from,
        )  # fmt: skip

    def _original(self, root: Path) -> dict[str, Any]:
        from artperl.data.categories import ARTIMAGE
        from artperl.evaluation.benchmark import run_original

        categories = self.category or tuple(ARTIMAGE)
        return run_original(root, categories, self.estimator, self.method, self.views, self.num_points, True, say)

    def _single(self) -> dict[str, Any]:
        from artperl.data.categories import objects_of
        from artperl.estimator import folder_of, load_estimator, read_settings
        from artperl.evaluation.artimage import match_category
        from artperl.evaluation.samples import TEST_SEEDS, frozen_samples, samples_of
        from artperl.evaluation.scoring import evaluate, object_symmetries
        from artperl.evaluation.tables import summary, table
        from artperl.methods import STORED_METHODS
        from artsim.loading.sources import find_sources

        if self.estimator is None:
            raise ConfigError("which estimator is to be tested?", "evaluate", "name its folder, or a --benchmark")
        told: dict[str, Any] = {} if self.seen_from is None else {"seen_from": self.seen_from}
        estimator = load_estimator(self.estimator, method=self.method, **told)
        stored = self.method in STORED_METHODS
        learnt = read_settings(folder_of(self.estimator))["about"]["options"] if stored else {}
        options = SampleOptions(
            self.num_points, states=StateOptions(self.states), views=ViewOptions(preset=self.preset), noise=self.noise
        )
        views, parts = self.views or 4, learnt.get("parts", "artimage")
        categories = tuple(dict.fromkeys(self.category or learnt.get("categories", estimator.categories)))
        if self.files:
            sources = find_sources(self.files, self.package_root)
            objects = [match_category(source.load(), categories, parts) for source in sources]
            samples = samples_of(objects, views, options)
        elif not categories:
            raise ConfigError("it knows objects of files, no category", "evaluate", "name them with --files")
        else:
            objects = objects_of(categories, self.objects, TEST_SEEDS, parts)
            samples = frozen_samples(categories, self.objects, views, options, parts=parts)
        figures = summary(evaluate(estimator, samples, True, object_symmetries(objects)))
        print(table(figures))
        return figures


def _json(record: Any) -> bytes:
    return (json.dumps(record, indent=1) + "\n").encode()
