"""From a cloud to the 9D pose of every part, in one call (ArtPERL, section 4).

Perception says which part each point belongs to and where it lies in the object's rest frame;
:mod:`artperl.fitting.search` finds the reference and the pose that explain it; :mod:`artperl.fitting.occluded_parts`
turns what hardly shows to where it would not, :mod:`artperl.fitting.normal_alignment` the rest as its flat surfaces
face; last, a network moves the faces of its boxes to where the cloud, seen from there, says that they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from torch import Tensor

from artperl.agent.policy import Agent
from artperl.boxes.evidence import Evidence, roughness
from artperl.boxes.network import Boxes
from artperl.core.clouds import Clouds
from artperl.core.estimate import Calibration, Estimate, brought_to_rest, labels_by_boxes, slid, visibility, widen
from artperl.core.pose import KINDS, Theta, joint_axes, joint_states, pose_parts, reach
from artperl.core.shapes import Shapes
from artperl.fitting.normal_alignment import align_normals
from artperl.fitting.occluded_parts import pose_occluded_parts
from artperl.fitting.search import Clock, EstimatorOptions, Found, find
from artperl.perception.cloud_checks import cloud_warnings
from artperl.perception.label_smoothing import coherent
from artperl.perception.network import Perceived, Perception, Votes
from artperl.perception.part_grouping import grouped
from artperl.perception.preprocess import as_cloud, clean, draw
from artperl.retrieval.part_names import part_names
from artperl.retrieval.shape_base import ShapeBase

Array = NDArray[np.float64]

_BOX_POINTS = 8192
"""Points by which faces of boxes are looked for."""
_LOOKS = 2
"""Times that boxes are looked for: the first ones tell which part a point cannot be of."""
_OUTSIDE = 0.01
"""Distance out of a part's box, in diagonals, that weighs as much against a label as odds of 1 to e."""


@dataclass(frozen=True, eq=False)
class _Seen:
    """What is kept of perception once a cloud is fitted.

    Attributes
    ----------
    log_odds : (N, P) float
        Of each point to be of each part; NaN for outliers.
    box_center, box_size : (P, 3) float
        In the rest frame, metres.
    chosen : (M,) int64
        Points by which faces of boxes are looked for.
    roughness : () float
        Of these, metres.
    lower : (K,) float
        Least states of the joints, radians or metres.
    """

    log_odds: Array
    box_center: Tensor
    box_size: Tensor
    chosen: NDArray[np.int64]
    roughness: Tensor
    lower: Array


@contextmanager
def _one_thread() -> Iterator[None]:
    """Torch works on one thread.

    An estimate is thousands of small operations. A second thread hardly helps with them, and where another process has
    its core, all wait for it: four times as long.
    """
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(threads)


@dataclass(eq=False)
class Estimator:
    """Everything that is needed to estimate poses of a category, or of several.

    An estimate takes one thread of the processor, so that several processes may estimate side by side.

    Parameters
    ----------
    perception : Perception
    base : ShapeBase
    agent : Agent, optional
        Without one, references are refined from where perception puts them.
    options : EstimatorOptions, optional
    calibration : Calibration, optional
    boxes : Boxes, optional
        Without one, boxes are the reference's, widened to hold the points.
    """

    name: ClassVar[str] = "full"
    perception: Perception
    base: ShapeBase
    agent: Agent | None = None
    options: EstimatorOptions = field(default_factory=EstimatorOptions)
    calibration: Calibration = field(default_factory=Calibration)
    boxes: Boxes | None = None

    def __post_init__(self) -> None:
        self.perception.eval()
        self.base = self.base.to(self.perception.device)
        if self.boxes is not None:
            self.boxes.to(self.perception.device)

    @property
    def categories(self) -> tuple[str, ...]:
        """Categories of the references."""
        return tuple(dict.fromkeys(self.base.categories))

    @torch.inference_mode()
    @_one_thread()
    def __call__(self, points: ArrayLike) -> Estimate:
        """Estimate the pose of every part of the object that a cloud shows.

        Parameters
        ----------
        points : (N, 3) float
            Camera frame, metres, any N. Points that are not finite, or at exactly 0 0 0, and outliers are left out.
            What looks wrong with the cloud, such as its unit, is said in ``Estimate.warnings``.

        Raises
        ------
        ArtsimError
            When there is no object to be seen in the cloud.
        """
        clock = Clock()
        estimate, seen = self._fit(points, clock)
        if self.boxes is None:
            return estimate
        cloud, T, part = as_cloud(points), estimate.T_camera_part, estimate.part
        with clock("boxes"):
            for _ in range(_LOOKS):
                evidence, unit = _evidence(cloud, replace(estimate, part=part), seen, self.boxes.num_rows)
                boxes = self.boxes(evidence.to(self.perception.device))
                center, size, farther = (_numpy(values.cpu() * unit)[: len(estimate.size)] for values in boxes)
                part = labels_by_boxes(cloud, T, center, size, seen.log_odds, _OUTSIDE * unit)
        posed = np.einsum("kij,kj->ki", T[:, :3, :3], center) + T[:, :3, 3]
        farther = np.maximum(farther, np.minimum(seen.lower - estimate.state, 0.0))
        return slid(replace(estimate, translation=posed, size=size, part=part), farther)

    @torch.inference_mode()
    @_one_thread()
    def examined(self, points: ArrayLike) -> tuple[Estimate, Evidence, float]:
        """What :attr:`boxes` learn from: an estimate that goes without them, the evidence, and its unit in metres."""
        estimate, seen = self._fit(points, Clock())
        return estimate, *_evidence(points, estimate, seen, self.perception.num_rows)

    def perceive(self, clouds: Clouds, clock: Clock) -> Perceived:
        """What is perceived of one cloud."""
        with clock("perception"):
            seen = self.perception(clouds.points)
        if self.options.coherent:
            with clock("coherence"):
                seen = _held_together(clouds, seen)
        if not isinstance(seen, Votes):
            return seen
        with clock("grouping"):
            return grouped(seen)

    def _fit(self, points: ArrayLike, clock: Clock) -> tuple[Estimate, _Seen]:
        """The estimate whose boxes are the reference's, and what it goes by."""
        options = self.options
        points = as_cloud(points)
        with clock("clean"):
            good = clean(points)
            warnings = cloud_warnings(points, good)
            chosen = draw(len(good), options.num_points, np.random.default_rng(0))
            cloud = torch.from_numpy(points[good[chosen]].astype(np.float32))[None].to(self.perception.device)
            clouds = Clouds.of(cloud)
        perceived = self.perceive(clouds, clock)
        found = find(cloud, clouds, perceived, self.base, self.agent, options, clock).to("cpu")
        with clock("report"):
            index = cKDTree(found.observed.points[0].numpy()).query(points[good], workers=1)[1]
            part = np.full(len(points), -1)
            part[good] = found.observed.part[0].numpy()[index]
            few = good[draw(len(good), min(_BOX_POINTS, len(good)), np.random.default_rng(0))]
        if options.uncovered:
            with clock("uncover"):
                found = found.ending(pose_occluded_parts(found.shapes, found.refined.theta, points[few], part[few]))
        if options.squared:
            with clock("square"):
                found = found.ending(align_normals(found.shapes, found.refined.theta, points[few], part[few]))
        with clock("report"):
            log_odds = np.full((len(points), self.perception.num_rows), np.nan)
            log_odds[good] = _numpy(perceived.part_logits.log_softmax(-1).cpu())[index]
            trees, metres = found.shapes.trees, (perceived.log_diagonal.exp() * clouds.radius).cpu()
            seen = _Seen(
                log_odds, perceived.box_center[0].cpu() * metres, perceived.box_size[0].cpu() * metres, few,
                roughness(torch.from_numpy(points[few].astype(np.float32))),
                _numpy(trees.lower * reach(trees, found.refined.theta.log_scale))[: int(trees.valid[0].sum())],
            )  # fmt: skip
            return replace(self._report(points, part, found, clock), warnings=warnings), seen

    def _report(self, points: Array, part: NDArray[np.int64], found: Found, clock: Clock) -> Estimate:
        """Everything about one fitted reference and labelled points, as arrays."""
        shapes, observed, theta = found.shapes, found.observed, found.refined.theta
        trees, reference = shapes.trees, found.reference
        K = int(trees.valid[0].sum())
        posed = pose_parts(trees, theta, shapes.box_center)
        axis, origin = joint_axes(trees, posed)
        poses = [_transforms(shapes, step)[:K] for step in found.path]
        shows = visibility(shapes, observed, posed)[:K]
        limits = torch.stack([trees.lower, trees.upper], dim=-1)
        limits = torch.where((trees.turn == 0)[..., None], limits * reach(trees, theta.log_scale)[..., None], limits)
        rotation, center = _numpy(posed.rotation)[:K], _numpy(posed.center)[:K]
        translation, size = widen(rotation, center, _numpy(shapes.box_size * posed.scale)[:K], points, part)
        return Estimate(
            rotation=rotation,
            translation=translation,
            size=size,
            T_camera_part=poses[-1],
            state=_numpy(joint_states(trees, theta))[:K],
            joint_type=tuple(KINDS[k] for k in trees.kind[0, :K].tolist()),
            joint_parent=np.where(np.arange(K) == 0, -1, trees.parent[0, :K].numpy()),
            joint_axis=_numpy(axis)[:K],
            joint_origin=_numpy(origin)[:K],
            part=part,
            reference=f"{self.base.categories[reference]}:{self.base.object_ids[reference]}",
            residual=found.residual,
            disagreement=found.disagreement,
            visibility=shows,
            confidence=self.calibration(found.residual, found.disagreement, shows.min()),
            trajectory=np.stack(poses),
            milliseconds=clock.milliseconds,
            part_names=part_names(self.base, reference, shapes),
            joint_limits=_numpy(limits)[:K],
        )


def _held_together(clouds: Clouds, seen: Perceived | Votes) -> Perceived | Votes:
    """What is perceived of one cloud, its labels, or votes, :func:`artperl.perception.label_smoothing.coherent`."""
    points, diagonal = _numpy(clouds.points.cpu()), float(seen.log_diagonal.exp()[0])

    def together(values: Tensor) -> Tensor:
        return torch.from_numpy(coherent(points, _numpy(values.cpu()), diagonal))[None]

    if not isinstance(seen, Votes):
        logits = together(seen.part_logits.softmax(-1)).clamp(min=1e-6).log()
        return replace(seen, part_logits=logits.to(seen.part_logits))
    level = seen.level_logits.softmax(-1)
    moves = 1.0 - level[..., :1]
    said = torch.cat([seen.box, seen.joint], dim=-1)
    every = together(torch.cat([level, moves * said, level[..., :1] * said], dim=-1)).to(said)
    level, moving, still = every.split([level.shape[2], said.shape[2], said.shape[2]], dim=2)
    # What moves and what does not are no mean of each other, where a walk goes from one to the other.
    root = level.argmax(-1, keepdim=True) == 0
    said = torch.where(root, still / level[..., :1], moving / level[..., 1:].sum(-1, keepdim=True))
    return replace(seen, level_logits=level.clamp(min=1e-6).log(), box=said[..., :6], joint=said[..., 6:])


def _evidence(points: ArrayLike, estimate: Estimate, seen: _Seen, rows: int) -> tuple[Evidence, float]:
    """Evidence of one estimate, padded to that many parts, and its unit in metres."""
    T, K = estimate.T_camera_part, len(estimate.size)
    slides = np.array(estimate.joint_type)[:, None] == "prismatic"
    arrays = (
        np.asarray(points)[seen.chosen], T, np.where(slides, estimate.joint_axis, 0.0),
        brought_to_rest(estimate.translation, T), estimate.size,
    )  # fmt: skip
    cloud, poses, axis, center, size = (torch.from_numpy(values.astype(np.float32)) for values in arrays)
    part = torch.from_numpy(estimate.part[seen.chosen])
    evidence, unit = Evidence.of(
        cloud, part, poses, axis, center, size, seen.box_center[:K], seen.box_size[:K], seen.roughness
    )  # fmt: skip
    return evidence.padded(rows), float(unit)


def _transforms(shapes: Shapes, theta: Theta) -> Array:
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    transforms = np.tile(np.eye(4), (posed.rotation.shape[1], 1, 1))
    transforms[:, :3, :3], transforms[:, :3, 3] = _numpy(posed.rotation), _numpy(posed.translation)
    return transforms


def _numpy(values: Tensor) -> Array:
    """The first row, in double precision."""
    return values[0].double().numpy()
