"""SporeAgent (Bauer et al., WACV 2022) for articulated objects; docs/method_sporeagent.md has what was settled.

A reference is retrieved as ArtPERL does it. Then an agent registers each of its parts on its own with the points of
that part, step by step, without kinematics; of all steps the one counts whose clouds are nearest.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor, nn

from artperl.agent.actions import expected_action
from artperl.agent.registration import REGISTRATION, PartProblems, RegistrationPolicy, RigidFitting, part_problems
from artperl.agent.start import MeanView, mean_start
from artperl.core.clock import Clock
from artperl.core.estimate import Estimate, visibility
from artperl.core.part_estimate import estimate_of_parts
from artperl.core.pose import Posed, Theta, pose_parts
from artperl.core.shapes import Observed, Shapes
from artperl.core.threads import one_thread
from artperl.core.trees import KINDS
from artperl.perception.cloud_checks import cloud_warnings
from artperl.perception.preprocess import Cloud
from artperl.perception.segmentation import Segmentation
from artperl.retrieval.part_names import part_names
from artperl.retrieval.segmented import SegmentedRetrieval, check_embeddings
from artperl.retrieval.shape_base import ShapeBase
from artperl.retrieval.siamese import Siamese
from artsim.common.json_records import from_json_values
from artsim.model.objects import MAX_PARTS

_MAX_WIDTH = 2048


@dataclass(frozen=True)
class SporeAgentOptions:
    """What the method leaves to choose."""

    num_points: int = 2048
    """Points of an observation."""
    start: MeanView = field(default_factory=MeanView)
    """View that the reference is turned to before the first step, as for the method artperl."""


@dataclass(frozen=True)
class SporeAgentSizes:
    """Sizes of the networks: K, and channels of the first layers."""

    num_rows: int
    segmentation: int = 48
    siamese: int = 24
    policy: int = 64

    def __post_init__(self) -> None:
        widths = self.segmentation, self.siamese, self.policy
        if not 1 <= self.num_rows <= MAX_PARTS or not all(1 <= width <= _MAX_WIDTH for width in widths):
            raise ValueError(f"num_rows is {self.num_rows}, widths are {widths}")


class SporeAgent(SegmentedRetrieval):
    """Registration of each part of a retrieved reference.

    Parameters
    ----------
    segmentation : Segmentation
    siamese : Siamese
    policy : RegistrationPolicy
    base : ShapeBase
        References with their embeddings by ``siamese``.
    options : SporeAgentOptions, optional
    """

    name: ClassVar[str] = "sporeagent"

    def __init__(
        self, segmentation: Segmentation, siamese: Siamese, policy: RegistrationPolicy, base: ShapeBase,
        options: SporeAgentOptions | None = None,
    ):  # fmt: skip
        super().__init__(segmentation, siamese, base)
        self.policy, self.options = policy.eval(), options or SporeAgentOptions()

    def __call__(self, points: ArrayLike) -> Estimate:
        """Estimate the pose of every part; see :class:`artperl.methods.protocol.Method`."""
        clock = Clock()
        with one_thread(), torch.inference_mode():
            cloud = Cloud.of(points, self.options.num_points)
            warnings, sampled = cloud_warnings(cloud.points, cloud.good), cloud.tensor(self.device)
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
            milliseconds=clock.milliseconds, warnings=warnings, part_names=part_names(self.base, row, reference),
        )  # fmt: skip

    @torch.no_grad()
    def register(self, problems: PartProblems) -> Theta:
        """Where the agent takes the parts: of each episode, the state whose clouds are nearest."""
        fitting = RigidFitting(problems.shapes, problems.observed, problems.start, REGISTRATION)
        best, least = fitting.theta, fitting.distance
        while not fitting.done:
            fitting.step(expected_action(self.policy(fitting.view())[0]))
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

    def networks(self) -> dict[str, nn.Module]:
        """The three networks."""
        return {"segmentation": self.segmentation, "siamese": self.siamese, "policy": self.policy}

    def settings(self) -> dict[str, Any]:
        """Sizes and options, in JSON's terms."""
        sizes = SporeAgentSizes(
            self.segmentation.num_rows, self.segmentation.width, self.siamese.width, self.policy.width
        )  # fmt: skip
        return {"sizes": asdict(sizes), "options": asdict(self.options)}

    @classmethod
    def of_settings(cls, settings: dict[str, Any], base: ShapeBase) -> SporeAgent:
        """The method with these settings, its networks untrained."""
        networks = sporeagent_networks(from_json_values(SporeAgentSizes, settings.get("sizes")))
        check_embeddings(base, networks["siamese"])
        return cls(**networks, base=base, options=from_json_values(SporeAgentOptions, settings.get("options")))

    def to(self, device: torch.device | str) -> SporeAgent:
        """The method on another device."""
        networks: dict[str, Any] = {name: network.to(device) for name, network in self.networks().items()}
        return SporeAgent(**networks, base=self.base, options=self.options)


def sporeagent_networks(sizes: SporeAgentSizes) -> dict[str, Any]:
    """New networks of these sizes, by name."""
    return {
        "segmentation": Segmentation(sizes.num_rows, sizes.segmentation),
        "siamese": Siamese(sizes.num_rows, sizes.siamese),
        "policy": RegistrationPolicy(sizes.policy),
    }


def posed_apart(reference: Shapes, start: Theta, problems: PartProblems | None, ends: Theta | None) -> Posed:
    """A reference whose parts are where their problems end; those that do not show are where they began."""
    posed = pose_parts(reference.trees, start, reference.box_center)
    if problems is None or ends is None:
        return posed
    rotation, translation = posed.rotation.clone(), posed.translation.clone()
    rotation[problems.row, problems.part] = ends.rotation
    translation[problems.row, problems.part] = ends.translation
    return replace(posed, rotation=rotation, translation=translation)
