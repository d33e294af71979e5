"""Validation of a run on a frozen set of unseen objects, its calibration, and its test."""

import json
import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from artperl.evaluation.calibration import calibrated
from artperl.evaluation.samples import (
    NUM_POINTS,
    TEST_SEEDS,
    VALIDATION_SEEDS,
    degraded_samples,
    foreign_samples,
    frozen_samples,
    samples_of,
)
from artperl.evaluation.scoring import Scored, evaluate, evaluate_foreign, headline
from artperl.evaluation.tables import summary, table
from artperl.methods.artperl import ArtPERL
from artperl.methods.estimator_folders import read_settings
from artperl.methods.estimator_writing import save_estimator
from artperl.methods.full import Estimator
from artperl.methods.protocol import Method
from artperl.training.context import Context
from artperl.training.report import rounded, scalars, write_report
from artsim.common.files import write_atomic
from artsim.datasets.plan import SampleOptions
from artsim.errors import ArtsimError
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

log = logging.getLogger(__name__)

_AS_GOOD = 1.01
"""Of two estimators whose scores differ by less than this factor, the one that learnt longer is kept."""


@dataclass(frozen=True)
class Validation:
    """Validates the estimator of a run that has not been validated: before it learns, or where nothing is learnt."""

    name: str = "validation"
    lengths: ClassVar[dict[str, str]] = {}

    def run(self, context: Context) -> None:
        """Validate, unless another stage has."""
        if not context.state.history:
            validate(context, self.name)


@dataclass(frozen=True)
class Calibration:
    """Calibrates the confidence of the best estimator when it has learnt all: boxes decide what is right, too."""

    name: str = "calibration"
    lengths: ClassVar[dict[str, str]] = {}

    def run(self, context: Context) -> None:
        """Calibrate, unless that is done. Of several processes the first one does, while the others wait."""
        state = context.state
        if state.done[self.name]:
            return
        if context.ranks.first:
            best = context.best()
            assert isinstance(best, Estimator | ArtPERL)
            samples = unseen_samples(context, context.options.validation_views, VALIDATION_SEEDS)
            save_estimator(_calibrated(best, samples, context), context.folder.best, context.about({}))
        state.done[self.name] = context.ranks.same(1)
        context.save()


def goes_on(context: Context, stage: str, total: int) -> bool:
    """Whether a stage has steps left, and one of its last validations, as many as patience says, has gained."""
    scores = [each["score"] for each in context.state.history if each.get("stage") == stage]
    without_gain = len(scores) - 1 - scores.index(min(scores)) if scores else 0
    patience = context.options.patience
    return context.state.done[stage] < total and not 0 < patience <= without_gain


def step_taken(
    context: Context, stage: str, done: int, total: int, save_every: int, validated: bool = True
) -> bool:  # fmt: skip
    """Count a step of a stage; save or validate at intervals and at the stage's end; stop if somebody asked for it.

    Parameters
    ----------
    context : Context
    stage : str
        Its name.
    done, total : int
        Steps.
    save_every : int
    validated : bool
        Whether the estimator is worth a validation while this stage learns.

    Returns
    -------
    bool
        Whether the stage goes on.

    Raises
    ------
    KeyboardInterrupt
    """
    context.state.done[stage] = done
    if validated and (done % context.options.validate_every == 0 or done == total):
        validate(context, stage)
    elif done % save_every == 0:
        context.save()
    context.stop_if_asked()
    return goes_on(context, stage, total)


def validate(context: Context, stage: str) -> None:
    """Score the estimator on unseen objects, keep it if it is the best so far, and write where the run stands.

    Of several processes the first one does, while the others wait.
    """
    state, ranks = context.state, context.ranks
    if ranks.first:
        with context.counted("validation"):
            _validate(context, stage)
    state.best, state.history = ranks.same((state.best, state.history))


def _validate(context: Context, stage: str) -> None:
    state, options, estimator = context.state, context.options, context.estimator()
    samples = unseen_samples(context, options.validation_views, VALIDATION_SEEDS)
    scored = evaluate(estimator, samples, context.progress)
    degraded = _of_degraded(estimator, samples, context)
    figures, score = summary(scored), headline([*scored, *degraded])
    state.history.append({"stage": stage, "step": state.step, "score": score, "done": dict(state.done)})
    context.report("validation", scalars(figures) | {"score": score}, state.step)
    if score < _AS_GOOD * state.best:
        state.best = min(score, state.best)
        save_estimator(estimator, context.folder.best, context.about({"validation": figures}))
    context.save()
    if context.progress:
        log.info(f"after {dict(state.done)}: score {score:.2f}\n{table(figures)}")


def _of_degraded(estimator: Method, samples: Sequence[Sample], context: Context) -> list[Scored]:
    """What becomes of the same samples cut and dirty, where a run learns from such clouds."""
    return evaluate(estimator, degraded_samples(samples), context.progress) if context.options.degraded else []


def _calibrated(
    estimator: Estimator | ArtPERL, samples: Sequence[Sample], context: Context
) -> Estimator | ArtPERL:  # fmt: skip
    """The estimator with its confidence by how it does on samples, degraded ones, and objects of other categories."""
    options = context.options
    scored = evaluate(estimator, samples, context.progress) + _of_degraded(estimator, samples, context)
    judge = evaluate if options.votes else evaluate_foreign  # by votes, any parts are right if they are where they are
    foreign = judge(estimator, foreign_samples(context.objects.base.categories, options.foreign_categories))
    return calibrated(estimator, scored, foreign)


def test(context: Context) -> dict[str, Any]:
    """Test the best estimator on objects that had no say in which one that is; write its figures and a report.

    Beside those of a category of given objects stand the figures of the estimator that the run started from.
    """
    out, best = context.folder.path, context.best()
    samples = unseen_samples(context, context.options.test_views, TEST_SEEDS)
    scored = evaluate(best, samples, context.progress)
    figures = summary(scored)
    if context.options.name is not None and context.parent is not None:  # so that nobody takes what is worse
        before = summary(evaluate(context.parent, samples, context.progress))
        of = context.provenance["parents"][0]["name"]
        figures |= {f"{category} by {of}": values for category, values in before.items()}
    about = dict(read_settings(context.folder.best)["about"])
    about.pop("validation", None)  # these figures chose this estimator, and are no measurement of it
    save_estimator(best, context.folder.best, {**about, "test": rounded(figures)})
    write_atomic(out / "figures.json", (json.dumps(figures, indent=1) + "\n").encode())
    write_atomic(out / "table.txt", (table(figures) + "\n").encode())
    try:
        write_report(out, best, samples, scored, table(figures))
    except ArtsimError as error:  # without matplotlib there are no pictures
        log.warning(f"no report: {error}")
    return figures


def unseen_samples(context: Context, views: int, first_seed: int, noise: str | None = None) -> list[Sample]:
    """Frozen samples of objects that nothing was learnt from; where none are held out, other states and views of them.

    Parameters
    ----------
    context : Context
    views : int
        Of each object.
    first_seed : int
    noise : str, optional
        Depth sensor; by default that of the options.
    """
    options = context.options
    if options.objects:
        given = context.objects.given
        objects = given.test if first_seed == TEST_SEEDS else given.val
        return given_samples(context, objects, options.test_objects * views, first_seed, noise)
    return frozen_samples(
        options.categories, options.test_objects, views, _as_tested(context, noise), first_seed, options.parts,
        options.max_parts,
    )  # fmt: skip


def given_samples(
    context: Context, objects: Sequence[ArticulatedObject], views: int, first_seed: int, noise: str | None = None
) -> list[Sample]:
    """At least so many views of some objects, of each as many."""
    return samples_of(objects, -(-views // len(objects)), _as_tested(context, noise), first_seed)


def _as_tested(context: Context, noise: str | None) -> SampleOptions:
    sample = replace(context.options.sample, num_points=NUM_POINTS)
    return sample if noise is None else SampleOptions(**{**vars(sample), "noise": noise})
