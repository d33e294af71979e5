"""Stage: the network for boxes learns from the best estimator's own estimates."""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar

import numpy as np

from artperl.boxes.network import Boxes
from artperl.data.batches import SENSORS
from artperl.data.degrading import degrade
from artperl.data.sources import Source
from artperl.evaluation.samples import NUM_POINTS, VALIDATION_SEEDS
from artperl.evaluation.scoring import evaluate, mean_iou
from artperl.evaluation.tables import summary
from artperl.methods.estimator_writing import save_estimator
from artperl.methods.full import Estimator
from artperl.training.box_records import learn, record
from artperl.training.context import Context
from artperl.training.report import scalars
from artperl.training.validation import given_samples, unseen_samples
from artsim.observing.sample import Sample

log = logging.getLogger(__name__)

_VIEWS = 2
"""Views in a row of the same object."""
_NOISY_EVERY = 4
"""Views of which one is seen by a sensor: boxes go by outermost points, which suffer most."""
_DEGRADED_EVERY = 4
"""Views of which one is cut or dirty, where a run learns from such clouds."""
_DEGRADING = 4
"""Begins the seed of how a view is cut or dirty."""


@dataclass(frozen=True)
class BoxStage:
    """The best estimator gets other boxes if they are better on unseen objects, and on given ones."""

    name: str = "boxes"
    lengths: ClassVar[dict[str, str]] = {"boxes": "box_views", "box_faces": "box_steps"}

    def run(self, context: Context) -> None:
        """Record the estimates that are left, learn from them, and choose."""
        options, state = context.options, context.state
        if state.done[self.name] >= options.box_views:
            return
        best = context.best()
        assert isinstance(best, Estimator)
        learner = best_without_own_references(best, context)
        records = record(
            learner, _samples(context), options.box_views, context.folder.path / "boxes.safetensors",
            context.report, context.stop, context.workers, context.progress, options.box_residual, context.ranks,
        )  # fmt: skip
        learnt = None
        if not context.ranks.first:  # the first process learns from what all have seen
            state.done[self.name] = context.ranks.same(0)
            return
        if records is not None:
            rows = best.perception.num_rows
            records = records.to(context.device)
            learnt = learn(
                records, rows, options.box_width, options.box_steps, options.seed, context.progress, context.report
            ).cpu()  # fmt: skip
        context.stop_if_asked()
        state.done[self.name] = options.box_views
        if learnt is None:
            log.info("boxes: no estimate fits its view; they stay as they are")
        else:
            with context.counted("validation"):
                _choose(context, best, learner, learnt.half().float())  # as precise as files are
        context.save()
        context.ranks.same(state.done[self.name])


def best_without_own_references(best: Estimator, context: Context) -> Estimator:
    """The estimator as it is in use: no object that it sees is among its references."""
    return replace(best, base=context.objects.base_without_given(context.options)) if context.objects.mixed else best


def _sees_noise(context: Context) -> bool:
    """Whether some views are by a sensor: those of a run with a sensor of its own are so anyway."""
    return context.options.dataset is None and context.options.sample.noise == "none"


def _samples(context: Context) -> Callable[[int], Sample]:
    """Fresh views by number."""
    options, objects = context.options, context.objects
    num_points = options.num_points if options.dataset else NUM_POINTS
    clean = objects.data.source(objects.num_rows, num_points, options.seed + 2, _VIEWS)
    noisy: list[Source] = []
    if _sees_noise(context):
        noisy = [clean.seen_by(sensor) for sensor in SENSORS]
    return partial(_mostly_clean, clean, noisy, options.degraded > 0.0)


def _mostly_clean(clean: Source, noisy: Sequence[Source], degraded: bool, number: int) -> Sample:
    """A view by its number; some are by a sensor, and some others are degraded."""
    if noisy and number % _NOISY_EVERY == _NOISY_EVERY - 1:
        return noisy[number // _NOISY_EVERY % len(noisy)][number]
    sample = clean[number]
    if not degraded or number % _DEGRADED_EVERY != 0:
        return sample
    return degrade(sample, len(sample.points), np.random.default_rng([_DEGRADING, number]))


def _choose(context: Context, best: Estimator, learner: Estimator, boxes: Boxes) -> None:
    """Give the best estimator these boxes if the learner is better with them."""
    views = context.options.validation_views
    validation = unseen_samples(context, views, VALIDATION_SEEDS)
    if context.objects.mixed:
        validation += given_samples(context, context.objects.given.train, len(validation), VALIDATION_SEEDS)
    noisy = []
    if _sees_noise(context):
        noisy = unseen_samples(context, -(-views // _NOISY_EVERY), VALIDATION_SEEDS, SENSORS[0])
    before, after = (
        evaluate(estimator, validation + noisy, context.progress)
        for estimator in (learner, replace(learner, boxes=boxes))
    )
    figures = summary(after[: len(validation)])
    if mean_iou(after) > mean_iou(before):
        save_estimator(replace(best, boxes=boxes), context.folder.best, context.about({"validation": figures}))
    context.report("validation", scalars(figures), context.state.step)
    if context.progress:
        log.info(f"boxes: mean IoU {100 * mean_iou(before):.1f} -> {100 * mean_iou(after):.1f} %")
