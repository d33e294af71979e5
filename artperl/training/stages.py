"""What a run of each method learns: its networks, its stages in their order, and the estimator that they make."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Protocol

from torch import nn

from artperl.core.category_prior import CategoryPrior
from artperl.fitting.options import EstimatorOptions
from artperl.methods.full import Estimator
from artperl.methods.protocol import Stored
from artperl.perception.network import Perception
from artperl.training.ancsh_stages import ancsh_estimator, ancsh_run_networks, ancsh_stages
from artperl.training.boxes import BoxStage
from artperl.training.context import Context
from artperl.training.objects import TrainingObjects
from artperl.training.omad_stages import omad_estimator, omad_run_networks, omad_stages
from artperl.training.options import TrainOptions
from artperl.training.paper_stages import paper_estimator, paper_networks, paper_stages
from artperl.training.perception_losses import perception_loss
from artperl.training.sporeagent_stages import sporeagent_estimator, sporeagent_run_networks, sporeagent_stages
from artperl.training.supervised import SupervisedStage
from artperl.training.validation import Calibration, Validation


class Stage(Protocol):
    """A part of a run. It counts its steps in ``context.state.done[name]`` and goes on where it stopped."""

    @property
    def name(self) -> str: ...

    @property
    def lengths(self) -> Mapping[str, str]:
        """Options that say how many steps it learns in, by the groups of figures that it reports, one at each step."""
        ...

    def run(self, context: Context) -> None: ...


def _anything(objects: TrainingObjects) -> None:
    """A method that learns from any objects."""


def _one_tree(objects: TrainingObjects) -> CategoryPrior:
    """A method that learns one kinematic tree."""
    return CategoryPrior.of(objects.base.shapes, objects.base.kind)


@dataclass(frozen=True)
class Programme:
    """What a run of a method learns."""

    networks: Callable[[TrainOptions, int], dict[str, nn.Module]]
    """New networks by name, from the options and the number of rows for parts. Each gets an optimiser."""
    stages: Callable[[TrainOptions], list[Stage]]
    """The stages, in their order."""
    estimator: Callable[[Context], Estimator | Stored]
    """The estimator that the networks of a context make as they stand."""
    check: Callable[[TrainingObjects], object] = _anything
    """Raises ConfigError when the method cannot learn from these objects."""


def stages_of(options: TrainOptions) -> list[Stage]:
    """The stages of a run, in their order."""
    return PROGRAMMES[options.method].stages(options)


def _full_networks(options: TrainOptions, num_rows: int) -> dict[str, nn.Module]:
    return {"perception": Perception(num_rows, options.width, options.votes)}


def _full_stages(options: TrainOptions) -> list[Stage]:
    """Perception on clouds of few points, then on denser ones, fewer at a time; boxes; the confidence.

    Another estimator that it starts from is the first that is validated, and stays where nothing better is learnt.
    """
    learn = partial(SupervisedStage, network="perception", loss=perception_loss, validated=True)
    dense = learn("dense", steps="dense_steps", dense=True)
    start = [] if options.start_from is None else [Validation("start")]
    return [*start, learn("perception"), dense, Validation(), BoxStage(), Calibration()]


def _full_estimator(context: Context) -> Estimator:
    """With the parent's boxes, if parts are found as the parent finds them."""
    perception, parent, options = context.state.networks["perception"], context.parent, context.options
    assert isinstance(parent, Estimator | None)
    assert isinstance(perception, Perception)
    alike = parent is not None and parent.perception.votes == perception.votes
    return Estimator(
        perception, context.objects.base, EstimatorOptions(num_points=options.denser * options.num_points),
        boxes=parent.boxes if parent is not None and alike else None,
    )  # fmt: skip


PROGRAMMES = {
    "full": Programme(_full_networks, _full_stages, _full_estimator),
    "artperl": Programme(paper_networks, paper_stages, paper_estimator),
    "ancsh": Programme(ancsh_run_networks, ancsh_stages, ancsh_estimator, _one_tree),
    "omad": Programme(omad_run_networks, omad_stages, omad_estimator, _one_tree),
    "sporeagent": Programme(sporeagent_run_networks, sporeagent_stages, sporeagent_estimator),
}
"""By the name of the method."""
