"""The verb ``artperl evaluate``, and what all tests of estimators share."""

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import tyro

from artsim.common.program import Figures
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError
from artsim.loading.roots import PackageRoots
from artsim.model.draws import StateMode, StateOptions, ViewOptions, ViewPreset


@dataclass(frozen=True)
class Evaluate(Figures):
    """Test an estimator on unseen objects, procedural ones or those of files, and print the table of its errors.

    The benchmarks are separate commands: artperl artimage, robustness, reartmix, ablation.
    """

    estimator: tyro.conf.Positional[Path]
    """Folder of the estimator, or the name of one that comes with the package."""
    method: str = "full"
    """Method of the estimator: full, which comes with the package; artperl, the paper's, with weights for laptop,
    eyeglasses, dishwasher, scissors and drawer; a
    baseline that you trained (ancsh, omad, sporeagent); or one that you add (CONTRIBUTING.md)."""
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
    views: int = 4
    """Views of each object."""
    states: StateMode = "uniform"
    """In which states objects are: anywhere within their limits, at rest (shut, but for eyeglasses), at the ends, or
    mixed."""
    preset: ViewPreset = "artimage"
    """From where objects are seen."""
    seen_from: tuple[float, float] | None = None
    """Range of the camera's azimuth, for the estimator: degrees about the object's vertical, 0 for its front.
    By default unknown."""
    noise: Literal["none", "kinect_v1", "d435", "azure", "gaussian3mm"] = "none"
    """Depth sensor of the clouds."""
    num_points: int = 8192
    """Points of a cloud: pixels of the object, drawn at random."""

    def run(self) -> None:
        from artperl.data.categories import objects_of
        from artperl.evaluation.artimage import match_category
        from artperl.evaluation.samples import TEST_SEEDS, frozen_samples, samples_of
        from artperl.evaluation.scoring import evaluate, object_symmetries
        from artperl.evaluation.tables import summary, table
        from artperl.methods import STORED_METHODS
        from artperl.methods.estimator_files import load_estimator
        from artperl.methods.estimator_folders import folder_of, read_settings
        from artsim.loading.sources import find_sources

        told: dict[str, Any] = {} if self.seen_from is None else {"seen_from": self.seen_from}
        estimator = load_estimator(self.estimator, method=self.method, **told)
        stored = self.method in STORED_METHODS
        learnt = read_settings(folder_of(self.estimator))["about"].get("options", {}) if stored else {}
        options = SampleOptions(
            self.num_points, states=StateOptions(self.states), views=ViewOptions(preset=self.preset), noise=self.noise
        )
        parts = learnt.get("parts", "artimage")
        named = learnt.get("name")
        known = () if named else learnt.get("categories", estimator.categories)
        categories = tuple(dict.fromkeys(self.category or known))
        if self.files:
            sources = find_sources(self.files, self.package_root)
            objects = [match_category(source.load(), categories, parts) for source in sources]
            objects = [
                replace(obj, category=named or obj.object_id) if named or obj.category == "unknown" else obj
                for obj in objects
            ]
            samples = samples_of(objects, self.views, options)
        elif not categories:
            raise ConfigError("it knows objects of files, no category", "evaluate", "name them with --files")
        else:
            objects = objects_of(categories, self.objects, TEST_SEEDS, parts)
            samples = frozen_samples(categories, self.objects, self.views, options, parts=parts)
        figures = summary(evaluate(estimator, samples, True, object_symmetries(objects)))
        self.say(table(figures))
        self.finish(figures)
