"""The fitting decision process: a reference is moved, step by step, onto an observed cloud (ArtPERL, section 4.3).

Batched: B environments (objects, or several starts of one) step together. :mod:`artperl.training.gym_env` wraps the
same code for gymnasium.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from artperl.agent.actions import NOTHING, action_mask, apply, expert, move, residual
from artperl.core.batch import Batch
from artperl.core.pose import Posed, Theta, joint_axes, pose_parts
from artperl.core.shapes import Observed, Shapes, faces_camera
from artsim.common.compiled import compiled

Single = NDArray[np.float32]

FAR = 1e6
"""Coordinate of reference points that stand for nothing: parts without a surface."""

_FARTHEST = 2.0
"""Radii: most that one reference point counts for in the distance."""


@dataclass(frozen=True)
class FittingOptions:
    """The decision process."""

    steps: int = 12
    """Of an episode: how often each part acts."""
    eta: float = 0.5
    """Reward of a step that brings the clouds closer (equation 3)."""
    tolerance: float = 1e-4
    """Relative change of the distance that counts as none."""
    observed_points: int = 128
    """Points of the cloud that the episode sees, the first of all."""
    reference_points: int = 48
    """Points of each part of the reference: the first ones are spread as evenly as all."""


@dataclass(frozen=True, eq=False)
class View(Batch):
    """What the agent sees of B environments. Lengths are in radii of the observed cloud, about its centre.

    Attributes
    ----------
    observed : (B, N, 3) float
    part : (B, N) int64
    reference : (B, P, M, 3) float
    shown : (B, P, M) bool
        Reference points that count, those whose surface faces the camera; the others are 0.
    joint : (B, P, 6) float
        Axis, and anchor of each part's joint.
    kind : (B, P) int64
        Index into ``artperl.core.trees.KINDS``.
    parent : (B, P) int64
    valid : (B, P) bool
    state : (B, P, 2) float
        Where each joint stands in its range, 0 to 1, and the range itself, in radians or radii (both 0 where it has
        none).
    """

    observed: Tensor
    part: Tensor
    reference: Tensor
    shown: Tensor
    joint: Tensor
    kind: Tensor
    parent: Tensor
    valid: Tensor
    state: Tensor


class Fitting:
    """B episodes that step together.

    Each step moves the parts of one level of the tree, from the root to the leaves and again, so that no child makes up
    for its parent. A camera sees one side of an object: of the reference, only points whose surface faces it count, so
    that like is compared with like.

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
        self.observed = observed.map(lambda values: values[:, : self.options.observed_points])
        self.theta, points = start, self.observed.points
        self.center = points.mean(1)
        local = points - self.center[:, None]
        self.radius = torch.linalg.vector_norm(local, dim=-1).amax(1).clamp(min=1e-9)
        self._local = local / self.radius[:, None, None]
        self.steps_taken = 0
        self._mask, self._levels = action_mask(shapes.trees), int(shapes.trees.depth.max()) + 1
        self._look()

    @property
    def mask(self) -> Tensor:
        """(B, P, 9) bool: the axes that the next step moves."""
        depth = self.shapes.trees.depth
        level = self.steps_taken % (depth.amax(1, keepdim=True) + 1)
        return self._mask & (depth == level)[..., None]

    def _look(self) -> None:
        """Pose the reference, and measure the chamfer distance."""
        self.posed = pose_parts(self.shapes.trees, self.theta, self.shapes.box_center)
        points = self.posed.points(self.shapes.points, self.shapes.box_center)
        faces = faces_camera(points, self.posed.normals(self.shapes.normals))
        self.shown = self.shapes.has_surface[..., None] & faces
        local = (points - self.center[:, None, None]) / self.radius[:, None, None, None]
        self.reference = torch.where(self.shown[..., None], local, FAR)
        reference, shown = self.reference.flatten(1, 2), self.shown.flatten(1)
        there, back = nearest_distances(self._local, reference)
        back = back.clamp(max=_FARTHEST) * shown
        self.distance = 0.5 * (there.mean(1) + back.sum(1) / shown.sum(1).clamp(min=1))

    def view(self) -> View:
        """What the agent sees now."""
        reference = torch.where(self.shown[..., None], self.reference, 0.0)
        trees = self.shapes.trees
        return View(
            self._local, self.observed.part, reference, self.shown, self._joints(self.posed), trees.kind, trees.parent,
            trees.valid, self._ranges(),
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

    def missing(self, goal: Theta) -> Tensor:
        """(B, P, 9) steps that would lead to a goal at once."""
        return residual(self.shapes, self.theta, goal, self.radius)

    def place(self, goal: Theta, missing: Tensor) -> None:
        """Take a step to where steps (B, P, 9) would lead to a goal at once, as far as limits of joints allow."""
        away = -missing * action_mask(self.shapes.trees)
        self.theta = move(self.shapes, replace(goal, stretch=self.theta.stretch), away, self.radius)
        self._look()
        self.steps_taken += 1

    def step(self, action: Tensor) -> Tensor:
        """Take an action (B, P, 9), of which :attr:`mask` counts; returns the reward (B,) of equation 3."""
        before = self.distance
        action = torch.where(self.mask, action, NOTHING)
        self.theta = apply(self.shapes, self.theta, action, self.radius)
        self._look()
        self.steps_taken += 1
        return self.reward(before)

    def reward(self, before: Tensor) -> Tensor:
        """(B,) reward of the last step, before which the distance was that (B,): equation 3."""
        eta, tolerance = self.options.eta, self.options.tolerance * before
        reward = torch.where(self.distance < before - tolerance, eta, -eta)
        return torch.where((self.distance - before).abs() <= tolerance, -0.1 * eta, reward)

    @property
    def done(self) -> bool:
        """Whether the episodes have come to their last step."""
        return self.steps_taken >= self.options.steps * self._levels


def nearest_distances(points: Tensor, others: Tensor) -> tuple[Tensor, Tensor]:
    """(B, N) distances of points (B, N, 3) from the nearest of others (B, M, 3), and (B, M) the other way round."""
    if points.device.type != "cpu":
        return nearest_distance(points, others), nearest_distance(others, points)
    pairs = zip(points.detach().float().numpy(), others.detach().float().mT.contiguous().numpy(), strict=True)
    found = [_nearest_squared(*pair) for pair in pairs]
    there, back = (torch.from_numpy(np.sqrt(np.stack(values))) for values in zip(*found, strict=True))
    return there.to(points.dtype), back.to(points.dtype)


@compiled
def _nearest_squared(points: Single, others: Single) -> tuple[Single, Single]:
    """Squared distances between points (N, 3) and others (3, M), each from the nearest: (N,) and (M,).

    Bits of numbers that are not negative, taken for whole numbers, are in their order. Least whole numbers are found in
    wide registers.
    """
    N, M = len(points), others.shape[1]
    there, back, apart = np.empty(N, dtype=np.float32), np.full(M, np.inf, dtype=np.float32), np.empty(M, np.float32)
    nearest, bits = there.view(np.int32), apart.view(np.int32)
    for n in range(N):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        for m in range(M):
            dx, dy, dz = others[0, m] - x, others[1, m] - y, others[2, m] - z
            apart[m] = dx * dx + dy * dy + dz * dz
        least = np.int32(2**31 - 1)
        for m in range(M):
            least = min(least, bits[m])
            back[m] = min(back[m], apart[m])
        nearest[n] = least
    return there, back


def nearest_distance(asked: Tensor, offered: Tensor) -> Tensor:
    """(B, N) distances of points (B, N, 3) from the nearest of others (B, M, 3)."""
    square = (offered**2).sum(-1, keepdim=True)
    # |x - y|^2 less |x|^2 is one product of four numbers.
    seeking = torch.cat([-2.0 * asked, torch.ones_like(asked[..., :1])], dim=-1)
    placed = torch.cat([offered, square], dim=-1).transpose(1, 2)
    return ((seeking @ placed).amin(-1) + (asked**2).sum(-1)).clamp(min=0.0).sqrt()
