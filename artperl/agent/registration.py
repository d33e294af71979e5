"""Rigid registration of single parts by an agent (ReAgent, Bauer et al. 2021; SporeAgent, Bauer et al. 2022).

Each part of a reference is an object of its own, with a free joint and no others. It turns about the middle of its box
and moves; it does not scale.
"""

from dataclasses import dataclass, replace

import torch
from torch import Tensor, nn

from artperl.agent.actions import MOVE, NUM_AXES, SCALE
from artperl.agent.decision_process import Fitting, FittingOptions, View
from artperl.agent.policy import logits_about
from artperl.core.batch import Batch, concatenate
from artperl.core.pose import Theta, pose_parts
from artperl.core.rotations import rotate
from artperl.core.shapes import Observed, Shapes

CLOSER, ALIKE, FARTHER = 0.5, -0.1, -0.6
"""Rewards of a step that brings the clouds closer, that leaves them, and that moves them apart (ReAgent, section 3)."""
REGISTRATION = FittingOptions(steps=10, observed_points=128, reference_points=64, seen_points=128, seen_reference=64)
"""The decision process: ten steps, as the paper's."""
_FEWEST = 4
"""Points of a part below which there is nothing to register."""


class RigidFitting(Fitting):
    """Episodes of parts that do not scale, with the rewards of ReAgent."""

    @property
    def mask(self) -> Tensor:
        """(B, 1, 9) bool: turns and moves."""
        own = super().mask.clone()
        own[..., SCALE] = False
        return own

    def reward(self, before: Tensor) -> Tensor:
        """(B,) reward of the last step."""
        tolerance = self.options.tolerance * before
        reward = torch.where(self.distance < before - tolerance, CLOSER, FARTHER)
        return torch.where((self.distance - before).abs() <= tolerance, ALIKE, reward)


class RegistrationPolicy(nn.Module):
    """Policy and value: one PointNet for both clouds, a head for turns, one for moves, one for the value.

    Parameters
    ----------
    width : int
        Channels of the first layer; they double in each of four more, as in the paper, where the first has 64.
    """

    def __init__(self, width: int = 64):
        super().__init__()
        self.width = width
        layers: list[nn.Module] = [nn.Linear(3, width), nn.ReLU()]
        for level in range(4):
            layers += [nn.Linear(width << level, width << (level + 1)), nn.ReLU()]
        self.encoder = nn.Sequential(*layers)
        both = 2 * (width << 4)
        self.turn, self.move = (self._head(both, 3) for _ in range(2))
        self.value = self._head(both, 1)

    def _head(self, inputs: int, outputs: int) -> nn.Sequential:
        hidden = 8 * self.width, 4 * self.width
        return nn.Sequential(
            nn.Linear(inputs, hidden[0]), nn.ReLU(), nn.Linear(hidden[0], hidden[1]), nn.ReLU(),
            nn.Linear(hidden[1], outputs),
        )  # fmt: skip

    def forward(self, view: View) -> tuple[Tensor, Tensor]:
        """Logits (B, 1, 9, 11) of the bins, and value (B,)."""
        observed = self.encoder(view.observed).amax(1)
        # Features are not negative, so that 0 stands for points that do not count.
        reference = (self.encoder(view.reference[:, 0]) * view.shown[:, 0, :, None]).amax(1)
        both = torch.cat([observed, reference], dim=-1)
        still = both.new_zeros(len(both), NUM_AXES - MOVE.stop)
        means = torch.cat([self.turn(both), self.move(both), still], dim=1).float()
        return logits_about(means)[:, None], self.value(both)[:, 0].float()


@dataclass(frozen=True, eq=False)
class PartProblems(Batch):
    """Registration problems of single parts, R rows."""

    shapes: Shapes
    """Of one part each."""
    observed: Observed
    start: Theta
    row: Tensor
    part: Tensor
    """(R,) int64. Of which object, and which of its parts."""


def part_problems(shapes: Shapes, observed: Observed, theta: Theta, generator: torch.Generator) -> PartProblems | None:
    """Problems of those parts of B posed references that show; None when none does.

    Each has :data:`REGISTRATION`'s number of points, drawn with replacement from those of its part.
    """
    posed, count = pose_parts(shapes.trees, theta, shapes.box_center), REGISTRATION.observed_points
    problems = []
    for k in range(shapes.trees.num_rows):
        own = observed.part == k
        seen = torch.nonzero((own.sum(1) >= _FEWEST) & shapes.has_surface[:, k])[:, 0]
        if not len(seen):
            continue
        drawn = torch.multinomial(own[seen].float().cpu(), count, replacement=True, generator=generator).to(seen.device)
        points = observed.points[seen].gather(1, drawn[..., None].expand(-1, -1, 3))
        alone = shapes[seen].part(k)
        start = replace(
            Theta.at_rest(alone.trees), rotation=posed.rotation[seen, k], translation=posed.translation[seen, k],
            log_scale=theta.log_scale[seen],
        )  # fmt: skip
        part = torch.full_like(seen, k)
        problems.append(PartProblems(alone, Observed.of(points, torch.zeros_like(drawn)), start, seen, part))
    return concatenate(problems) if problems else None


def part_goals(problems: PartProblems, rotation: Tensor, center: Tensor) -> Theta:
    """Where the parts of problems truly are, with the scale that they begin with.

    Parameters
    ----------
    problems : PartProblems
    rotation, center : (B, P, 3, 3), (B, P, 3) float
        True 9D poses.
    """
    start, R = problems.start, rotation[problems.row, problems.part]
    middle = start.log_scale.exp() * problems.shapes.box_center[:, 0]
    return replace(start, rotation=R, translation=center[problems.row, problems.part] - rotate(R, middle))
