"""Steps of a network's learning: counted, saved, shown; and a stage of them on clouds and what is true, by any loss."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from artperl.core.clouds import Clouds
from artperl.core.distributed import ALONE, Ranks
from artperl.core.mixed_precision import autocast
from artperl.data.batches import batches
from artperl.data.truth import Truth
from artperl.training.context import Context
from artperl.training.steps import one_cycle, set_rate
from artperl.training.validation import goes_on, step_taken
from artsim.common.progress import track

Loss = Callable[[nn.Module, Clouds, Truth, Truth], tuple[Tensor, dict[str, float]]]
"""Of a network, clouds, their truth, and that of the batch that they are some of: what is to be low, and figures that
tell people how it learns. Both are means over the clouds, so that means of all processes add up to those of the batch.
"""

Taken = tuple[dict[str, float], str | None]
"""Of a step that was taken: figures for the curves, and a line for people where there is a new one."""

SAVE_STEPS = 100
"""Steps after which a run is saved, against a stop that nobody asked for."""


@dataclass(frozen=True)
class SupervisedStage:
    """A stage of batches of fresh clouds."""

    name: str
    """Of the stage."""
    network: str
    loss: Loss
    validated: bool = False
    """Whether the estimator is validated at intervals: where no later stage learns."""
    steps: str = "perception_steps"
    """Option that says how many batches."""
    dense: bool = False
    """Whether clouds are fewer and denser: of as many points as the estimator looks at."""

    @property
    def lengths(self) -> dict[str, str]:
        """See :class:`artperl.training.stages.Stage`."""
        return {self.name: self.steps}

    def run(self, context: Context) -> None:
        """Take the steps that are left."""
        total = getattr(context.options, self.steps)
        take_steps(context, self.name, self.network, total, self._learn, validated=self.validated)

    def _learn(self, context: Context, first: int) -> Iterator[Taken]:
        options, ranks, total = context.options, context.ranks, getattr(context.options, self.steps)
        network, optimizer = context.state.networks[self.network], context.state.optimizers[self.network]
        denser = options.denser if self.dense else 1
        data = batches(
            context.objects.data, context.objects.num_rows, denser * options.num_points,
            max(1, options.batch_size // denser), first, options.seed + (3 if self.dense else 0), context.workers,
            (ranks.rank, ranks.count), ranks.in_turn,
        )  # fmt: skip
        for step in range(first, total):
            clouds, whole = next(data)
            own = ranks.rows(len(whole))
            share, truth = (own.stop - own.start) / len(whole), whole[own].to(context.device)
            set_rate(optimizer, options.perception_rate * one_cycle(step, total))
            with autocast(context.device, options.mixed_precision):
                loss, figures = self.loss(network, clouds[own].to(context.device), truth, whole.to(context.device))
            descend(optimizer, network, share * loss, ranks)
            means = {"loss": loss.item(), **figures}
            means = dict(zip(means, ranks.add([share * value for value in means.values()]), strict=True))
            yield means, told({name: means[name] for name in ("loss", "accuracy") if name in means})


def told(figures: dict[str, float]) -> str:
    """Figures in one line for people."""
    return ", ".join(f"{name} {value:.3g}" for name, value in figures.items())


def segmentation_loss(
    network: nn.Module, clouds: Clouds, truth: Truth, whole: Truth
) -> tuple[Tensor, dict[str, float]]:
    """Cross-entropy of the parts of points."""
    logits = network(clouds.points).float()
    loss = nn.functional.cross_entropy(logits.flatten(0, 1), truth.part.flatten())
    return loss, {"accuracy": float((logits.argmax(-1) == truth.part).float().mean())}


def descend(optimizer: torch.optim.Optimizer, network: nn.Module, loss: Tensor, ranks: Ranks = ALONE) -> None:
    """One step of an optimiser down the sum of the losses that the processes have."""
    optimizer.zero_grad()
    loss.backward()
    ranks.add_gradients(network)
    nn.utils.clip_grad_norm_(network.parameters(), 1.0)
    optimizer.step()


def take_steps(
    context: Context, stage: str, network: str, total: int, learn: Callable[[Context, int], Iterator[Taken]],
    save_every: int = SAVE_STEPS, validated: bool = False,
) -> None:  # fmt: skip
    """Take the steps of a stage that are left: report each, save or validate at intervals, and stop if somebody asks.

    Parameters
    ----------
    context : Context
    stage, network : str
        Their names.
    total : int
        Steps of the stage.
    learn : callable
        Takes steps from a number on, one each time that it is asked for the next.
    save_every : int
    validated : bool
        Whether the estimator is validated at intervals: where no later stage learns.

    Raises
    ------
    KeyboardInterrupt
    """
    first, own = context.state.done[stage], context.state.networks[network]
    if not goes_on(context, stage, total):
        return
    bar = track(stage, total=total, initial=first, smoothing=0.02, shown=context.progress)
    own.train()
    for step, (figures, line) in enumerate(learn(context, first), first):
        context.report(stage, figures, step)
        if line is not None:
            bar.set_postfix_str(line)
        bar.update()
        context.stop.asked = context.ranks.add([context.stop.asked])[0] > 0
        if not step_taken(context, stage, step + 1, total, save_every, validated):
            break
    bar.close()
    own.eval()
