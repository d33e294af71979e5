"""The method "full", from a cloud to the 9D pose of every part (ArtPERL, section 4, extended).

In the order of the paper: perception and retrieval (4.2), the fit on Theta (4.1, 4.3, 4.4), boxes.
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
from artperl.boxes.evidence import Evidence, evidence_of_estimate, roughness
from artperl.boxes.network import Boxes
from artperl.core.clock import Clock
from artperl.core.clouds import Clouds
from artperl.core.estimate import Calibration, Estimate, estimate_of_fit, slide_parts
from artperl.core.labels import labels_by_boxes
from artperl.core.pose import reach
from artperl.fitting.hypotheses import Context, References
from artperl.fitting.normal_alignment import align_normals
from artperl.fitting.occluded_parts import pose_occluded_parts
from artperl.fitting.options import EstimatorOptions
from artperl.fitting.search import Fit, find_fit
from artperl.perception.cloud_checks import cloud_warnings
from artperl.perception.label_smoothing import smooth_perceived
from artperl.perception.network import Perceived, Perception, Votes
from artperl.perception.part_grouping import group_votes
from artperl.perception.preprocess import as_cloud, clean, draw
from artperl.retrieval.part_names import part_names
from artperl.retrieval.references import references
from artperl.retrieval.shape_base import ShapeBase

Array = NDArray[np.float64]

_BOX_POINTS = 8192
"""Points by which faces of boxes are looked for."""
_LOOKS = 2
"""Times that boxes are looked for: the first ones tell which part a point cannot be of."""
_OUTSIDE = 0.01
"""Distance out of a part's box, in diagonals, that weighs as much against a label as odds of 1 to e."""


@dataclass(frozen=True, eq=False)
class Cloud:
    """One cloud as it is given, and as perception sees it.

    Attributes
    ----------
    points : (N, 3) float
        Camera frame, metres.
    good : (G,) int64
        Those that show the object.
    few : (F,) int64
        Of these, as many as late stages look at.
    tensor : (1, M, 3) float
        Of these, those that perception sees, on its device.
    """

    points: Array
    good: NDArray[np.int64]
    few: NDArray[np.int64]
    tensor: Tensor

    @staticmethod
    def of(points: ArrayLike, count: int, device: torch.device) -> Cloud:
        """A cloud without what no sensor measures and without outliers."""
        every = as_cloud(points)
        good = clean(every)
        seen = every[good[draw(len(good), count, np.random.default_rng(0))]].astype(np.float32)
        few = good[draw(len(good), min(_BOX_POINTS, len(good)), np.random.default_rng(0))]
        return Cloud(every, good, few, torch.from_numpy(seen)[None].to(device))


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
        Without one, boxes are the reference's, enlarged to hold the points.
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
        with _one_thread(), torch.inference_mode():
            clock = Clock()
            estimate, evidence = self._posed(points, clock)
            return self._with_boxes(estimate, evidence, clock)

    def evidence(self, points: ArrayLike) -> tuple[Estimate, Evidence, float]:
        """What :attr:`boxes` learn from: an estimate that goes without them, the evidence, and its unit in metres."""
        with _one_thread(), torch.inference_mode():
            estimate, known = self._posed(points, Clock())
            return estimate, *known.evidence(estimate, self.perception.num_rows)

    def _posed(self, points: ArrayLike, clock: Clock) -> tuple[Estimate, _Known]:
        """The estimate with the boxes of the reference, and what is known for better ones."""
        with clock("clean"):
            cloud = Cloud.of(points, self.options.num_points, self.perception.device)
            warnings = cloud_warnings(cloud.points, cloud.good)
        clouds = Clouds.of(cloud.tensor)
        perceived = self.perceive(clouds, clock)
        with clock("retrieval"):
            row, shapes = references(self.base, perceived, min(self.options.references, len(self.base)))
            priors = {int(n): self.base.axis_prior(int(n)) for n in row}
        context = Context(
            cloud.tensor, clouds, perceived, References(shapes, row), priors, self.agent, self.options
        )  # fmt: skip
        fit = find_fit(context, clock).to("cpu")
        with clock("labels"):
            near = cKDTree(fit.observed.points[0].numpy()).query(cloud.points[cloud.good], workers=1)[1]
            part = np.full(len(cloud.points), -1)
            part[cloud.good] = fit.observed.part[0].numpy()[near]
        few = cloud.points[cloud.few], part[cloud.few]
        if self.options.occluded_parts:
            with clock("occluded parts"):
                fit = fit.with_end(pose_occluded_parts(fit.shapes, fit.theta, *few))
        if self.options.normal_alignment:
            with clock("normals"):
                fit = fit.with_end(align_normals(fit.shapes, fit.theta, *few))
        with clock("report"):
            log_odds = np.full((len(part), self.perception.num_rows), np.nan)
            log_odds[cloud.good] = perceived.part_logits.log_softmax(-1)[0].double().cpu().numpy()[near]
            estimate = estimate_of_fit(fit.shapes, fit.observed, fit.path, cloud.points, part)
            estimate = self._reported(replace(estimate, warnings=warnings, milliseconds=clock.milliseconds), fit)
            return estimate, _Known.of(cloud, log_odds, perceived, clouds, fit)

    def perceive(self, clouds: Clouds, clock: Clock) -> Perceived:
        """What is perceived of one cloud."""
        with clock("perception"):
            seen = self.perception(clouds.points)
        if self.options.label_smoothing:
            with clock("label smoothing"):
                seen = smooth_perceived(clouds, seen)
        if not isinstance(seen, Votes):
            return seen
        with clock("part grouping"):
            return group_votes(seen)

    def _reported(self, estimate: Estimate, fit: Fit) -> Estimate:
        """The estimate with what the fit and the base say of it."""
        return replace(
            estimate,
            reference=f"{self.base.categories[fit.row]}:{self.base.object_ids[fit.row]}",
            residual=fit.residual,
            disagreement=fit.disagreement,
            confidence=self.calibration(fit.residual, fit.disagreement, estimate.visibility.min()),
            part_names=part_names(self.base, fit.row, fit.shapes),
        )

    def _with_boxes(self, estimate: Estimate, known: _Known, clock: Clock) -> Estimate:
        """The estimate with faces of boxes where the network says that they are, and points labelled by these boxes."""
        if self.boxes is None:
            return estimate
        T, part = estimate.T_camera_part, estimate.part
        with clock("boxes"):
            for _ in range(_LOOKS):
                evidence, unit = known.evidence(replace(estimate, part=part), self.boxes.num_rows)
                boxes = self.boxes(evidence.to(self.perception.device))
                center, size, farther = (
                    (values.cpu() * unit)[0].double().numpy()[: len(estimate.size)] for values in boxes
                )
                part = labels_by_boxes(known.points, T, center, size, known.log_odds, _OUTSIDE * unit)
        posed = np.einsum("kij,kj->ki", T[:, :3, :3], center) + T[:, :3, 3]
        farther = np.maximum(farther, np.minimum(known.lower - estimate.state, 0.0))
        return slide_parts(replace(estimate, translation=posed, size=size, part=part), farther)


@dataclass(frozen=True, eq=False)
class _Known:
    """What is kept of perception once a cloud is fitted.

    Attributes
    ----------
    points : (N, 3) float
        Camera frame, metres.
    log_odds : (N, P) float
        Of each point to be of each part; NaN for outliers.
    box_center, box_size : (P, 3) float
        As perceived, in the rest frame, metres.
    chosen : (M,) int64
        Points by which faces of boxes are looked for.
    roughness : () float
        Of these, metres.
    lower : (K,) float
        Least states of the joints, radians or metres.
    """

    points: Array
    log_odds: Array
    box_center: Tensor
    box_size: Tensor
    chosen: NDArray[np.int64]
    roughness: Tensor
    lower: Array

    @staticmethod
    def of(cloud: Cloud, log_odds: Array, perceived: Perceived, clouds: Clouds, fit: Fit) -> _Known:
        """All of one cloud."""
        trees, metres = fit.shapes.trees, (perceived.log_diagonal.exp() * clouds.scale).cpu()
        lower = (trees.lower * reach(trees, fit.theta.log_scale))[0].double().numpy()[: int(trees.valid[0].sum())]
        return _Known(
            cloud.points, log_odds, perceived.box_center[0].cpu() * metres, perceived.box_size[0].cpu() * metres,
            cloud.few, roughness(torch.from_numpy(cloud.points[cloud.few].astype(np.float32))), lower,
        )  # fmt: skip

    def evidence(self, estimate: Estimate, rows: int) -> tuple[Evidence, float]:
        """Evidence for boxes, padded to that many rows, and its unit in metres."""
        few = self.points[self.chosen], estimate.part[self.chosen]
        return evidence_of_estimate(estimate, *few, self.box_center, self.box_size, self.roughness, rows)


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
