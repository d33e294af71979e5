"""The fitting decision process: a reference is moved, step by step, onto an observed cloud (ArtPERL, section 4.3).

Batched: B environments (objects, or several starts of one) step together. :mod:`artperl.training.gym_env` wraps the
same code for gymnasium.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import torch
from torch import Tensor

from artperl.agent.actions import NOTHING, action_mask, apply, expert
from artperl.core.batch import Batch
from artperl.core.pose import Posed, Theta, joint_axes, pose_parts
from artperl.core.shapes import Observed, Shapes, faces_camera

FAR = 1e6
"""Coordinate of reference points that stand for nothing: parts without a surface."""

_CACHED = 1 << 18
"""Products of points that are held at once, as far as one object lets."""


@dataclass(frozen=True)
class FittingOptions:
    """The decision process."""

    steps: int = 20
    """Steps of an episode: how often each part acts."""
    eta: float = 0.5
    """Reward of a step that brings the clouds closer (equation 3)."""
    tolerance: float = 1e-4
    """Relative change of the distance that counts as none."""
    observed_points: int = 256
    """Points of the cloud that the episode sees, the first of all."""
    reference_points: int = 64
    """Points of each part of the reference: the first ones are spread as evenly as all."""
    distance: Literal["observed", "both"] = "observed"
    """Chamfer distance from the observed points to the reference only, or both ways: a partial cloud cannot be near to
    the parts of the reference that its camera did not see."""
    facing: bool = False
    """Only reference points whose surface faces the camera count, so that like is compared with like."""
    order: Literal["at once", "root first"] = "at once"
    """Each step moves all parts; or those of one level of the tree, from the root to the leaves and again, so that no
    child makes up for its parent."""


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
    shown : (B, P, M) bool
        Reference points that count; the others are 0.
    joint : (B, P, 6) float
        Axis, and anchor of each part's joint.
    kind : (B, P) int64
        Index into ``artperl.core.pose.KINDS``.
    parent : (B, P) int64
    valid : (B, P) bool
    state : (B, P, 2) float
        Where each joint stands in its range, 0 to 1, and the range itself, in radians or radii (both 0 where it has
        none).
    """

    observed: Tensor
    part: Tensor
    offset: Tensor
    reference: Tensor
    back: Tensor
    shown: Tensor
    joint: Tensor
    kind: Tensor
    parent: Tensor
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
        self.options = options or FittingOptions()
        few = self.options.reference_points
        self.shapes = replace(shapes, points=shapes.points[:, :, :few], normals=shapes.normals[:, :, :few])
        observed = Observed(*(t[:, : self.options.observed_points] for t in vars(observed).values()))
        self.observed, self.theta = observed, start
        self.center = observed.points.mean(1)
        local = observed.points - self.center[:, None]
        self.radius = torch.linalg.vector_norm(local, dim=-1).amax(1).clamp(min=1e-9)
        self._local = local / self.radius[:, None, None]
        rows = shapes.trees.num_rows
        member = torch.nn.functional.one_hot(observed.part, rows).transpose(1, 2)
        self._unseen = member.sum(2) == 0
        # |x - y|^2 less what does not depend on the point that is sought is linear in these.
        square = (self._local**2).sum(-1, keepdim=True)
        self._sought_from = torch.cat([-2.0 * self._local, torch.ones_like(square)], dim=-1)
        elsewhere = square.transpose(1, 2) + FAR * (1 - member)
        own = torch.cat([-2.0 * self._local[:, None].expand(-1, rows, -1, -1), elsewhere[..., None]], dim=-1)
        self._sought_in = own.flatten(0, 1)  # (B P, N, 4): points of other parts are far away
        self._square = square[..., 0]
        pairs = observed.points.shape[1] * rows * self.shapes.points.shape[2]
        self._scratch = self._local.new_empty(max(_CACHED, pairs))
        self.steps_taken = 0
        self._mask = action_mask(shapes.trees)
        self._levels = 1 if self.options.order == "at once" else int(shapes.trees.depth.max()) + 1
        self._look()

    @property
    def mask(self) -> Tensor:
        """(B, P, 9) bool: the axes that the next step moves."""
        if self.options.order == "at once":
            return self._mask
        depth = self.shapes.trees.depth
        level = self.steps_taken % (depth.amax(1, keepdim=True) + 1)
        return self._mask & (depth == level)[..., None]

    def _look(self) -> None:
        """Pose the reference, and find the nearest points both ways."""
        self.posed = pose_parts(self.shapes.trees, self.theta, self.shapes.box_center)
        points = self.posed.points(self.shapes.points, self.shapes.box_center)
        local = (points - self.center[:, None, None]) / self.radius[:, None, None, None]
        self.shown = self.shapes.has_surface[..., None].expand(points.shape[:-1])
        if self.options.facing:
            self.shown = self.shown & faces_camera(points, self.posed.normals(self.shapes.normals))
        self.reference = torch.where(self.shown[..., None], local, FAR)
        B, P, M, _ = local.shape
        squared = (self.reference**2).sum(-1, keepdim=True)
        placed = torch.cat([self.reference, squared], dim=-1).reshape(B, P * M, 4)
        index, least = nearest(self._sought_from, placed, P, self._scratch)  # (B, N, P)
        self._nearest = index.gather(2, self.observed.part[..., None])[..., 0]
        asked = torch.cat([self.reference, torch.ones_like(squared)], dim=-1).flatten(0, 1)
        self._back = nearest(asked, self._sought_in, 1, self._scratch)[0].reshape(B, P, M)
        there = (least.amin(2) + self._square).clamp(min=0.0).sqrt().mean(1)
        self.distance = there if self.options.distance == "observed" else 0.5 * (there + self._unexplained(squared))

    def _unexplained(self, squared: Tensor) -> Tensor:
        """(B,) mean distance of the reference's points from the cloud, whatever their parts."""
        B, P, M, _ = squared.shape
        asked = torch.cat([self.reference, torch.ones_like(squared)], dim=-1).reshape(B, P * M, 4)
        every = torch.cat([-2.0 * self._local, self._square[..., None]], dim=-1)
        least = nearest(asked, every, 1, self._scratch)[1].reshape(B, P, M) + squared[..., 0]
        apart = least.clamp(0.0, 4.0).sqrt()
        return (apart * self.shown).sum((1, 2)) / self.shown.sum((1, 2)).clamp(min=1)

    def view(self) -> View:
        """What the agent sees now."""
        B, P, M, _ = self.reference.shape
        index = (self.observed.part * M + self._nearest)[..., None].expand(-1, -1, 3)
        offset = self.reference.reshape(B, P * M, 3).gather(1, index) - self._local
        seen = self._local.gather(1, self._back.reshape(B, P * M, 1).expand(-1, -1, 3)).reshape(B, P, M, 3)
        known = ~self._unseen[..., None] & self.shown
        back = torch.where(known[..., None], seen - self.reference, 0.0)
        reference = torch.where(self.shown[..., None], self.reference, 0.0)
        return View(
            self._local, self.observed.part, offset.clamp(-2.0, 2.0), reference, back, self.shown,
            self._joints(self.posed), self.shapes.trees.kind, self.shapes.trees.parent, self.shapes.trees.valid,
            self._ranges(),
        )  # fmt: skip

    def _joints(self, posed: Posed) -> Tensor:
        axis, anchor = joint_axes(self.shapes.trees, posed)
        return torch.cat([axis, (anchor - self.center[:, None]) / self.radius[:, None, None]], dim=-1)

    def _ranges(self) -> Tensor:
        trees = self.shapes.trees
        span = trees.upper - trees.lower
        limited = torch.isfinite(span) & (span > 0)
        share = (self.theta.state - trees.lower) / torch.where(limited, span, 1.0)
        slides = (trees.slide != 0) & (trees.turn == 0)
        length = span * self.posed.reach / self.radius[:, None]
        ranges = torch.stack([share, torch.where(slides, length, span)], dim=-1)
        return torch.where(limited[..., None], ranges, 0.0)

    def expert(self, goal: Theta) -> Tensor:
        """(B, P, 9) the expert's action towards a goal."""
        return expert(self.shapes, self.theta, goal, self.radius)

    def step(self, action: Tensor) -> Tensor:
        """Take an action (B, P, 9), of which :attr:`mask` counts; returns the reward (B,) of equation 3."""
        before = self.distance
        action = torch.where(self.mask, action, NOTHING)
        self.theta = apply(self.shapes, self.theta, action, self.radius)
        self._look()
        self.steps_taken += 1
        eta, tolerance = self.options.eta, self.options.tolerance * before
        reward = torch.where(self.distance < before - tolerance, eta, -eta)
        return torch.where((self.distance - before).abs() <= tolerance, -0.1 * eta, reward)

    @property
    def done(self) -> bool:
        """Whether the episodes have come to their last step."""
        return self.steps_taken >= self.options.steps * self._levels


def nearest(asked: Tensor, offered: Tensor, groups: int, scratch: Tensor) -> tuple[Tensor, Tensor]:
    """Least scalar products, and where they are.

    Parameters
    ----------
    asked : (B, N, C) float
    offered : (B, groups * M, C) float
    groups : int
    scratch : (S,) float
        Room for products, at least N * groups * M; more lets several objects be worked on at once.

    Returns
    -------
    index : (B, N, groups) int64
        Of the M rows of each group, the one whose product with each asked row is the least.
    least : (B, N, groups) float
    """
    B, N, _ = asked.shape
    M = offered.shape[1] // groups
    across = offered.transpose(1, 2)
    if asked.is_cuda:
        least, index = (asked @ across).unflatten(2, (groups, M)).min(-1)
        return index, least
    # A few products at a time stay in the cache, in memory that is already there; NumPy's argmin is ten times as fast
    # as torch's on a CPU.
    rows = min(len(scratch) // (N * groups * M), B)
    products = scratch[: rows * N * groups * M].view(rows, N, groups, M)
    index = torch.empty(B, N, groups, dtype=torch.int64)
    least = asked.new_empty(B, N, groups)
    for first in range(0, B, rows):
        some = slice(first, min(first + rows, B))
        part = products[: some.stop - first]
        torch.bmm(asked[some], across[some], out=part.flatten(2))
        part.numpy().argmin(-1, out=index[some].numpy())
        torch.gather(part, 3, index[some][..., None], out=least[some][..., None])
    return index, least
