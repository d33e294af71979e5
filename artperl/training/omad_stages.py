"""Stages that OMAD learns in: the prior of keypoints and joints, then what clouds say (Xue et al. 2021)."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from artperl.core.clouds import Clouds
from artperl.core.mixed_precision import autocast
from artperl.core.shapes import Shapes
from artperl.data.batches import row_batches
from artperl.data.sources import Source
from artperl.data.truth import Truth, to_batch
from artperl.methods.omad import OMAD, omad_networks, state_range
from artperl.methods.protocol import NetworkSizes
from artperl.perception.omad_networks import (
    Cues,
    KeypointPrior,
    quaternion_error,
    quaternion_of_rotation,
    rotation_of_quaternion,
)
from artperl.training.context import Context
from artperl.training.options import TrainOptions
from artperl.training.steps import one_cycle, set_rate
from artperl.training.supervised import Taken, descend, take_steps, told
from artperl.training.validation import Validation
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

CHAMFER, COVERAGE, SURFACE, JOINT, SEPARATION, REGULAR = 1.0, 1.0, 5.0, 1.0, 2.0, 0.01
"""Weights of the prior's losses, the paper's."""
KEYPOINT, SEGMENTATION, BASE, STATE, SHAPE, CUE_JOINT, CUE_REGULAR = 5.0, 1.0, 0.2, 5.0, 3.0, 3.0, 0.01
"""Weights of the network's losses, the paper's."""
_APART = 0.03
"""Diagonals that keypoints of a part are to be apart."""
_NOISE = 0.003
"""Metres by which points are blurred, as in the paper."""
_SURFACE_POINTS = 48
"""Points of each part by which the prior knows an object."""
_PRIOR_RATE = 3e-3


def omad_run_networks(options: TrainOptions, num_rows: int) -> dict[str, nn.Module]:
    """New networks of the method, by name."""
    return omad_networks(NetworkSizes(num_rows, options.width))


def omad_estimator(context: Context) -> OMAD:
    """The method as the networks of a run stand."""
    own: dict[str, Any] = context.state.networks
    return OMAD(own["keypoint_prior"], own["cues"], context.objects.base)


@dataclass(frozen=True)
class PriorStage:
    """Keypoints and joints of the references at rest."""

    name: str = "prior"
    lengths: ClassVar[dict[str, str]] = {"prior": "prior_steps"}

    def run(self, context: Context) -> None:
        """Take the steps that are left."""
        take_steps(context, self.name, "keypoint_prior", context.options.prior_steps, self._learn)

    def _learn(self, context: Context, first: int) -> Iterator[Taken]:
        options, shapes = context.options, context.objects.base.shapes
        prior, optimizer = context.state.networks["keypoint_prior"], context.state.optimizers["keypoint_prior"]
        assert isinstance(prior, KeypointPrior)
        if first == 0:  # mirrors and mean joints are read from the references, not learnt
            begun = omad_networks(NetworkSizes(context.objects.num_rows, options.width), context.objects.base)
            prior.mirrored.copy_(begun["keypoint_prior"].mirrored)
            prior.joint.copy_(begun["keypoint_prior"].joint)
            with torch.no_grad():
                prior.mean.add_(shapes.box_center.mean(0)[:, None].to(prior.mean))
        for step in range(first, options.prior_steps):
            generator = torch.Generator().manual_seed((options.seed << 32) + step)
            rows = torch.randint(len(shapes), (options.batch_size,), generator=generator)
            set_rate(optimizer, _PRIOR_RATE * one_cycle(step, options.prior_steps))
            loss, figures = prior_loss(prior, shapes[rows].to(context.device), generator)
            descend(optimizer, prior, loss)
            yield {"loss": loss.item(), **figures}, f"loss {loss.item():.4f}"


@dataclass(frozen=True)
class CueStage:
    """Keypoints, pose, states and shape of fresh clouds."""

    name: str = "cues"
    lengths: ClassVar[dict[str, str]] = {"cues": "perception_steps"}

    def run(self, context: Context) -> None:
        """Take the steps that are left."""
        take_steps(context, self.name, "cues", context.options.perception_steps, self._learn, validated=True)

    def _learn(self, context: Context, first: int) -> Iterator[Taken]:
        options, total, device = context.options, context.options.perception_steps, context.device
        method = omad_estimator(context)
        network, optimizer = context.state.networks["cues"].train(), context.state.optimizers["cues"]
        data = row_batches(
            context.objects.data, context.objects.num_rows, options.num_points, options.batch_size, first, options.seed,
            context.workers, ObjectRows(context.objects.num_rows),
        )  # fmt: skip
        for step in range(first, total):
            rows = next(data)
            clouds, truth = to_batch(rows)
            generator = torch.Generator().manual_seed((options.seed << 32) + step)
            noise = _NOISE * torch.randn(clouds.points.shape, generator=generator) / clouds.scale[:, None, None]
            set_rate(optimizer, options.perception_rate * one_cycle(step, total))
            with autocast(device, options.mixed_precision):
                cues: Cues = network((clouds.points + noise).to(device))
            targets = cue_targets(method, clouds, rows, device)
            loss, figures = cue_loss(method, cues, truth.to(device), targets)
            descend(optimizer, network, loss)
            yield {"loss": loss.item(), **figures}, told(figures)


def omad_stages(options: TrainOptions) -> list[Any]:
    """The stages, in their order."""
    return [PriorStage(), CueStage(), Validation()]


def prior_loss(prior: KeypointPrior, shapes: Shapes, generator: torch.Generator) -> tuple[Tensor, dict[str, float]]:
    """How badly keypoints stand for parts: for their points, their boxes and their joints."""
    few = torch.randperm(shapes.points.shape[2], generator=generator)[:_SURFACE_POINTS]
    beta = prior.encode(shapes.points[:, :, few])
    keypoints, (axis, place) = prior.keypoints(beta), prior.joint_rows(beta)
    apart = torch.cdist(keypoints, shapes.points)
    to_surface, to_keypoints = apart.amin(-1).mean(), apart.amin(-2).mean()
    half = 0.5 * shapes.box_size
    coverage = (keypoints.amin(2) - (shapes.box_center - half)).abs().mean() + (
        keypoints.amax(2) - (shapes.box_center + half)
    ).abs().mean()
    between = torch.cdist(keypoints, keypoints) + torch.eye(keypoints.shape[2], device=keypoints.device)
    separation = (_APART - between.amin(-1)).clamp(min=0.0).mean()
    joint = joint_error(axis, place, shapes)
    loss = (
        CHAMFER * (to_surface + to_keypoints) + COVERAGE * coverage + SURFACE * to_surface + JOINT * joint
        + SEPARATION * separation + REGULAR * beta.square().mean()
    )  # fmt: skip
    return loss, {"coverage": coverage.item(), "surface": to_surface.item(), "joint": joint.item()}


def joint_error(axis: Tensor, place: Tensor, shapes: Shapes) -> Tensor:
    """Mean difference of axes (B, K, 3), and of hinges' distance from places (B, K, 3)."""
    trees = shapes.trees
    moving = (trees.valid & (trees.depth > 0)).float()
    count = moving.sum().clamp(min=1.0)
    away = place - trees.origin
    away = away - (away * trees.axis).sum(-1, keepdim=True) * trees.axis
    off = torch.linalg.vector_norm(away + 1e-9, dim=-1) * (trees.turn != 0)
    return ((torch.linalg.vector_norm(axis - trees.axis, dim=-1) + off) * moving).sum() / count


@dataclass
class ObjectRows:
    """What the network learns besides :class:`artperl.data.truth.Truth`: the object's surface, and true poses."""

    num_rows: int
    _object: ArticulatedObject | None = None
    _surface: Any = None

    def __call__(self, source: Source, i: int, sample: Sample) -> dict[str, Any]:
        """Rows of sample ``i`` of a source; views of one object follow one another."""
        obj = source.object(i)
        if obj is not self._object:
            shapes = Shapes.from_objects([obj.with_diagonal(1.0)], _SURFACE_POINTS, self.num_rows)
            self._object, self._surface = obj, shapes.points[0].numpy()
        K = len(sample.joint_type)
        T = np.tile(np.eye(4, dtype=np.float32), (self.num_rows, 1, 1))
        T[:K] = sample.T_camera_part
        slides = np.array(sample.joint_type) == "prismatic"
        state = np.zeros(self.num_rows, dtype=np.float32)
        state[:K] = np.where(slides, sample.joint_state / sample.diagonal, sample.joint_state)
        return {"surface": self._surface, "T_camera_part": T, "state": state}


@dataclass(frozen=True, eq=False)
class CueTargets:
    """What :class:`artperl.perception.omad_networks.Cues` are to be, and the states (B, K) in the tree's units."""

    keypoints: Tensor
    quaternion: Tensor
    translation: Tensor
    state: Tensor
    beta: Tensor


@torch.no_grad()
def cue_targets(method: OMAD, clouds: Clouds, rows: dict[str, Tensor], device: torch.device) -> CueTargets:
    """The prior's keypoints of each true object, as truly posed."""
    surface, T = rows["surface"].to(device), rows["T_camera_part"].to(device)
    beta = method.keypoint_prior.encode(surface)
    metres = method.keypoint_prior.keypoints(beta) * rows["diagonal"].to(device)[:, None, None, None]
    posed = metres @ T[:, :, :3, :3].mT + T[:, :, None, :3, 3]
    center, scale = clouds.center.to(device), clouds.scale.to(device)
    return CueTargets(
        keypoints=(posed - center[:, None, None]) / scale[:, None, None, None],
        quaternion=quaternion_of_rotation(T[:, 0, :3, :3]),
        translation=(T[:, 0, :3, 3] - center) / scale[:, None],
        state=rows["state"].to(device), beta=beta,
    )  # fmt: skip


def cue_loss(method: OMAD, cues: Cues, truth: Truth, targets: CueTargets) -> tuple[Tensor, dict[str, float]]:
    """How far what is said of clouds is from the truth. Slides count in diagonals, hinges in radians."""
    trees = method.trees(cues.beta.device, len(cues))
    free = trees.free.float()
    keypoint = torch.linalg.vector_norm(cues.keypoints - targets.keypoints, dim=-1).mean()
    segmentation = functional.cross_entropy(cues.part_logits.flatten(0, 1), truth.part.flatten())
    base = quaternion_error(cues.quaternion, targets.quaternion).mean() + torch.linalg.vector_norm(
        cues.translation - targets.translation, dim=-1
    ).mean() + (cues.log_diagonal - truth.diagonal.log()).abs().mean()  # fmt: skip
    low, span = state_range(trees)
    state = ((low + cues.state * span - targets.state).abs() * free).sum() / free.sum().clamp(min=1.0)
    shape = (cues.beta - targets.beta).abs().mean()
    (axis, place), (true_axis, true_place) = (
        method.keypoint_prior.joint_rows(beta) for beta in (cues.beta, targets.beta)
    )
    joint = ((axis - true_axis).abs() + (place - true_place).abs()).mean()
    loss = (
        KEYPOINT * keypoint + SEGMENTATION * segmentation + BASE * base + STATE * state + SHAPE * shape
        + CUE_JOINT * joint + CUE_REGULAR * cues.beta.square().mean()
    )  # fmt: skip
    with torch.no_grad():
        cosine = (rotation_of_quaternion(cues.quaternion) * rotation_of_quaternion(targets.quaternion)).sum((1, 2))
        degrees = (0.5 * (cosine - 1.0)).clamp(-1.0, 1.0).acos().rad2deg().median()
    right = float((cues.part_logits.argmax(-1) == truth.part).float().mean())
    return loss, {"accuracy": right, "keypoint": keypoint.item(), "state": state.item(), "degrees": degrees.item()}
