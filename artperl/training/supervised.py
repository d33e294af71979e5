"""A network that learns from clouds and what is true of them, by any loss."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from artperl.core.clouds import Clouds
from artperl.data.batches import batches
from artperl.data.truth import Truth
from artperl.training.context import Context
from artperl.training.steps import autocast, one_cycle, set_rate
from artsim.common.progress import track

Loss = Callable[[nn.Module, Clouds, Truth], tuple[Tensor, dict[str, float]]]
"""Of a network, clouds and their truth: what is to be low, and figures that tell people how it learns."""

SAVE_STEPS = 100
"""Steps after which a run is saved, against a stop that nobody asked for."""


@dataclass(frozen=True)
class SupervisedStage:
    """A stage of ``perception_steps`` batches of fresh clouds.

    Attributes
    ----------
    name : str
        Of the stage.
    network : str
    loss : Loss
    """

    name: str
    network: str
    loss: Loss

    def run(self, context: Context) -> None:
        """Take the steps that are left."""
        options, total = context.options, context.options.perception_steps
        network, optimizer = context.state.networks[self.network], context.state.optimizers[self.network]
        first = context.state.done[self.name]
        if first >= total:
            return
        data = batches(
            context.objects.data, context.objects.num_rows, options.num_points, options.batch_size, first, options.seed,
            context.workers,
        )  # fmt: skip
        bar = track(self.name, total=total, initial=first, smoothing=0.02, shown=context.progress)
        network.train()
        for step in range(first, total):
            clouds, truth = next(data)
            set_rate(optimizer, options.perception_rate * one_cycle(step, total))
            with autocast(context.device, options.mixed_precision):
                loss, figures = self.loss(network, clouds.to(context.device), truth.to(context.device))
            descend(optimizer, network, loss)
            context.report(self.name, {"loss": loss.item(), **figures}, step)
            bar.set_postfix_str(", ".join(f"{name} {value:.3g}" for name, value in figures.items()))
            bar.update()
            count_step(context, self.name, step + 1, SAVE_STEPS)
        bar.close()
        network.eval()


def segmentation_loss(network: nn.Module, clouds: Clouds, truth: Truth) -> tuple[Tensor, dict[str, float]]:
    """Cross-entropy of the parts of points."""
    logits = network(clouds.points).float()
    loss = nn.functional.cross_entropy(logits.flatten(0, 1), truth.part.flatten())
    return loss, {"accuracy": float((logits.argmax(-1) == truth.part).float().mean())}


def descend(optimizer: torch.optim.Optimizer, network: nn.Module, loss: Tensor) -> None:
    """One step of an optimiser."""
    optimizer.zero_grad()
    loss.backward()
    nn.utils.clip_grad_norm_(network.parameters(), 1.0)
    optimizer.step()


def count_step(context: Context, stage: str, done: int, save_every: int) -> None:
    """Count a step of a stage, save at intervals, and stop if somebody has asked for it.

    Raises
    ------
    KeyboardInterrupt
    """
    context.state.done[stage] = done
    if done % save_every == 0:
        context.save()
    context.stop_if_asked()
