"""Stage: perception learns what is true of fresh clouds."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor, nn

from artperl.core.distributed import Ranks
from artperl.core.mixed_precision import autocast
from artperl.data.batches import batches
from artperl.training.context import Context
from artperl.training.perception_losses import perception_figures, perception_losses
from artperl.training.steps import one_cycle, set_rate
from artperl.training.validation import goes_on, step_taken
from artsim.common.progress import track

_SAVE_STEPS = 100
"""Steps after which the run is saved, against a stop that nobody asked for."""


@dataclass(frozen=True)
class PerceptionStage:
    """Supervised learning of perception, with its own cycle of the learning rate.

    Attributes
    ----------
    name : str
    steps : int
        Batches.
    num_points : int
        Points of a cloud.
    batch_size : int
    seed : int
        Of the stream of clouds.
    """

    name: str
    steps: int
    num_points: int
    batch_size: int
    seed: int

    @property
    def lengths(self) -> dict[str, str]:
        """See :class:`artperl.training.stages.Stage`."""
        return {self.name: f"{self.name}_steps"}

    def run(self, context: Context) -> None:
        """Take the steps that are left."""
        options, state, ranks = context.options, context.state, context.ranks
        perception, optimizer = state.networks["perception"], state.optimizers["perception"]
        first, before = state.done[self.name], state.step - state.done[self.name]
        if not goes_on(context, self.name, self.steps):
            return
        data = batches(
            context.objects.data, context.objects.num_rows, self.num_points, self.batch_size, first, self.seed,
            context.workers, (ranks.rank, ranks.count), ranks.in_turn,
        )  # fmt: skip
        bar = track(self.name, total=self.steps, initial=first, smoothing=0.02, shown=context.progress)
        for step in range(first, self.steps):
            clouds, whole = next(data)
            own = ranks.rows(len(whole))
            clouds, truth = clouds[own].to(context.device), whole[own].to(context.device)
            set_rate(optimizer, options.perception_rate * one_cycle(step, self.steps))
            perception.train()
            with autocast(context.device, options.mixed_precision):
                perceived = perception(clouds.points)
            losses = perception_losses(perceived, truth, whole.to(context.device))
            loss = torch.stack(list(losses.values())).sum()
            optimizer.zero_grad()
            loss.backward()
            ranks.add_gradients(perception)
            nn.utils.clip_grad_norm_(perception.parameters(), 1.0)
            optimizer.step()
            figures = _of_all(ranks, losses, perception_figures(perceived, truth), context)
            context.report(self.name, figures, before + step)
            bar.set_postfix_str(f"parts {100 * figures['accuracy']:.1f} %, off {100 * figures['coordinates']:.1f} %")
            bar.update()
            if not step_taken(context, self.name, step + 1, self.steps, _SAVE_STEPS):
                break
        bar.close()


def _of_all(ranks: Ranks, losses: dict[str, Tensor], told: dict[str, float], context: Context) -> dict[str, float]:
    """Figures of the whole batch; if one process was asked to stop, all are."""
    if ranks.count == 1:
        return {name: value.item() for name, value in losses.items()} | told
    *summed, asked = ranks.add(
        [*(value.item() for value in losses.values()), *(v / ranks.count for v in told.values()), context.stop.asked]
    )
    context.stop.asked = asked > 0
    return dict(zip([*losses, *told], summed, strict=True))
