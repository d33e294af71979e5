"""SporeAgent (Bauer et al., WACV 2022) for articulated objects; docs/method_sporeagent.md has what was settled.

A reference is retrieved as ArtPERL does it. Then an agent registers each of its parts on its own with the points of
that part, step by step, without kinematics; of all steps the one counts whose clouds are nearest.
"""

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from artperl.agent.registration import REGISTRATION, PartProblems, RegistrationPolicy, RigidFitting, part_problems
from artperl.agent.start import MeanView, mean_start
from artperl.core.clock import Clock
from artperl.core.estimate import Estimate, visibility
from artperl.core.part_estimate import estimate_of_parts
from artperl.core.pose import Posed, Theta, pose_parts
from artperl.core.shapes import Observed, Shapes
from artperl.core.threads import steady_torch
from artperl.core.trees import KINDS
from artperl.methods.retrieved import AgentMethod
from artperl.perception.cloud_checks import cloud_warnings, with_size
from artperl.perception.preprocess import Cloud
from artperl.retrieval.part_names import part_names


@dataclass(frozen=True)
class SporeAgentOptions:
    """What the method leaves to choose."""

    num_points: int = 2048
    """Points of an observation."""
    start: MeanView = field(default_factory=MeanView)
    """View that the reference is turned to before the first step, as for the method artperl."""


class SporeAgent(AgentMethod):
    """Registration of each part of a retrieved reference; parameters as of :class:`AgentMethod`."""

    name: ClassVar[str] = "sporeagent"
    policy_type, options_type = RegistrationPolicy, SporeAgentOptions
    policy: RegistrationPolicy
    options: SporeAgentOptions

    def __call__(self, points: ArrayLike) -> Estimate:
        """Estimate the pose of every part; see :class:`artperl.methods.protocol.Method`."""
        clock = Clock()
        with steady_torch(), torch.inference_mode():
            cloud = Cloud.of(points, self.options.num_points)
            warnings, sampled = cloud_warnings(cloud), cloud.tensor(self.device)
            with clock("segmentation"):
                part = self.segment(sampled)
            with clock("retrieval"):
                row = int(self.retrieve(sampled, part)[0, 0])
                reference = self.base.shapes[[row]]
            observed = Observed.of(sampled, part)
            with clock("registration"):
                start = mean_start(reference, sampled, self.options.start)
                problems = part_problems(reference, observed, start, torch.Generator().manual_seed(0))
                ends = None if problems is None else self.register(problems)
            posed = posed_apart(reference, start, problems, ends)
            estimate = self._report(reference, observed, posed, start)
        return replace(
            estimate, part=cloud.for_every_point(observed.part[0].cpu().numpy(), -1), reference=self.base.name(row),
            milliseconds=clock.milliseconds, warnings=with_size(warnings, estimate.size, self.categories),
            part_names=part_names(self.base, row, reference),
        )  # fmt: skip

    @torch.no_grad()
    def register(self, problems: PartProblems) -> Theta:
        """Where the agent takes the parts: of each episode, the state whose clouds are nearest."""
        fitting = RigidFitting(problems.shapes, problems.observed, problems.start, REGISTRATION)
        best, least = fitting.theta, fitting.distance
        while not fitting.done:
            fitting.step(self.policy(fitting.view())[0].argmax(-1))
            better = fitting.distance < least
            best, least = fitting.theta.where(better, best), torch.where(better, fitting.distance, least)
        return best

    def _report(self, reference: Shapes, observed: Observed, posed: Posed, start: Theta) -> Estimate:
        """The 9D poses of the parts, and what follows of the joints."""
        trees, K = reference.trees, int(reference.trees.valid[0].sum())
        scale = float(start.log_scale[0].mean().exp())
        surface = posed.points(reference.points, reference.box_center)[0][reference.has_surface[0]].flatten(0, 1)
        apart = torch.cdist(observed.points[0], surface).amin(1).square().mean().sqrt()

        def own(values: Tensor, factor: float = 1.0) -> Any:
            return factor * values[0, :K].double().cpu().numpy()

        lengths = np.where(own(trees.turn) == 0, scale, 1.0)
        seen = visibility(reference.to("cpu"), observed.to("cpu"), posed.to("cpu"))[:K]
        return estimate_of_parts(
            [KINDS[kind] for kind in trees.kind[0, :K].tolist()],
            np.where(np.arange(K) == 0, -1, trees.parent[0, :K].cpu().numpy()), own(trees.rest) * lengths,
            np.stack([own(trees.lower), own(trees.upper)], axis=1) * lengths[:, None], own(posed.rotation),
            own(posed.center), own(reference.box_size, scale), own(posed.center_rest), own(trees.axis),
            own(posed.origin_rest), observed.part[0].cpu().numpy(), float(apart) / (scale * float(reference.diagonal)),
            seen,
        )  # fmt: skip


def posed_apart(reference: Shapes, start: Theta, problems: PartProblems | None, ends: Theta | None) -> Posed:
    """A reference whose parts are where their problems end; those that do not show are where they began."""
    posed = pose_parts(reference.trees, start, reference.box_center)
    if problems is None or ends is None:
        return posed
    rotation, translation = posed.rotation.clone(), posed.translation.clone()
    rotation[problems.row, problems.part] = ends.rotation
    translation[problems.row, problems.part] = ends.translation
    return replace(posed, rotation=rotation, translation=translation)
