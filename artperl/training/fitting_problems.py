"""Fitting problems to learn from: fresh objects seen by a camera, a reference for each, a start and the goal."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from artperl.agent.actions import MOVE, NUM_AXES, SCALE, STATE, TURN, move
from artperl.core.batch import Batch
from artperl.core.pose import Theta, clamp_state, theta_from_parts
from artperl.core.shapes import Observed, Shapes
from artperl.data.sources import DataOptions
from artperl.fitting.initial_pose import resize_shapes
from artperl.retrieval.box_embedding import box_embedding
from artperl.retrieval.shape_base import ShapeBase
from artsim.observing.sample import Sample

_CHOICES = 4
"""Nearest references among which one is drawn: in use, too, the nearest is seldom the best."""

_VIEWS = 4
"""Problems in a row of the same object: an object takes longer to make than a view of it."""
_TURN, _MOVE, _SCALE = 1.0, 0.3, 0.15
"""Half-widths of what starts are off by: radians about a random axis, radii of the cloud, logarithm along each axis."""


@dataclass(frozen=True, eq=False)
class Problem(Batch):
    """B fitting problems."""

    shapes: Shapes
    """The references."""
    observed: Observed
    start: Theta
    goal: Theta


class Problems:
    """Endless, reproducible batches of problems: batch ``n`` is always the same.

    Parameters
    ----------
    data : DataOptions
    base : ShapeBase
        References are drawn from the few that are most like the object.
    batch_size, num_points : int
    seed : int
    far : float
        How far off starts are, over what they usually are.
    """

    def __init__(
        self, data: DataOptions, base: ShapeBase, batch_size: int = 64, num_points: int = 512, seed: int = 0,
        far: float = 1.0,
    ):  # fmt: skip
        self.samples = data.source(base.shapes.trees.num_rows, num_points, seed, _VIEWS)
        self.base, self.batch_size, self.seed, self.far = base, batch_size, seed, far

    def sample(self, i: int) -> Sample:
        """What problem ``i`` shows."""
        return self.samples[i]

    def __getitem__(self, n: int) -> Problem:
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + n)
        samples = [self.sample(i) for i in range(n * self.batch_size, (n + 1) * self.batch_size)]
        rows = self.base.shapes.trees.num_rows
        truth = [part_truth(sample, rows) for sample in samples]
        valid, rotation, center, size, box_center, box_size = (torch.stack(t) for t in zip(*truth, strict=True))
        query = box_embedding(valid, box_center, box_size)
        nearest, _ = self.base.nearest_objects(query, min(_CHOICES, len(self.base)))
        pick = torch.randint(nearest.shape[1], (len(nearest), 1), generator=generator)
        shapes = resize_shapes(
            self.base.shapes[nearest.gather(1, pick)[:, 0]], torch.tensor([sample.diagonal for sample in samples])
        )
        goal = theta_from_parts(shapes.trees, shapes.box_center, shapes.box_size, rotation, center, size)
        goal = Theta(**{**vars(goal), "state": clamp_state(shapes.trees, goal.state)})
        points = torch.from_numpy(np.stack([s.points for s in samples]))
        part = torch.from_numpy(np.stack([s.part for s in samples]).astype(np.int64))
        observed = Observed.of(points, part)
        radius = torch.linalg.vector_norm(points - points.mean(1, keepdim=True), dim=-1).amax(1)
        return Problem(shapes, observed, draw_starts(shapes, goal, radius, generator, self.far), goal)


def part_truth(sample: Sample, rows: int) -> tuple[Tensor, ...]:
    """Of one sample, padded to ``rows`` parts: which rows are parts; the 9D poses (rotation, box centre in the camera
    frame, box size, metres); and the boxes in the rest frame, in diagonals.
    """
    K = len(sample.joint_type)

    def pad(values: np.ndarray) -> Tensor:
        padded = np.zeros((rows, *values.shape[1:]), dtype=np.float32)
        padded[:K] = values
        return torch.from_numpy(padded)

    rotation = pad(sample.T_camera_part[:, :3, :3])
    rotation[K:] = rotation[0]
    center = (
        np.einsum("kij,kj->ki", sample.T_camera_part[:, :3, :3], sample.box_center) + sample.T_camera_part[:, :3, 3]
    )
    boxes = pad(sample.box_center / sample.diagonal), pad(sample.box_size / sample.diagonal)
    return torch.arange(rows) < K, rotation, pad(center), pad(sample.box_size), *boxes


def draw_starts(
    shapes: Shapes, goal: Theta, radius: Tensor, generator: torch.Generator, far: float = 1.0
) -> Theta:  # fmt: skip
    """Starts around goals, with the reference's own shape, and joint states anywhere in their limits."""
    B, P = shapes.trees.valid.shape
    plain = Theta(
        goal.rotation, goal.translation, goal.log_scale, goal.state, torch.zeros_like(goal.shift),
        torch.zeros_like(goal.stretch),
    )  # fmt: skip
    step = 2.0 * torch.rand(B, P, NUM_AXES, generator=generator) - 1.0
    axis = torch.nn.functional.normalize(torch.randn(B, 3, generator=generator), dim=-1)
    step[:, 0, TURN] = axis * (far * _TURN * step[:, 0, :1])
    step[:, 0, MOVE] *= far * _MOVE
    step[:, 0, SCALE] *= _SCALE
    step[:, 1:, MOVE] = 0.0
    step[:, 1:, STATE] = 0.0
    moved = move(shapes, plain, step, radius)
    trees = shapes.trees
    low = torch.where(torch.isfinite(trees.lower), trees.lower, trees.rest - torch.pi)
    high = torch.where(torch.isfinite(trees.upper), trees.upper, trees.rest + torch.pi)
    drawn = low + torch.rand(B, P, generator=generator) * (high - low)
    return Theta(**{**vars(moved), "state": torch.where(trees.free, drawn, moved.state)})
