"""From a cloud to the 9D pose of every part, in one call (ArtPERL, section 4).

Perception says which part each point belongs to and where it lies in the object's rest frame; the references most like
the object are placed by that, moved on by the agent, and refined as one batch; the best is refined to the end.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree
from torch import Tensor

from artperl.batch import concatenate
from artperl.data import Clouds
from artperl.embedding import box_embedding
from artperl.fitting import Fitting, FittingOptions
from artperl.networks.agent import Agent
from artperl.networks.perception import Perceived, Perception
from artperl.pose import KINDS, Posed, Theta, joint_axes, joint_states, pose_parts
from artperl.refine import Refined, RefineOptions, refine
from artperl.retrieval import ShapeBase
from artperl.shapes import Observed, Shapes
from artperl.start import start
from artsim.errors import ArtsimError

Array = NDArray[np.float64]

_NEIGHBOURS = 8
_OUTLIER = 6.0
"""A point whose neighbours are that many times as far away as is usual is an outlier."""
_CLEANED = 4096
"""Points that are looked at for outliers."""
_SEEN = 0.03
"""A place of the reference's surface is seen when an observed point of its part is that near, in diagonals."""
_LABEL_DISTANCE = 0.03
"""Distance from the fitted part, in diagonals, that weighs as much against a label as odds of 1 to e."""
_FEWEST = 8
"""Points below which there is nothing to fit."""


@dataclass(frozen=True)
class EstimatorOptions:
    """The pipeline."""

    num_points: int = 1024
    """Points that perception sees."""
    early_points: int = 256
    """Of these, points by which the best start is found."""
    fit_points: int = 1024
    """Of these, points that the best one is fitted to."""
    references: int = 3
    """References that are tried, the nearest first."""
    agent_steps: int = 8
    """Steps of the agent from each start; 0 goes without it."""
    early_iterations: int = 6
    """Iterations of every start, before the best one is kept."""
    refine: RefineOptions = field(default_factory=RefineOptions)
    """The last refinement."""


@dataclass(frozen=True)
class Calibration:
    """Confidence as a logistic function of what a fit says about itself.

    The defaults are guesses; :func:`artperl.evaluation.calibrate` fits them to a validation set.
    """

    bias: float = 4.0
    residual: float = -100.0
    """Weight of the residual, in diagonals."""
    disagreement: float = -30.0
    """Weight of the median distance between where perception and the fit place the points in the rest frame."""

    def __call__(self, residual: float, disagreement: float) -> float:
        score = self.bias + self.residual * residual + self.disagreement * disagreement
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
        Root of the mean robust squared distance of the cloud from the fitted reference, over the diagonal.
    disagreement : float
        Median distance between where perception and the fit place the points in the rest frame, over the diagonal.
    visibility : (K,) float
        Share of each part's surface that is seen. A part with 0 is inferred from its joint's limits, not measured.
    confidence : float
        0 to 1.
    trajectory : (S, K, 4, 4) float
        ``T_camera_part`` at the start, after each step of the agent, and after refinement.
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


@dataclass(eq=False)
class Estimator:
    """Everything that is needed to estimate poses of a category, or of several.

    Parameters
    ----------
    perception : Perception
    base : ShapeBase
    agent : Agent, optional
        Without one, references are refined from where perception puts them.
    options : EstimatorOptions, optional
    calibration : Calibration, optional
    """

    perception: Perception
    base: ShapeBase
    agent: Agent | None = None
    options: EstimatorOptions = field(default_factory=EstimatorOptions)
    calibration: Calibration = field(default_factory=Calibration)

    def __post_init__(self) -> None:
        self.perception.eval()

    @torch.inference_mode()
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
        options, clock = self.options, _Clock()
        points = np.asarray(points, dtype=np.float64)
        with clock("clean"):
            good = clean(points)
            rng = np.random.default_rng(0)
            chosen = draw(len(good), options.num_points, rng)
            cloud = torch.from_numpy(points[good[chosen]].astype(np.float32))[None]
        with clock("perception"):
            clouds = Clouds.of(cloud)
            perceived = self.perception(clouds.points)
        with clock("start"):
            query = box_embedding(perceived.valid, perceived.box_center, perceived.box_size)
            rows = self.base.nearest(query, min(options.references, len(self.base)))[0][0]
            shapes, theta = start(clouds, perceived, self.base.shapes[rows], len(rows))
            some = Observed.of(cloud[:, : options.fit_points], perceived.part[:, : options.fit_points])
            observed = some.map(lambda tensor: tensor[:, : options.early_points]).repeat(len(rows))
            steps = [theta]
        with clock("agent"):
            if self.agent is not None and options.agent_steps:
                steps += greedy_steps(self.agent, shapes, observed, theta, options.agent_steps)
                shapes, observed = concatenate([shapes, shapes]), concatenate([observed, observed])
                theta = concatenate([theta, steps[-1]])
        with clock("refine"):
            early = replace(
                options.refine, iterations=options.early_iterations, rigid_iterations=options.early_iterations
            )
            refined = refine(shapes, observed, theta, early)
            best = refined.energy.argmin()[None]
            shapes, theta = shapes[best], refined.theta[best]
        with clock("relabel"):
            observed = replace(some, part=relabel(shapes, some, theta, perceived.part_logits))
        with clock("last"):
            refined = refine(shapes, observed, theta, replace(options.refine, rigid_iterations=2))
        with clock("report"):
            chosen_row = int(best) % len(rows)
            trajectory = [*(step[chosen_row : chosen_row + 1] for step in steps), refined.theta]
            return self._report(
                points, good, shapes, observed, refined, clouds, perceived, trajectory, int(rows[chosen_row]), clock
            )  # fmt: skip

    def _report(
        self, points: Array, good: NDArray[np.int64], shapes: Shapes, observed: Observed, refined: Refined,
        clouds: Clouds, perceived: Perceived, trajectory: list[Theta], reference: int, clock: _Clock,
    ) -> Estimate:  # fmt: skip
        """Everything about one fitted reference, as arrays."""
        trees, theta = shapes.trees, refined.theta
        K = int(trees.valid[0].sum())
        posed = pose_parts(trees, theta, shapes.box_center)
        axis, origin = joint_axes(trees, posed)
        part = np.full(len(points), -1)
        nearest = cKDTree(observed.points[0].numpy()).query(points[good], workers=1)[1]
        part[good] = observed.part[0].numpy()[nearest]
        residual = float(refined.energy[0].clamp(min=0).sqrt())
        disagreement = _disagreement(shapes, observed, posed, theta, clouds, perceived)
        poses = [_transforms(shapes, step)[:K] for step in trajectory]
        return Estimate(
            rotation=_numpy(posed.rotation)[:K],
            translation=_numpy(posed.center)[:K],
            size=_numpy(shapes.box_size * posed.scale)[:K],
            T_camera_part=poses[-1],
            state=_numpy(joint_states(trees, theta))[:K],
            joint_type=tuple(KINDS[k] for k in trees.kind[0, :K].tolist()),
            joint_parent=np.where(np.arange(K) == 0, -1, trees.parent[0, :K].numpy()),
            joint_axis=_numpy(axis)[:K],
            joint_origin=_numpy(origin)[:K],
            part=part,
            reference=f"{self.base.categories[reference]}:{self.base.object_ids[reference]}",
            residual=residual,
            disagreement=disagreement,
            visibility=visibility(shapes, observed, posed)[:K],
            confidence=self.calibration(residual, disagreement),
            trajectory=np.stack(poses),
            milliseconds=clock.milliseconds,
        )


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
        usual = np.median(tree.query(points[known[:1024]], _NEIGHBOURS + 1)[0][:, -1])
        apart = tree.query(points[good], _NEIGHBOURS + 1, distance_upper_bound=max(_OUTLIER * usual, 1e-9))[0][:, -1]
        good = good[np.isfinite(apart)]
    if len(good) < _FEWEST or not np.ptp(points[good], axis=0).any():
        raise ArtsimError(
            f"{len(good)} of {len(points)} points show an object", "points", "pass a cloud of the object, in metres"
        )
    return good


def draw(available: int, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """``count`` of ``available`` indices in random order, every one before any comes twice."""
    rounds = [rng.permutation(available) for _ in range(-(-count // available))]
    return np.concatenate(rounds)[:count]


def greedy_steps(agent: Agent, shapes: Shapes, observed: Observed, theta: Theta, steps: int) -> list[Theta]:
    """States after each of the agent's most likely actions."""
    fitting = Fitting(shapes, observed, theta, FittingOptions(steps=steps))
    path = []
    while not fitting.done:
        fitting.step(agent(fitting.view())[0].argmax(-1))
        path.append(fitting.theta)
    return path


def relabel(shapes: Shapes, observed: Observed, theta: Theta, logits: Tensor) -> Tensor:
    """(B, N) parts of the observed points, given both what perception says and how near each fitted part is.

    Parameters
    ----------
    logits : (B, >= N, >= P) float
        Perception's.
    """
    N, P = observed.part.shape[1], shapes.trees.num_rows
    points = pose_parts(shapes.trees, theta, shapes.box_center).points(shapes.points, shapes.box_center)
    apart = torch.cdist(observed.points[:, None].expand(-1, P, -1, -1), points).amin(-1).transpose(1, 2)
    apart = apart / (shapes.diagonal[:, None, None] * _LABEL_DISTANCE)
    score = logits[:, :N, :P].log_softmax(-1) - apart**2
    return score.masked_fill(~shapes.has_surface[:, None], -torch.inf).argmax(-1)


def visibility(shapes: Shapes, observed: Observed, posed: Posed) -> Array:
    """(P,) share of the surface of each part, of the first object, that has an observed point of the part near it."""
    points = posed.points(shapes.points, shapes.box_center)[0].numpy()
    seen = np.zeros(len(points))
    cloud, part = observed.points[0].numpy(), observed.part[0].numpy()
    for k in np.unique(part):
        near = cKDTree(cloud[part == k]).query(points[k], distance_upper_bound=_SEEN * float(shapes.diagonal[0]))[0]
        seen[k] = np.isfinite(near).mean()
    return seen


def _disagreement(
    shapes: Shapes, observed: Observed, posed: Posed, theta: Theta, clouds: Clouds, perceived: Perceived
) -> float:
    N = observed.part.shape[1]
    rotation = posed.rotation[0, observed.part[0]]
    fitted = ((observed.points[0] - posed.translation[0, observed.part[0]])[:, None] @ rotation)[:, 0]
    unit = shapes.diagonal[0] * theta.log_scale[0].mean().exp()
    apart = torch.linalg.vector_norm(fitted / unit - perceived.canonical[0, :N], dim=-1)
    return float(apart.median())


def _transforms(shapes: Shapes, theta: Theta) -> Array:
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    transforms = np.tile(np.eye(4), (posed.rotation.shape[1], 1, 1))
    transforms[:, :3, :3], transforms[:, :3, 3] = _numpy(posed.rotation), _numpy(posed.translation)
    return transforms


def _numpy(values: Tensor) -> Array:
    """The first row, in double precision."""
    return values[0].double().numpy()


class _Clock:
    """Milliseconds by stage."""

    def __init__(self) -> None:
        self.milliseconds: dict[str, float] = {}

    @contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        begun = time.perf_counter()
        try:
            yield
        finally:
            self.milliseconds[stage] = 1e3 * (time.perf_counter() - begun)
