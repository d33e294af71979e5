"""Ground truth of many objects at once, as tensors whose rows beyond an object's parts are zero."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from artsim.envs.maniskill.goal import APART, LEAST_OPEN, MOST_OPEN, Goal
from artsim.envs.maniskill.places import T_world_object, handle
from artsim.model.draws import farther_ends, joint_intervals
from artsim.model.joints import JOINT_TYPES, ROTATING
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject

Record = dict[str, Tensor]


@dataclass(frozen=True, eq=False)
class Truth:
    """What does not change while B objects stand before their cameras: at most P parts each."""

    fixed: Record
    """Rows, as :func:`artsim.observing.padding.pad_sample` names them: ``part_valid (B, P)`` and ``joint_type``,
    ``joint_parent``, ``joint_axis``, ``joint_origin``, ``joint_rest``, ``joint_limits``, ``box_center``, ``box_size``,
    and for each object ``scale``, ``diagonal``, ``T_world_object (B, 4, 4)``."""
    free: Tensor
    """(B, P) bool. Joints whose state can be chosen."""
    low: Tensor
    high: Tensor
    far: Tensor
    """(B, P) float. Range of each joint, half a turn either way where it turns freely, and its end that is farther from
    rest."""
    rotates: Tensor
    turns_freely: Tensor
    """(B, P) bool."""
    handle: Tensor
    """(B, P, 3) float. Where to take hold of each part, rest frame, at rest; see
    :func:`artsim.envs.maniskill.goal.handle`."""
    mimic: Tensor
    mimic_offset: Tensor
    """(B, P, P) and (B, P) float. ``q = mimic @ q + mimic_offset`` completes a state."""

    @property
    def rows(self) -> int:
        """P."""
        return int(self.free.shape[1])

    def complete_state(self, q: Tensor) -> Tensor:
        """(B, P) states with every joint that follows another set; see :meth:`KinematicTree.complete_state`."""
        return torch.einsum("bij,bj->bi", self.mimic, q) + self.mimic_offset

    def error(self, q: Tensor, goal: Tensor) -> Tensor:
        """(B, P) signed way from states to goals over each joint's range; 0 for joints that cannot be chosen."""
        way = goal - q
        around = torch.remainder(way + torch.pi, 2 * torch.pi) - torch.pi
        way = torch.where(self.turns_freely, around, way)
        return torch.where(self.free, way / (self.high - self.low).clamp(min=1e-9), 0.0)

    def openness(self, q: Tensor) -> Tensor:
        """(B,) as :func:`artsim.physics.episode.openness` tells it."""
        rest = self.fixed["joint_rest"]
        share = (q - rest).abs() / (self.far - rest).abs().clamp(min=1e-9)
        return torch.where(self.free, share, 0.0).sum(1) / self.free.sum(1).clamp(min=1)

    def posed(self, T_world_part: Tensor, T_camera_world: Tensor) -> Record:
        """What follows from where parts and cameras are: poses and joints in the camera frame.

        Parameters
        ----------
        T_world_part : (B, P, 4, 4) float
            Maps the rest frame, as carried by each part, to the world; anything in rows beyond an object's parts.
        T_camera_world : (B, 4, 4) float
            OpenCV axes.
        """
        T_world_part = torch.where(self.fixed["part_valid"][:, :, None, None], T_world_part, 0.0)
        T = T_camera_world[:, None] @ T_world_part
        axis, origin = self.posed_joints(T)
        return {
            "T_world_part": T_world_part,
            "T_camera_part": T,
            "joint_axis_camera": axis,
            "joint_origin_camera": origin,
        }

    def posed_joints(self, T_frame_part: Tensor) -> tuple[Tensor, Tensor]:
        """(B, P, 3) axes and origins, carried by the parents of their parts into the frame that the poses map to."""
        parent = self.fixed["joint_parent"].clamp(min=0)[:, :, None, None].expand(-1, -1, 4, 4)
        carrier = torch.gather(T_frame_part, 1, parent)
        axis = (carrier[..., :3, :3] @ self.fixed["joint_axis"][..., None])[..., 0]
        origin = (carrier[..., :3, :3] @ self.fixed["joint_origin"][..., None])[..., 0] + carrier[..., :3, 3]
        valid = self.fixed["part_valid"][..., None]
        return torch.where(valid, axis, 0.0), torch.where(valid, origin, 0.0)

    def handles(self, T_world_part: Tensor) -> tuple[Tensor, Tensor]:
        """(B, P, 3) where handles are in the world, and the directions (unit or zero) that opening joints move them."""
        at = (T_world_part[..., :3, :3] @ self.handle[..., None])[..., 0] + T_world_part[..., :3, 3]
        axis, origin = self.posed_joints(T_world_part)
        turned = torch.nn.functional.normalize(torch.linalg.cross(axis, at - origin, dim=-1), dim=-1)
        return at, torch.where(self.rotates[..., None], turned, axis)


def truth_of(objects: Sequence[ArticulatedObject], max_joints: int, device: Any) -> Truth:
    """Static ground truth of objects with up to ``max_joints`` joints, each of which stands on the ground."""
    rows = max_joints + 1

    def stack(of: Callable[[ArticulatedObject], Any], dtype: torch.dtype = torch.float32) -> Tensor:
        return torch.from_numpy(np.stack([_pad(np.asarray(of(obj)), rows) for obj in objects])).to(device, dtype)

    def each(of: Callable[[ArticulatedObject], Any]) -> Tensor:
        return torch.tensor(np.array([of(obj) for obj in objects]), dtype=torch.float32, device=device)

    trees = {obj: obj.tree for obj in objects}
    intervals = {obj: joint_intervals(obj) for obj in objects}
    fixed = {
        "part_valid": stack(lambda obj: np.ones(len(obj), dtype=bool), torch.bool),
        "joint_type": stack(lambda obj: [JOINT_TYPES.index(kind) for kind in trees[obj].types], torch.int64),
        "joint_parent": stack(lambda obj: trees[obj].parents, torch.int64),
        "joint_axis": stack(lambda obj: trees[obj].axes),
        "joint_origin": stack(lambda obj: trees[obj].origins),
        "joint_rest": stack(lambda obj: trees[obj].rest),
        "joint_limits": stack(lambda obj: trees[obj].limits),
        "box_center": stack(lambda obj: obj.box_center),
        "box_size": stack(lambda obj: obj.box_size),
        "scale": each(lambda obj: obj.scale),
        "diagonal": each(lambda obj: obj.diagonal),
        "T_world_object": each(T_world_object),
    }
    return Truth(
        fixed,
        free=stack(lambda obj: np.isin(np.arange(len(obj)), trees[obj].free_joints), torch.bool),
        low=stack(lambda obj: intervals[obj][:, 0]),
        high=stack(lambda obj: intervals[obj][:, 1]),
        far=stack(farther_ends),
        rotates=stack(lambda obj: [kind in ROTATING for kind in trees[obj].types], torch.bool),
        turns_freely=stack(lambda obj: [kind == "continuous" for kind in trees[obj].types], torch.bool),
        handle=stack(lambda obj: [handle(obj, k) for k in range(len(obj))]),
        mimic=torch.stack([_mimic(obj, rows)[0] for obj in objects]).to(device),
        mimic_offset=torch.stack([_mimic(obj, rows)[1] for obj in objects]).to(device),
    )


def start_and_goal(goal: Goal, truth: Truth, draw: Tensor) -> tuple[Tensor, Tensor]:
    """(B, P) joint states at which episodes begin, and which are to be reached, from (2, B, P) uniform draws."""
    rest, span = truth.fixed["joint_rest"], truth.high - truth.low
    if goal == "random":
        share = torch.remainder(draw[0] + APART + (1.0 - 2.0 * APART) * draw[1], 1.0)
        start, end = truth.low + draw[0] * span, truth.low + share * span
    else:
        opened = rest + (LEAST_OPEN + (MOST_OPEN - LEAST_OPEN) * draw[0]) * (truth.far - rest)
        start, end = (rest, opened) if goal == "open" else (opened, rest)
    return truth.complete_state(start), truth.complete_state(end)


def _pad(array: Array, rows: int) -> Array:
    padded = np.zeros((rows, *array.shape[1:]), dtype=array.dtype)
    padded[: len(array)] = array
    return padded


def _mimic(obj: ArticulatedObject, rows: int) -> tuple[Tensor, Tensor]:
    """(P, P) and (P,) that complete a state."""
    offset = obj.tree.complete_state(np.zeros(len(obj)))
    columns = obj.tree.complete_state(np.eye(len(obj))) - offset  # row j: what joint j moves
    matrix = np.zeros((rows, rows))
    matrix[: len(obj), : len(obj)] = columns.T
    return torch.from_numpy(matrix).float(), torch.from_numpy(_pad(offset, rows)).float()
