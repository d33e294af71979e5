"""The fitting decision process: a reference is moved, step by step, onto an observed cloud (ArtPERL, section 4.3).

Batched: B environments (objects, or several starts of one) step together. :mod:`artperl.envs` wraps the same code for
gymnasium.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import torch
from torch import Tensor

from artperl.actions import apply, expert
from artperl.batch import Batch
from artperl.pose import Posed, Theta, joint_axes, pose_parts
from artperl.shapes import Observed, Shapes

FAR = 1e6
"""Coordinate of reference points that stand for nothing: parts without a surface."""


@dataclass(frozen=True)
class FittingOptions:
    """The decision process."""

    steps: int = 20
    """Steps of an episode."""
    eta: float = 0.5
    """Reward of a step that brings the clouds closer (equation 3)."""
    tolerance: float = 1e-4
    """Relative change of the distance that counts as none."""
    distance: Literal["observed", "both"] = "observed"
    """Chamfer distance from the observed points to the reference only, or both ways: a partial cloud cannot be near to
    the parts of the reference that its camera did not see."""


@dataclass(frozen=True, eq=False)
class View(Batch):
    """What the agent sees of B environments. Lengths are in radii of the observed cloud, about its centre.

    Attributes
    ----------
    observed : (B, N, 3) float
    part : (B, N) int64
    offset : (B, N, 3) float
        From each observed point to the nearest reference point of its own part.
    reference : (B, P, M, 3) float
    back : (B, P, M, 3) float
        From each reference point to the nearest observed point of its own part; 0 where none is seen.
    joint : (B, P, 6) float
        Axis, and anchor of each part's joint.
    kind : (B, P) int64
        Index into ``artperl.pose.KINDS``.
    valid : (B, P) bool
    state : (B, P, 2) float
        Where each joint stands in its range, 0 to 1, and the range itself (both 0 where it has none).
    """

    observed: Tensor
    part: Tensor
    offset: Tensor
    reference: Tensor
    back: Tensor
    joint: Tensor
    kind: Tensor
    valid: Tensor
    state: Tensor


class Fitting:
    """B episodes that step together.

    Parameters
    ----------
    shapes : Shapes
        References, one for each environment.
    observed : Observed
        Segmented clouds; labels may be predicted.
    start : Theta
    options : FittingOptions, optional
    """

    def __init__(self, shapes: Shapes, observed: Observed, start: Theta, options: FittingOptions | None = None):
        self.shapes, self.observed, self.theta = shapes, observed, start
        self.options = options or FittingOptions()
        self.center = observed.points.mean(1)
        local = observed.points - self.center[:, None]
        self.radius = torch.linalg.vector_norm(local, dim=-1).amax(1).clamp(min=1e-9)
        self._local = local / self.radius[:, None, None]
        member = torch.nn.functional.one_hot(observed.part, shapes.trees.num_rows).transpose(1, 2).bool()
        self._others = ~member  # (B, P, N): points of other parts
        self._unseen = ~member.any(2)
        self.steps_taken = 0
        self._look()

    def _look(self) -> None:
        """Pose the reference, and find the nearest points both ways."""
        self.posed = pose_parts(self.shapes.trees, self.theta, self.shapes.box_center)
        points = self.posed.points(self.shapes.points, self.shapes.box_center)
        local = (points - self.center[:, None, None]) / self.radius[:, None, None, None]
        self.reference = torch.where(self.shapes.has_surface[..., None, None], local, FAR)
        B, P, M, _ = local.shape
        flat = self.reference.reshape(B, P * M, 3)
        squared = torch.baddbmm((self._local**2).sum(-1, keepdim=True), self._local, flat.transpose(1, 2), alpha=-2.0)
        squared = (squared + (flat**2).sum(-1)[:, None]).clamp(min=0.0).reshape(B, -1, P, M)
        own = squared.gather(2, self.observed.part[:, :, None, None].expand(-1, -1, 1, M))[:, :, 0]
        self._nearest = own.argmin(2)
        across = squared.permute(0, 2, 3, 1).masked_fill(self._others[:, :, None], torch.inf)
        self._back = across.argmin(3)
        self.distance = self._chamfer(squared)

    def _chamfer(self, squared: Tensor) -> Tensor:
        """(B,) chamfer distance of the whole clouds, in radii."""
        there = squared.flatten(2).amin(2).sqrt().mean(1)
        if self.options.distance == "observed":
            return there
        back = squared.amin(1).clamp(max=4.0).sqrt()
        seen = self.shapes.has_surface[..., None].to(back.dtype)
        return 0.5 * (there + (back * seen).sum((1, 2)) / (seen.sum((1, 2)) * back.shape[2]))

    def view(self) -> View:
        """What the agent sees now."""
        B, P, M, _ = self.reference.shape
        index = (self.observed.part * M + self._nearest)[..., None].expand(-1, -1, 3)
        offset = self.reference.reshape(B, P * M, 3).gather(1, index) - self._local
        nearest = self._local.gather(1, self._back.reshape(B, P * M, 1).expand(-1, -1, 3)).reshape(B, P, M, 3)
        known = ~self._unseen & self.shapes.has_surface
        back = torch.where(known[..., None, None], nearest - self.reference, 0.0)
        reference = torch.where(self.shapes.has_surface[..., None, None], self.reference, 0.0)
        return View(
            self._local, self.observed.part, offset.clamp(-2.0, 2.0), reference, back, self._joints(self.posed),
            self.shapes.trees.kind, self.shapes.trees.valid, self._ranges(),
        )  # fmt: skip

    def _joints(self, posed: Posed) -> Tensor:
        axis, anchor = joint_axes(self.shapes.trees, posed)
        return torch.cat([axis, (anchor - self.center[:, None]) / self.radius[:, None, None]], dim=-1)

    def _ranges(self) -> Tensor:
        trees = self.shapes.trees
        span = trees.upper - trees.lower
        limited = torch.isfinite(span) & (span > 0)
        share = (self.theta.state - trees.lower) / torch.where(limited, span, 1.0)
        ranges = torch.stack([share, span], dim=-1)
        return torch.where(limited[..., None], ranges, 0.0)

    def expert(self, goal: Theta) -> Tensor:
        """(B, P, 9) the expert's action towards a goal."""
        return expert(self.shapes, self.theta, goal, self.radius)

    def step(self, action: Tensor) -> Tensor:
        """Take an action (B, P, 9); returns the reward (B,) of equation 3."""
        before = self.distance
        self.theta = apply(self.shapes, self.theta, action, self.radius)
        self._look()
        self.steps_taken += 1
        eta, tolerance = self.options.eta, self.options.tolerance * before
        reward = torch.where(self.distance < before - tolerance, eta, -eta)
        return torch.where((self.distance - before).abs() <= tolerance, -0.1 * eta, reward)

    @property
    def done(self) -> bool:
        """Whether the episodes have come to their last step."""
        return self.steps_taken >= self.options.steps
