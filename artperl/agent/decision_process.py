"""The fitting decision process: a reference is moved, step by step, onto an observed cloud (ArtPERL, section 4.3).

Batched: B environments (objects, or several starts of one) step together. :mod:`artperl.training.gym_env` wraps the
same code for gymnasium.
"""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from artperl.agent.actions import MOVE, NOTHING, TURN, action_mask, apply, expert, move, residual
from artperl.agent.part_neighbours import nearest_of_part
from artperl.core.batch import Batch
from artperl.core.pose import Theta, parent_pose, pose_parts
from artperl.core.rotations import rotate, rotation_from_vector
from artperl.core.shapes import Observed, Shapes, faces_camera

_FARTHEST = 2.0
"""Radii: most that a point counts for in the distance, and that of points whose part the other cloud does not show."""


@dataclass(frozen=True)
class FittingOptions:
    """The decision process."""

    steps: int = 12
    """Of an episode: how often each part acts."""
    eta: float = 0.5
    """Reward of a step that brings the clouds closer (equation 3)."""
    tolerance: float = 1e-4
    """Relative change of the distance that counts as none."""
    observed_points: int = 512
    """Points of the cloud that the distance is measured by, the first of all."""
    reference_points: int = 192
    """Points of each part of the reference: the first ones are spread as evenly as all."""
    seen_points: int = 256
    """Points of the cloud that the agent sees, the first of all."""
    seen_reference: int = 48
    """Points of each part of the reference that the agent sees."""


@dataclass(frozen=True, eq=False)
class View(Batch):
    """What the agent sees of B environments.

    Lengths are in radii of the observed cloud. Places and directions are the root's: from the middle of its box, along
    the axes of its rest frame, as it stands now.
    """

    observed: Tensor
    """(B, N, 3) float."""
    part: Tensor
    """(B, N) int64."""
    gap: Tensor
    """(B, N, 3) float. From each observed point to the nearest point of the reference's same part that faces the
    camera; 0 where there is none."""
    gap_normal: Tensor
    """(B, N, 3) float. Outward normal of the reference there."""
    reference: Tensor
    """(B, P, M, 3) float."""
    normal: Tensor
    """(B, P, M, 3) float."""
    shown: Tensor
    """(B, P, M) bool. Reference points that count, those whose surface faces the camera; of the others everything is
    0."""
    reference_gap: Tensor
    """(B, P, M, 3) float. From each point of the reference to the nearest observed one of its part; 0 where there is
    none."""
    frame: Tensor
    """(B, P, 3, 3) float. Axes of the rest frame as each part carries it."""
    axis: Tensor
    anchor: Tensor
    """(B, P, 3) float. Of each part's joint; the root's are 0."""
    sight: Tensor
    """(B, 3) float. Unit vector from the camera to the cloud."""
    kind: Tensor
    """(B, P) int64. Index into ``artperl.core.trees.KINDS``."""
    parent: Tensor
    """(B, P) int64."""
    valid: Tensor
    """(B, P) bool."""
    state: Tensor
    """(B, P, 2) float. Where each joint stands in its range, 0 to 1, and the range itself, in radians or radii (both 0
    where it has none)."""
    turn: Tensor
    """(B, P) bool. Parts that act next."""
    left: Tensor
    """(B, 1) float. Share of the steps that are left."""


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

    Attributes
    ----------
    distance : (B,) float
        Chamfer distance of equation 3, in radii: the mean of both directions, each point to the nearest of its part.
    """

    distance: Tensor

    def __init__(self, shapes: Shapes, observed: Observed, start: Theta, options: FittingOptions | None = None):
        self.options = options or FittingOptions()
        few = self.options.reference_points
        self.shapes = replace(shapes, points=shapes.points[:, :, :few], normals=shapes.normals[:, :, :few])
        self.observed = observed.map(lambda values: values[:, : self.options.observed_points])
        self.theta, points = start, self.observed.points
        self.center = points.mean(1)
        self.radius = torch.linalg.vector_norm(points - self.center[:, None], dim=-1).amax(1).clamp(min=1e-9)
        self.steps_taken = 0
        self._mask, self._levels = action_mask(shapes.trees), int(shapes.trees.depth.max()) + 1
        self._look()

    @property
    def mask(self) -> Tensor:
        """(B, P, 9) bool: the axes that the next step moves."""
        return self._mask & self._turn[..., None]

    @property
    def _turn(self) -> Tensor:
        """(B, P) bool: parts of the level whose turn it is."""
        depth = self.shapes.trees.depth
        return depth == self.steps_taken % (depth.amax(1, keepdim=True) + 1)

    def _look(self) -> None:
        """Pose the reference, and measure the chamfer distance."""
        self.posed = pose_parts(self.shapes.trees, self.theta, self.shapes.box_center)
        self._points = self.posed.points(self.shapes.points, self.shapes.box_center)
        self._normals = self.posed.normals(self.shapes.normals)
        self.shown = self.shapes.has_surface[..., None] & faces_camera(self._points, self._normals)
        self._near = nearest_of_part(self.observed.points, self.observed.part, self._points, self.shown)
        radius = self.radius[:, None]
        there = (self._near.there_distance / radius).clamp(max=_FARTHEST).mean(1)
        back = (self._near.back_distance / radius[..., None]).clamp(max=_FARTHEST) * self.shown
        self.distance = 0.5 * (there + back.sum((1, 2)) / self.shown.sum((1, 2)).clamp(min=1))

    def view(self) -> View:
        """What the agent sees now."""
        options, trees, posed, near = self.options, self.shapes.trees, self.posed, self._near
        few, part_few = slice(options.seen_points), slice(options.seen_reference)
        back = posed.rotation[:, :1]  # rows of vectors times a rotation turn them back
        radius = self.radius[:, None, None]
        middle = posed.center[:, :1]
        B, P, M, _ = self._points.shape
        observed, part = self.observed.points[:, few], self.observed.part[:, few]
        index, known = part * M + near.there_index[:, few], torch.isfinite(near.there_distance[:, few])[..., None]

        def at_nearest(values: Tensor) -> Tensor:
            return values.reshape(B, P * M, 3).gather(1, index[..., None].expand(-1, -1, 3))

        shown, own = self.shown[:, :, part_few, None], self._points[:, :, part_few]
        other = near.back_index[:, :, part_few]
        nearest = self.observed.points.gather(1, other.flatten(1)[..., None].expand(-1, -1, 3)).reshape(own.shape)
        met = shown & torch.isfinite(near.back_distance[:, :, part_few, None])
        parent_rotation, parent_translation = parent_pose(trees, posed)
        anchor = rotate(parent_rotation, posed.origin_rest) + parent_translation
        child = (trees.depth > 0)[..., None]
        return View(
            (observed - middle) @ back[:, 0] / radius, part,
            torch.where(known, (at_nearest(self._points) - observed) @ back[:, 0] / radius, 0.0),
            torch.where(known, at_nearest(self._normals) @ back[:, 0], 0.0),
            torch.where(shown, (own - middle[:, None]) @ back / radius[..., None], 0.0),
            torch.where(shown, self._normals[:, :, part_few] @ back, 0.0), self.shown[:, :, part_few],
            torch.where(met, (nearest - own) @ back / radius[..., None], 0.0),
            back.mT @ posed.rotation, torch.where(child, rotate(back.mT @ parent_rotation, trees.axis), 0.0),
            torch.where(child, (anchor - middle) @ back[:, 0] / radius, 0.0),
            torch.nn.functional.normalize(self.center[:, None] @ back[:, 0], dim=-1)[:, 0],
            trees.kind, trees.parent, trees.valid, self._ranges(), self._turn,
            torch.full_like(self.radius, max(0.0, 1.0 - self.steps_taken / self.num_steps))[:, None],
        )  # fmt: skip

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
        # Steps are along the axes of the place that is looked for; the goal's are turned against these.
        away[:, 0, MOVE] = rotate(rotation_from_vector(away[:, 0, TURN]), away[:, 0, MOVE])
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
    def num_steps(self) -> int:
        """Steps of an episode."""
        return self.options.steps * self._levels

    @property
    def done(self) -> bool:
        """Whether the episodes have come to their last step."""
        return self.steps_taken >= self.num_steps
