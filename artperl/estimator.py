"""From a cloud to the 9D pose of every part, in one call (ArtPERL, section 4).

Perception says which part each point belongs to and where it lies in the object's rest frame; :mod:`artperl.search`
finds the reference and the pose that explain it; :mod:`artperl.hidden` turns what hardly shows to where it would not,
:mod:`artperl.squaring` the rest as its flat surfaces face; last, a network moves the faces of its boxes to where the
cloud, seen from there, says that they are.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from torch import Tensor

from artperl.coherence import coherent
from artperl.data import Clouds
from artperl.evidence import Evidence, roughness
from artperl.grouping import grouped
from artperl.hidden import uncovered
from artperl.networks.agent import Agent
from artperl.networks.boxes import Boxes
from artperl.networks.perception import Perceived, Perception, Votes
from artperl.pose import KINDS, Posed, Theta, joint_axes, joint_states, pose_parts, reach
from artperl.retrieval import ShapeBase
from artperl.search import Clock, EstimatorOptions, Found, find
from artperl.shapes import Observed, Shapes
from artperl.squaring import squared
from artsim.errors import ArtsimError

Array = NDArray[np.float64]

_NEIGHBOURS = 8
"""Of a point, that tell how far away neighbours usually are."""
_FEW_NEIGHBOURS = 3
_OUTLIER = 6.0
"""A point with fewer neighbours than that within so many times the usual distance is an outlier: thin legs are not."""
_CELLS = 65536
"""Cells to either side of the middle, in each direction, within which points are looked for in cells."""
_CLEANED = 4096
"""Points that are looked at for outliers."""
_ENOUGH_TO_WIDEN = 32
"""Points of a part from which they say how large it is."""
_OUTERMOST = 0.004
"""Of a cloud's points, that lie too far out on each side of a part to say how large it is."""
_SEEN = 0.03
"""A place of the reference's surface is seen when an observed point of its part is that near, in diagonals."""
_BOX_POINTS = 8192
"""Points by which faces of boxes are looked for."""
_LOOKS = 2
"""Times that boxes are looked for: the first ones tell which part a point cannot be of."""
_OUTSIDE = 0.01
"""Distance out of a part's box, in diagonals, that weighs as much against a label as odds of 1 to e."""
_FEWEST = 8
"""Points below which there is nothing to fit."""


@dataclass(frozen=True)
class Calibration:
    """Confidence as a logistic function of what a fit says about itself.

    The defaults are guesses; :func:`artperl.evaluation.calibrate` fits them to a validation set.
    """

    bias: float = 2.0
    residual: float = -100.0
    """Weight of the residual, in diagonals."""
    disagreement: float = -30.0
    """Weight of the median distance between where perception and the fit place the points in the rest frame."""
    visibility: float = 10.0
    """Weight of the share of the surface that shows, of the part that shows least: what shows of others fits as well
    where that one is wrong."""

    def __call__(self, residual: float, disagreement: float, visibility: float) -> float:
        score = self.bias + self.residual * residual + self.disagreement * disagreement + self.visibility * visibility
        return float(1.0 / (1.0 + np.exp(-score)))


@dataclass(frozen=True, eq=False)
class Estimate:
    """9D poses of the K parts of one object. Camera frame, metres, radians.

    Attributes
    ----------
    rotation : (K, 3, 3) float
        Of ``T_camera_part``.
    translation : (K, 3) float
        Box centres.
    size : (K, 3) float
        Box sizes.
    T_camera_part : (K, 4, 4) float
        Maps the estimated object's rest frame, as carried by each part, to the camera.
    state : (K,) float
        0 for the root.
    joint_type : tuple of str, length K
    joint_parent : (K,) int64
    joint_axis, joint_origin : (K, 3) float
        As posed.
    part : (N,) int64
        Part of each given point; -1 for points that are not finite, or outliers.
    reference : str
        Retrieved object.
    residual : float
        Root of the mean robust squared distance of the cloud from the fitted reference, over the diagonal; parts count
        by the root of how many points they have.
    disagreement : float
        Median distance between where perception and the fit place the points in the rest frame, over the diagonal.
    visibility : (K,) float
        Share of each part's surface that is seen. A part with 0 is inferred from its joint's limits, not measured.
    confidence : float
        0 to 1.
    trajectory : (S, K, 4, 4) float
        ``T_camera_part`` at the start, after each step of the agent where it was needed, and in the end.
    milliseconds : dict
        By stage.
    """

    rotation: Array
    translation: Array
    size: Array
    T_camera_part: Array
    state: Array
    joint_type: tuple[str, ...]
    joint_parent: NDArray[np.int64]
    joint_axis: Array
    joint_origin: Array
    part: NDArray[np.int64]
    reference: str
    residual: float
    disagreement: float
    visibility: Array
    confidence: float
    trajectory: Array
    milliseconds: dict[str, float]


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

    @torch.inference_mode()
    @_one_thread()
    def __call__(self, points: ArrayLike) -> Estimate:
        """Estimate the pose of every part of the object that a cloud shows.

        Parameters
        ----------
        points : (N, 3) float
            Camera frame, metres, any N. Points that are not finite and outliers are left out.

        Raises
        ------
        ArtsimError
            When there is no object to be seen in the cloud.
        """
        clock = Clock()
        estimate, seen = self._fit(points, clock)
        if self.boxes is None:
            return estimate
        cloud, T, part = np.asarray(points, dtype=np.float64), estimate.T_camera_part, estimate.part
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
        points = np.asarray(points, dtype=np.float64)
        with clock("clean"):
            good = clean(points)
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
                found = found.ending(uncovered(found.shapes, found.refined.theta, points[few], part[few]))
        if options.squared:
            with clock("square"):
                found = found.ending(squared(found.shapes, found.refined.theta, points[few], part[few]))
        with clock("report"):
            log_odds = np.full((len(points), self.perception.num_rows), np.nan)
            log_odds[good] = _numpy(perceived.part_logits.log_softmax(-1).cpu())[index]
            trees, metres = found.shapes.trees, (perceived.log_diagonal.exp() * clouds.radius).cpu()
            seen = _Seen(
                log_odds, perceived.box_center[0].cpu() * metres, perceived.box_size[0].cpu() * metres, few,
                roughness(torch.from_numpy(points[few].astype(np.float32))),
                _numpy(trees.lower * reach(trees, found.refined.theta.log_scale))[: int(trees.valid[0].sum())],
            )  # fmt: skip
            return self._report(points, part, found, clock), seen

    def _report(self, points: Array, part: NDArray[np.int64], found: Found, clock: Clock) -> Estimate:
        """Everything about one fitted reference and labelled points, as arrays."""
        shapes, observed, theta = found.shapes, found.observed, found.refined.theta
        trees, reference = shapes.trees, found.reference
        K = int(trees.valid[0].sum())
        posed = pose_parts(trees, theta, shapes.box_center)
        axis, origin = joint_axes(trees, posed)
        poses = [_transforms(shapes, step)[:K] for step in found.path]
        shows = visibility(shapes, observed, posed)[:K]
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
        )


def _held_together(clouds: Clouds, seen: Perceived | Votes) -> Perceived | Votes:
    """What is perceived of one cloud, its labels, or votes, :func:`artperl.coherence.coherent`."""
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


def slid(estimate: Estimate, farther: Array) -> Estimate:
    """The estimate with parts that have slid farther (K,), metres, along their axes, and are where they were.

    Where they are at rest changes, and with them where everything is at rest that they carry.
    """
    T, rotation = estimate.T_camera_part.copy(), estimate.rotation
    shift = farther[:, None] * estimate.joint_axis
    for k, parent in enumerate(estimate.joint_parent):
        if parent >= 0:
            shift[k] += rotation[k] @ rotation[parent].T @ shift[parent]
    T[:, :3, 3] += shift
    trajectory = np.concatenate([estimate.trajectory[:-1], T[None]])
    return replace(estimate, T_camera_part=T, state=estimate.state + farther, trajectory=trajectory)


def labels_by_boxes(
    points: Array, T_camera_part: Array, center: Array, size: Array, log_odds: Array, distance: float
) -> NDArray[np.int64]:
    """(N,) parts of points (N, 3), given both the odds (N, P) of each part and how far out of its box a point lies.

    Parameters
    ----------
    T_camera_part : (K, 4, 4) float
    center, size : (K, 3) float
        Boxes in the rest frame, metres.
    distance : float
        Metres that weigh as much as odds of 1 to e.
    """
    out = np.stack([
        np.linalg.norm(np.maximum(np.abs((points - T[:3, 3]) @ T[:3, :3] - middle) - 0.5 * whole, 0.0), axis=1)
        for T, middle, whole in zip(T_camera_part, center, size, strict=True)
    ], axis=1)  # fmt: skip
    score = log_odds[:, : len(size)] - (out / distance) ** 2
    return np.where(np.isnan(score).any(axis=1), -1, score.argmax(axis=1))


def brought_to_rest(posed: Array, T_camera_part: Array) -> Array:
    """(K, 3) one posed point of each part, in the rest frame that its part carries (K, 4, 4)."""
    rest: Array = np.einsum("kji,kj->ki", T_camera_part[:, :3, :3], posed - T_camera_part[:, :3, 3])
    return rest


def clean(points: Array) -> NDArray[np.int64]:
    """Indices of the points that show the object: finite, and not on their own.

    Raises
    ------
    ArtsimError
        When the array is no cloud, or hardly a point is left.
    """
    if points.ndim != 2 or points.shape[1] != 3:
        raise ArtsimError(f"an array of shape {points.shape} is no cloud", "points", "pass (N, 3) points in metres")
    good = np.flatnonzero(np.isfinite(points).all(axis=1))
    if len(good) > _NEIGHBOURS:
        known = good[draw(len(good), min(_CLEANED, len(good)), np.random.default_rng(0))]
        tree = cKDTree(points[known])
        usual = np.median(tree.query(points[known[:1024]], [_NEIGHBOURS + 1])[0])
        within = max(_OUTLIER * usual, 1e-9)
        alone = ~_crowded(points[good], points[known], within)
        apart = tree.query(points[good[alone]], [_FEW_NEIGHBOURS + 1], distance_upper_bound=within)[0][:, 0]
        alone[alone] = ~np.isfinite(apart)
        good = good[~alone]
    if len(good) < _FEWEST or not np.ptp(points[good], axis=0).any():
        raise ArtsimError(
            f"{len(good)} of {len(points)} points show an object", "points", "pass a cloud of the object, in metres"
        )
    return good


def _crowded(points: Array, known: Array, within: float) -> NDArray[np.bool_]:
    """(N,) whether points share a cell, that long from corner to corner, with enough known ones: as most points do."""
    cells = [np.floor((values - np.median(known, axis=0)) * (np.sqrt(3.0) / within)) for values in (points, known)]
    number, own = (
        ((cell.clip(-_CELLS, _CELLS) + _CELLS) @ (2.0 * _CELLS + 1.0) ** np.arange(3)).astype(np.int64)
        for cell in cells
    )
    taken, count = np.unique(own, return_counts=True)
    return np.isin(number, taken[count > _FEW_NEIGHBOURS]) & (np.abs(cells[0]) < _CELLS).all(axis=1)


def draw(available: int, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """``count`` of ``available`` indices in random order, every one before any comes twice."""
    rounds = [rng.permutation(available) for _ in range(-(-count // available))]
    return np.concatenate(rounds)[:count]


def widen(rotation: Array, center: Array, size: Array, points: Array, part: NDArray[np.int64]) -> tuple[Array, Array]:
    """Boxes that hold the points of their parts, but for the outermost few on each side.

    As many are left out of a small part as of a large one: they are points of its neighbours, while the feet of a
    cabinet may be no more than a percent of its points. What is fitted is a reference's shape, which real parts stick
    out of; points never make a box smaller, since a part is seen from one side only.

    Parameters
    ----------
    rotation, center, size : (K, 3, 3), (K, 3), (K, 3) float
    points : (N, 3) float
    part : (N,) int
        -1 for points of no part.

    Returns
    -------
    center, size : (K, 3) float
    """
    center, size = center.copy(), size.copy()
    outermost = round(_OUTERMOST * len(points))
    for k in range(len(size)):
        own = points[part == k]
        if len(own) >= _ENOUGH_TO_WIDEN:
            across, left_out = np.sort((own - center[k]) @ rotation[k], axis=0), min(outermost, len(own) // 4)
            low = np.minimum(-0.5 * size[k], across[left_out])
            high = np.maximum(0.5 * size[k], across[-1 - left_out])
            center[k] += rotation[k] @ (0.5 * (low + high))
            size[k] = high - low
    return center, size


def visibility(shapes: Shapes, observed: Observed, posed: Posed) -> Array:
    """(P,) share of the surface of each part, of the first object, that has an observed point of the part near it."""
    points = posed.points(shapes.points, shapes.box_center)[0].numpy()
    seen = np.zeros(len(points))
    cloud, part = observed.points[0].numpy(), observed.part[0].numpy()
    for k in np.unique(part):
        near = cKDTree(cloud[part == k]).query(points[k], distance_upper_bound=_SEEN * float(shapes.diagonal[0]))[0]
        seen[k] = np.isfinite(near).mean()
    return seen


def _transforms(shapes: Shapes, theta: Theta) -> Array:
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    transforms = np.tile(np.eye(4), (posed.rotation.shape[1], 1, 1))
    transforms[:, :3, :3], transforms[:, :3, 3] = _numpy(posed.rotation), _numpy(posed.translation)
    return transforms


def _numpy(values: Tensor) -> Array:
    """The first row, in double precision."""
    return values[0].double().numpy()
