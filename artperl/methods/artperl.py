"""ArtPERL as the paper has it, section 4 (see docs/method_artperl.md for each equation and deviation).

An observed cloud is segmented into parts; a reference is retrieved by part-pooled embeddings (4.2); an agent fits the
reference's joint states, from the root to the leaves (4.3); a gradient optimiser refines them under the kinematic
constraints (4.4). The 9D poses of the parts follow from the joint states (4.1).
"""

from copy import copy
from dataclasses import dataclass, field, replace
from typing import ClassVar

import torch
from numpy.typing import ArrayLike
from torch import Tensor
from typing_extensions import Self

from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.agent.policy import Policy
from artperl.agent.start import MeanView, mean_start
from artperl.core.batch import concatenate
from artperl.core.clock import Clock
from artperl.core.confidence import Calibration, PartCalibration
from artperl.core.estimate import Estimate, estimate_of_fit
from artperl.core.pose import Theta
from artperl.core.shapes import Observed, Shapes
from artperl.core.threads import steady_torch
from artperl.fitting.hypotheses import part_weights
from artperl.fitting.levenberg_marquardt import Refined, refine
from artperl.fitting.part_symptoms import symptoms_by_part
from artperl.fitting.refine_options import RefineOptions
from artperl.fitting.search import rest_places
from artperl.methods.retrieved import AgentMethod
from artperl.perception.cloud_checks import cloud_warnings, with_size
from artperl.perception.preprocess import Cloud
from artperl.retrieval.part_names import part_names


@dataclass(frozen=True)
class ArtPERLOptions:
    """What section 4 leaves to choose."""

    num_points: int = 2048
    """Points of an observation (section 5.1)."""
    early_points: int = 512
    """Of these, points by which the best of the agent's ends is found."""
    early_iterations: int = 8
    """Iterations of the refinement of every end, before the best one is kept."""
    starts: tuple[MeanView, ...] = (MeanView(-50.0), MeanView(), MeanView(50.0))
    """Views that the reference is turned to before the agent's first step; the middle one is the mean view."""
    fitting: FittingOptions = field(default_factory=FittingOptions)
    """The decision process of the agent."""
    refine: RefineOptions = field(default_factory=RefineOptions)
    """The last refinement."""
    calibration: Calibration = field(default_factory=Calibration)
    part_calibration: PartCalibration = field(default_factory=PartCalibration)
    """Confidence of the whole, and of parts: a training fits them in its end."""


class ArtPERL(AgentMethod):
    """The paper's method; parameters as of :class:`artperl.methods.retrieved.AgentMethod`."""

    name: ClassVar[str] = "artperl"
    policy_type, options_type = Policy, ArtPERLOptions
    policy: Policy
    options: ArtPERLOptions

    @steady_torch()
    def __call__(self, points: ArrayLike) -> Estimate:
        """Estimate the pose of every part of the object that a cloud shows.

        Parameters
        ----------
        points : (N, 3) float
            Camera frame, metres.

        Raises
        ------
        ArtsimError
            When there is no object to be seen in the cloud.
        """
        clock = Clock()
        cloud = Cloud.of(points, self.options.num_points)
        warnings, sampled = cloud_warnings(cloud), cloud.tensor(self.device)
        with clock("segmentation"):
            part, certainty = self.parts(sampled)
        with clock("retrieval"):
            row = int(self.retrieve(sampled, part)[0, 0])
            reference = self.base.shapes[[row]]
        observed = Observed.of(sampled, part, part_weights(part))
        with clock("agent"):
            paths = self.fit(reference, observed)
        with clock("refinement"):
            early = self.early(reference, observed, paths[-1])
            best = early.energy.argsort()[:2].tolist()
            refined = refine(reference, observed, early.theta[best[:1]], self.options.refine)
        observed, reference, ends = observed.to("cpu"), reference.to("cpu"), early.theta[best].to("cpu")
        steps = [theta[best[:1]].to("cpu") for theta in paths] + [refined.theta.to("cpu")]
        one, other = (rest_places(reference, observed, ends[[row]])[0] for row in (0, -1))
        apart = torch.linalg.vector_norm(one - other, dim=-1)
        expected_error = 1.0 - certainty[0].cpu()
        estimate = estimate_of_fit(reference, observed, steps, cloud.for_every_point(observed.part[0].numpy(), -1))
        estimate = replace(
            estimate,
            reference=self.base.name(row),
            residual=float(refined.energy.clamp(min=0.0).sqrt()),
            disagreement=float(apart.median()),
            expected_error=float(expected_error.mean()),
            milliseconds=clock.milliseconds,
            part_names=part_names(self.base, row, reference),
            warnings=with_size(warnings, estimate.size, self.categories),
        )
        own = symptoms_by_part(observed.part[0], apart, expected_error, 1.0 - expected_error, estimate.visibility)
        return estimate.judged(self.options.calibration, self.options.part_calibration, own)

    def starts(self, reference: Shapes, points: Tensor) -> list[Theta]:
        """Where episodes begin: references at clouds (B, N, 3) as they are seen in each of the views of the options."""
        return [mean_start(reference, points, view) for view in self.options.starts]

    @torch.no_grad()
    def fit(self, reference: Shapes, observed: Observed) -> list[Theta]:
        """States of one reference from its S starts on, S rows, after each action of the agent, section 4.3.

        The agent takes the action that its policy holds for the most likely one.
        """
        start = concatenate(self.starts(reference, observed.points))
        fitting = Fitting(
            reference.repeat(len(start)), observed.repeat(len(start)), start, self.options.fitting
        )  # fmt: skip
        path = [start]
        while not fitting.done:
            fitting.step(self.policy(fitting.view())[0].argmax(-1))
            path.append(fitting.theta)
        return path

    def early(self, reference: Shapes, observed: Observed, ends: Theta) -> Refined:
        """Every end, S rows, after a few iterations on few points, its shape as it is; the one with the least energy
        is worth all iterations on all points, section 4.4.
        """
        options = self.options
        few = observed.map(lambda values: values[:, : options.early_points]).repeat(len(ends))
        early = replace(options.refine, iterations=min(options.early_iterations, options.refine.iterations))
        return refine(reference.repeat(len(ends)), few, ends, early, rigid=True)

    def with_confidence(self, calibration: Calibration, part_calibration: PartCalibration) -> Self:
        """The method with another confidence of the whole, and of parts."""
        other = copy(self)
        other.options = replace(self.options, calibration=calibration, part_calibration=part_calibration)
        return other
