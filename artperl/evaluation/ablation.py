"""What each stage of an estimate brings: the same estimator without it, on the same views of validation objects.

A row is a category, a source of objects, a view and a noise. A stage earns its place when, without it, a mean over the
views of a category and source is worse by its margin and by more than twice the standard error of the paired
differences.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, Literal

import numpy as np
import torch
from numpy.typing import NDArray

from artperl.data.categories import objects_of
from artperl.evaluation.artimage import real_objects
from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.metrics import METRICS
from artperl.evaluation.samples import NUM_POINTS, VALIDATION_SEEDS, samples_of
from artperl.evaluation.scoring import Scored, score
from artperl.methods.full import Estimator
from artperl.retrieval.shape_base import ShapeBase
from artsim.common.progress import track
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError
from artsim.model.draws import ViewOptions, ViewPreset
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.runs.kept import read_kept, write_kept

Array = NDArray[np.float64]
Change = Callable[[Estimator], Estimator]
Record = dict[str, dict[str, list[list[float]]]]
"""``{row: {variant: a list of the figures of MARGINS for each view}}``."""

MARGINS = {"rotation_deg": 0.1, "iou_exact": 0.01, "right": 0.01}
"""Least loss of a mean that counts: 0.1 degree, a point of exact IoU, one per cent of the views right."""
_CERTAIN = 2.0
"""Standard errors that a loss must exceed."""

WHOLE = "whole"
_VIEWS: tuple[ViewPreset, ...] = ("artimage", "sphere")
_NOISE: tuple[Literal["none", "d435"], ...] = ("none", "d435")


def _options(**options: Any) -> Change:
    """Other options of the estimator."""
    return lambda whole: replace(whole, options=replace(whole.options, **options))


def _refinement(**options: Any) -> Change:
    """Other options of its refinement."""
    return lambda whole: _options(refine=replace(whole.options.refine, **options))(whole)


STAGES: dict[str, Change] = {
    "label smoothing": _options(label_smoothing=False),
    "retrieval of the nearest reference": lambda whole: replace(whole, base=permute_references(whole.base)),
    "more than one reference": _options(references=1),
    "beam search": _options(beam=0),
    "outline term": _refinement(outline_weight=0.0),
    "normal alignment": _options(normal_alignment=False),
    "network for boxes": lambda whole: replace(whole, boxes=None),
}
"""Changes that take a stage away, by the stage. A new stage is one line."""


def permute_references(base: ShapeBase) -> ShapeBase:
    """A base that finds any object with the right kinematic tree, instead of the nearest one."""
    assert base.embeddings is not None
    kinds = [(tree.types, tuple(tree.parents)) for tree in base.trees]
    rng, rows = np.random.default_rng(0), np.arange(len(base))
    for kind in dict.fromkeys(kinds):
        own = np.array([row for row, other in enumerate(kinds) if other == kind])
        rows[own] = rng.permutation(own)
    return base.with_embeddings(base.embeddings[torch.from_numpy(rows)])


@dataclass(frozen=True)
class Loss:
    """How much worse the means of one category and source are without a stage."""

    mean: dict[str, float]
    error: dict[str, float]
    """Of the paired differences, worse is positive, and their standard errors; keys of :data:`MARGINS`."""

    @property
    def large(self) -> list[str]:
        """Figures whose loss reaches its margin."""
        return [name for name, margin in MARGINS.items() if self.mean[name] >= margin]

    @property
    def certain(self) -> list[str]:
        """Of these, the ones whose loss is not chance."""
        return [name for name in self.large if self.mean[name] > _CERTAIN * self.error[name]]


def run_ablation(
    categories: Sequence[str],
    weights: Path | None = None,
    partnet: Path | None = None,
    views: int = 32,
    out: Path | None = None,
    progress: bool = False,
    say: Callable[[str], None] = print,
    stages: Mapping[str, Change] = STAGES,
) -> Record:
    """Score the whole estimator and those without one stage on every row, and print the losses of each row.

    Parameters
    ----------
    categories : sequence of str
    weights : Path, optional
        Folder of estimators; by default those that come with the package.
    partnet : Path, optional
        Folder of real objects; without it, rows are of procedural objects.
    views : int
        Of a row, at least.
    out : Path, optional
        JSON file, written after each row. What it holds already is not measured again.
    progress : bool
    say : callable
        Gets the lines.
    stages : mapping
        Stages that are taken away: :data:`STAGES`.

    Raises
    ------
    ConfigError
        When the file has rows of another number of views.
    """
    record: Record = read_kept(out)
    for category in categories:
        whole = find_estimator(weights, category)
        variants = {WHOLE: whole} | {name: change(whole) for name, change in stages.items()}
        for row, objects, options in rows_of(category, views, partnet):
            done = record.setdefault(row, {})
            each = -(-views // len(objects))
            if any(len(figures) != each * len(objects) for figures in done.values()):
                raise ConfigError(f"{row} has other views than {each * len(objects)}", str(out), "name another file")
            missing = {name: variant for name, variant in variants.items() if name not in done}
            if missing:
                samples = samples_of(objects, each, options, VALIDATION_SEEDS)
                record[row] = done | _score_variants(missing, samples, row, progress)
                write_kept(out, record)
            say("\n".join([row, *loss_lines({row: record[row]})]))
    return record


def _score_variants(
    variants: Mapping[str, Estimator], samples: Sequence[Sample], row: str, progress: bool
) -> dict[str, list[list[float]]]:
    """Figures of each view, view by view: a slow hour of the machine slows all variants."""
    figures: dict[str, list[list[float]]] = {name: [] for name in variants}
    for sample in track(row, samples, unit="view", leave=False, shown=progress):
        for name, variant in variants.items():
            figures[name].append(_figures(score(variant, sample)))
    return figures


def _figures(scored: Scored) -> list[float]:
    """Figures of one view, those of :data:`MARGINS`: means over its parts."""
    return [float(scored.right if name == "right" else scored.errors[name].mean()) for name in MARGINS]


def rows_of(
    category: str, views: int, partnet: Path | None
) -> Iterator[tuple[str, Sequence[ArticulatedObject], SampleOptions]]:
    """Name, objects for validation and samples' options of each row of a category."""
    sources: dict[str, Sequence[ArticulatedObject]] = {"procedural": objects_of([category], views, VALIDATION_SEEDS)}
    if partnet is not None and (real := real_objects(category, "train", partnet)):
        sources["real"] = real
    for (source, objects), preset, noise in product(sources.items(), _VIEWS, _NOISE):
        options = SampleOptions(num_points=NUM_POINTS, views=ViewOptions(preset=preset), noise=noise)
        yield f"{category} {source} {preset} {noise}", objects, options


def losses(record: Record) -> dict[str, dict[str, Loss]]:
    """Losses by stage, and by the category and source whose rows they are of.

    Views are paired row by row, so that a stage may lack rows that the file of a stopped run does not have yet.
    """
    sign = np.array([1.0 if name in METRICS and METRICS[name].less_is_better else -1.0 for name in MARGINS])
    pooled: dict[str, dict[str, list[Array]]] = {}
    for row, variants in record.items():
        for stage in (name for name in variants if name != WHOLE):
            worse = sign * (np.array(variants[stage]) - np.array(variants[WHOLE]))
            pooled.setdefault(stage, {}).setdefault(" ".join(row.split()[:2]), []).append(worse)
    return {
        stage: {group: _loss(np.concatenate(rows)) for group, rows in groups.items()}
        for stage, groups in pooled.items()
    }


def _loss(worse: Array) -> Loss:
    """Mean and standard error of paired differences (views, figures)."""
    error = worse.std(axis=0, ddof=1) / np.sqrt(len(worse)) if len(worse) > 1 else np.full(len(MARGINS), np.inf)
    return Loss(
        dict(zip(MARGINS, worse.mean(axis=0).tolist(), strict=True)), dict(zip(MARGINS, error.tolist(), strict=True))
    )


def verdict(groups: Mapping[str, Loss]) -> str:
    """Whether a stage stays: some loss is large and certain; goes: none is large; else more views have to tell."""
    if any(loss.certain for loss in groups.values()):
        return "stays"
    return "unclear" if any(loss.large for loss in groups.values()) else "goes"


def loss_lines(record: Record) -> list[str]:
    """One line for each stage, category and source: what is lost without the stage, and its standard error."""
    return [
        f"  {stage:36s}{group:24s}"
        + "  ".join(f"{name} {loss.mean[name]:+.3f} +- {loss.error[name]:.3f}" for name in MARGINS)
        for stage, groups in losses(record).items()
        for group, loss in groups.items()
    ]


def verdict_lines(record: Record) -> list[str]:
    """One line for each stage: its verdict, and the categories and sources where it earns its place."""
    return [
        f"{stage:38s}{verdict(groups):9s}" + ", ".join(name for name, loss in groups.items() if loss.certain)
        for stage, groups in losses(record).items()
    ]
