"""A comparison of methods from nothing: each is trained, or loaded, and scored on the same views.

Every step is written down when it is done, so that a stopped comparison goes on where it stopped.
"""

import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from math import inf
from pathlib import Path
from typing import Any, Literal

from artperl.data.categories import ARTIMAGE
from artperl.evaluation.artimage import has_half, row_objects, row_samples
from artperl.evaluation.comparison import row_record
from artperl.evaluation.comparison_page import markdown
from artperl.evaluation.robotarm import ARM, arm_samples, seven_part_arm
from artperl.evaluation.samples import NUM_POINTS
from artperl.evaluation.scoring import evaluate, object_symmetries
from artperl.methods import StoredMethod
from artperl.methods.estimator_files import load_estimator
from artperl.methods.estimator_folders import WEIGHTS, folder_of
from artperl.methods.protocol import Method
from artperl.training.options import LENGTHS, PRESETS, TrainOptions, preset_of
from artperl.training.recipes import about_tested
from artperl.training.run import Training
from artperl.training.timing import filling, trained_minutes
from artsim.common.files import write_atomic
from artsim.errors import ConfigError
from artsim.export import export
from artsim.loading.urdf import load
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.runs.kept import read_kept, write_kept

Benchmark = Literal["artimage", "robotarm"]
Preset = Literal["quick", "long"]

METHODS: dict[Benchmark, tuple[StoredMethod, ...]] = {
    "artimage": ("full", "artperl", "ancsh", "omad", "sporeagent"),
    "robotarm": ("full", "artperl", "ancsh"),
}
"""Methods of a benchmark, as in the paper."""
SHIPPED = ", shipped"
"""Ends the name of the row of a method with the weights that come with the package."""
_NOISY, _DEGRADED = 0.5, 0.6
"""Shares of the clouds that trainings for the arm see with a sensor's noise; cut, dirty or sparse, as by bad masks."""
_ARM_STEPS = 6000
"""Batches that the estimator for any tree learns on from an arm."""


@dataclass(frozen=True)
class ComparisonOptions:
    """What a comparison depends on.

    Raises
    ------
    ConfigError
        When a method or a category is not of the benchmark, or there is nothing to test.
    """

    benchmark: Benchmark = "artimage"
    categories: tuple[str, ...] = ()
    """Of ArtImage; by default all. The benchmark robotarm has one."""
    arm: str = ""
    """URDF file of the arm of the benchmark robotarm; by default a procedural one of seven parts."""
    methods: tuple[StoredMethod, ...] = ()
    """By default those of the paper's table, and full."""
    preset: Preset = "long"
    """Of the trainings."""
    objects: int = 40
    """Unseen objects of each category; robotarm has one arm in other states."""
    views: int = 120
    """Of each category, at least."""
    num_points: int = NUM_POINTS
    train: dict[str, Any] | None = None
    """Other values of fields of TrainOptions, for every training."""
    minutes: float | None = None
    """Every method learns for so many minutes of one core, with the stages of the preset longer or shorter; by default
    as long as the preset has it, and the method full of ArtImage is not trained."""
    row: Literal["procedural", "real"] = "procedural"
    """Of ArtImage made anew: objects to test on. Trainings are the same, and need not be repeated."""
    partnet: str = ""
    """Folder of real objects."""

    def __post_init__(self) -> None:
        known = tuple(ARTIMAGE) if self.benchmark == "artimage" else (ARM,)
        for name, given, offered in (
            ("category", self.categories, known), ("methods", self.methods, METHODS[self.benchmark])
        ):  # fmt: skip
            wrong = set(given) - set(offered)
            if wrong:
                raise ConfigError(
                    f"{self.benchmark} has no {', '.join(sorted(wrong))}", name, f"use {', '.join(offered)}"
                )
        if self.arm and self.benchmark != "robotarm":
            raise ConfigError("only the benchmark robotarm has an arm", "arm", "leave it out, or use robotarm")
        if self.row == "real":
            if self.benchmark != "artimage":
                raise ConfigError(f"{self.benchmark} has no real objects", "row", "use --benchmark artimage")
            if not self.partnet:
                raise ConfigError("no folder of real objects is named", "partnet", "set ARTSIM_PARTNET_DIR")
            if not self.of_categories:
                raise ConfigError(f"there is no real {' or '.join(self.categories)}", "row", "use another category")
        if self.objects < 1 or self.views < 1:
            raise ConfigError("there is nothing to test", "objects, views", "use at least 1 of each")
        if self.minutes is not None and not 0.0 < self.minutes < inf:
            raise ConfigError(f"nothing is learnt in {self.minutes} minutes", "minutes", "use 10 or more")

    @property
    def of_categories(self) -> tuple[str, ...]:
        """Categories, all if none is named; of real objects, those that there are."""
        asked = self.categories or (tuple(ARTIMAGE) if self.benchmark == "artimage" else (ARM,))
        return asked if self.row == "procedural" else tuple(own for own in asked if has_half(own, "test"))

    @property
    def of_methods(self) -> tuple[StoredMethod, ...]:
        """Methods, all if none is named."""
        return self.methods or METHODS[self.benchmark]

    @property
    def suffix(self) -> str:
        """End of the names of files about this row: one folder holds both."""
        return "" if self.row == "procedural" else f"-{self.row}"


def quick_comparison(options: ComparisonOptions) -> ComparisonOptions:
    """The same benchmark with one category, trainings of seconds, and few views."""
    return replace(
        options, categories=options.of_categories[:1], preset="quick", objects=2, views=4, num_points=2048,
        train={
            "base_objects": 4, "reference_points": 48, "width": 16, "perception_steps": 8, "batch_size": 4,
            "num_points": 256, "retrieval_steps": 4, "retrieval_objects": 3, "prior_steps": 20,
            "agent_rollouts": 2, "episodes": 4, "dense_steps": 0, "box_views": 0, "test_objects": 2,
            "test_views": 1, "validation_views": 1, "foreign_categories": 1,
        },
    )  # fmt: skip


def run_comparison(
    options: ComparisonOptions, out: Path, workers: int = 1, progress: bool = True, say: Callable[[str], None] = print
) -> dict[str, Any]:  # fmt: skip
    """Train or load every method, score it, and write ``report.md`` and ``report.json``.

    Parameters
    ----------
    options : ComparisonOptions
    out : Path
        Folder of the report: ``train`` holds the trainings, ``rows`` the figures of each method on each category.
    workers : int
        Processes that make training clouds. Where methods learn for as many minutes, this process makes them itself.
    progress : bool
    say : callable
        Gets a line before and after each step, with the time that it took.

    Returns
    -------
    dict
        The content of ``report.json``.

    Raises
    ------
    ConfigError
        When the folder holds rows of other options.
    """
    steps = [(category, row) for category in options.of_categories for row in rows_of(options, category)]
    say(f"{len(steps)} rows: {', '.join(options.of_methods)} on {', '.join(options.of_categories)}")
    for category in set(replace(options, row="procedural").of_categories) - set(options.of_categories):
        say(f"{category}: no real object to test on")
    rows: dict[str, dict[str, Any]] = {category: {} for category in options.of_categories}
    tested: dict[str, tuple[list[ArticulatedObject], list[Sample]]] = {}
    for number, (category, name) in enumerate(steps, 1):
        kept = out / "rows" / f"{category}-{name.replace(SHIPPED, '-shipped')}{options.suffix}.json"
        asked = _asked(options, name)
        row = read_kept(kept, options=asked)
        if not row:
            begun = time.perf_counter()
            estimator, core_minutes = row_estimator(options, category, name, out, workers, progress, say)
            learnt = time.perf_counter() - begun
            if category not in tested:
                tested[category] = tested_views(options, category)
            objects, samples = tested[category]
            scored = evaluate(estimator, samples, progress, object_symmetries(objects))
            row = {
                "options": asked, "training_minutes": learnt / 60.0,
                "testing_minutes": (time.perf_counter() - begun - learnt) / 60.0,
                "record": row_record(scored, samples, core_minutes),
            }  # fmt: skip
            write_kept(kept, row, indent=1)
        rows[category][name] = row["record"]
        say(
            f"{number} of {len(steps)}, {name} on {category}: training {row['training_minutes']:.1f} min, test "
            f"{row['testing_minutes']:.1f} min, {_told(row['record'])}"
        )
    told = asdict(options)
    told.pop("partnet")  # a path of this machine
    report = {"options": told, "rows": rows}
    text, name = markdown(options.benchmark, rows, notes(options)), f"report{options.suffix}"
    write_kept(out / f"{name}.json", report, indent=1)
    write_atomic(out / f"{name}.md", text.encode())
    say(f"report: {out / name}.md, {name}.json")
    return report


def _told(record: dict[str, Any]) -> str:
    turns = " ".join(f"{part['rotation_deg']['mean']:.1f}" for part in record["parts"])
    return f"rotation {turns} deg, {record['seconds']:.2f} s"


def _asked(options: ComparisonOptions, name: str) -> dict[str, Any]:
    """What a row depends on, in JSON's terms."""
    own = asdict(options)
    for left_out in ("categories", "methods", "row", "partnet"):  # told by the file's name, or of this machine
        own.pop(left_out)
    own["method"] = name
    own["arm"] = load(Path(options.arm)).sha256 if options.arm else ""
    return dict(json.loads(json.dumps(own)))


def training_options(options: ComparisonOptions, category: str, method: StoredMethod, out: Path) -> TrainOptions:
    """What a method learns from, for a category of a comparison."""
    if options.benchmark == "artimage":
        own = replace(preset_of(method, options.preset), categories=(category,))
    else:
        arm = options.arm or str(arm_folder(out))
        preset = PRESETS["joint"] if method == "full" else preset_of(method, options.preset)
        own = replace(preset, categories=(), objects=(arm,), parts="any", noisy=_NOISY, degraded=_DEGRADED)
        if method == "full" and options.minutes is None:
            own = replace(own, start_from="generic", perception_steps=_ARM_STEPS)
    # The report tests each estimator itself. Stages that a method does not have stay without steps.
    own = replace(own, validation_views=1, test_views=1)
    changes = {
        name: value for name, value in (options.train or {}).items() if name not in LENGTHS or getattr(own, name)
    }
    if own.start_from is not None:
        changes.pop("width", None)  # that of the estimator that it begins with
    return replace(own, **changes)


def rows_of(options: ComparisonOptions, category: str) -> list[str]:
    """Names of the rows of a category: each method as it is trained here, then as it comes with the package."""
    rows: list[str] = []
    for method in options.of_methods:
        has_weights = options.benchmark == "artimage" and folder_of(category, method).is_relative_to(WEIGHTS)
        if options.minutes is not None or method != "full" or not has_weights:
            rows.append(method)
        if has_weights:
            rows.append(f"{method}{SHIPPED}")
    return rows


def row_estimator(
    options: ComparisonOptions, category: str, name: str, out: Path, workers: int, progress: bool,
    say: Callable[[str], None],
) -> tuple[Method, float | None]:  # fmt: skip
    """The method of a row: one that comes with the package, or one that is trained here, or was before.

    Returns
    -------
    method : Method
    core_minutes : float or None
        That it has learnt for; None of weights that come with the package.
    """
    method: StoredMethod = next(own for own in METHODS[options.benchmark] if own == name.removesuffix(SHIPPED))
    known: str = method
    if name.endswith(SHIPPED):
        return load_estimator(category, method=known), None
    folder, learning = out / "train" / f"{category}-{method}", training_options(options, category, method, out)
    if options.minutes is not None:  # processor time is counted in this process alone
        workers, learning = 0, filling(learning, options.minutes, folder.with_name(f"{folder.name}-lengths.json"))
    training = Training(learning, folder, workers, progress)
    if not about_tested(folder):
        say(f"training {method} on {category} in {folder}: after a stop, rerun the command to resume")
        training.run()
    return load_estimator(folder / "best", method=known), trained_minutes(training)


def tested_views(options: ComparisonOptions, category: str) -> tuple[list[ArticulatedObject], list[Sample]]:
    """Objects that nothing was learnt from, and views of them: always the same ones."""
    if options.benchmark == "artimage":
        objects = row_objects(options.row, category, Path(options.partnet), options.objects)
        return objects, row_samples(options.row, objects, options.views, options.num_points)
    arm = load(Path(options.arm)) if options.arm else seven_part_arm()
    return [arm], arm_samples(arm, options.views, options.num_points)


def arm_folder(out: Path) -> Path:
    """The folder of the arm's files, written if they are not there."""
    folder = out / "arm"
    if not (folder / "mobility.urdf").is_file():
        export(seven_part_arm(), folder)
    return folder


def notes(options: ComparisonOptions) -> list[str]:
    """How a report is made, for people."""
    train = "" if not options.train else f", with {json.dumps(options.train)}"
    objects = {
        "procedural": "Objects and views are made here.",
        "real": "Objects are real, of the half for testing; no method has learnt from a real one. Views are made here.",
    }[options.row]
    length = "" if options.minutes is None else f", stages scaled to {options.minutes:g} minutes of one core each"
    lines = [
        f"Trainings have the preset {options.preset}{train}{length}.",
        f"{objects} Published figures are of other images, in separate rows.",
        "Brackets have the 95 % interval of the mean, by a bootstrap over objects.",
        *(["These trainings are far too short: no figure of them says anything of a method."] if options.train else []),
        "A failure counts as 180 degrees, one diagonal and no overlap. No view is left out.",
    ]
    if options.benchmark == "artimage":
        lines.append(
            "Shipped rows have the weights that come with the package, learnt for as long as their recipes say."
        )
    else:
        lines.append(
            "One arm, learnt and tested in other states. Test clouds are of RGB-D images of an Intel D435: the arm "
            "stands among other things, and masks are not exact. Trainings see cut, dirty and noisy clouds.",
        )
    return lines
