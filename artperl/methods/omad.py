"""OMAD (Xue et al., BMVC 2021); docs/method_omad.md has what was settled.

A prior tells the keypoints and the joints of an object by ten numbers. A network reads a cloud's keypoints, pose, joint
states and shape. Then pose, states and shape are optimised until the prior's keypoints lie on the cloud where the
network has them.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor, nn

from artperl.core.category_prior import CategoryPrior
from artperl.core.clock import Clock
from artperl.core.clouds import Clouds
from artperl.core.estimate import Estimate
from artperl.core.part_estimate import estimate_of_parts
from artperl.core.pose import Theta
from artperl.core.threads import steady_torch
from artperl.core.trees import Trees
from artperl.fitting.keypoint_fit import KeypointFit, fit_keypoints, posed_keypoints, snap_keypoints
from artperl.methods.protocol import NetworkSizes
from artperl.perception.cloud_checks import cloud_warnings, with_size
from artperl.perception.omad_networks import CueNetwork, Cues, KeypointPrior, rotation_of_quaternion
from artperl.perception.preprocess import Cloud
from artperl.retrieval.part_names import part_names
from artperl.retrieval.shape_base import ShapeBase
from artsim.common.json_records import from_json_values

_CENTRAL = 0.02
"""Diagonals from the middle within which a part's box centre lies, in every object, if the part is its own mirror."""


@dataclass(frozen=True)
class OMADOptions:
    """What the method leaves to choose."""

    num_points: int = 1024
    """Points of an observation."""
    iterations: int = 600
    """Steps of the optimiser, at most."""
    rate: float = 0.01
    """Of Adam."""


class OMAD:
    """Keypoints of a category's prior.

    Parameters
    ----------
    keypoint_prior : KeypointPrior
    cues : CueNetwork
    base : ShapeBase
        Objects of the category, which have one kinematic tree. Of them only the tree and its limits are used.
    options : OMADOptions, optional
    """

    name: ClassVar[str] = "omad"

    def __init__(
        self, keypoint_prior: KeypointPrior, cues: CueNetwork, base: ShapeBase, options: OMADOptions | None = None
    ):  # fmt: skip
        self.keypoint_prior, self.cues = keypoint_prior.eval(), cues.eval()
        self.base, self.prior, self.options = base, CategoryPrior.of(base.shapes, base.kind), options or OMADOptions()

    @property
    def categories(self) -> tuple[str, ...]:
        """The category that it learnt."""
        return tuple(dict.fromkeys(self.base.categories))

    def __call__(self, points: ArrayLike) -> Estimate:
        """Estimate the pose of every part; see :class:`artperl.methods.protocol.Method`."""
        clock, device = Clock(), next(self.cues.parameters()).device
        with steady_torch(), torch.no_grad():
            cloud = Cloud.of(points, self.options.num_points)
            warnings = cloud_warnings(cloud)
            clouds = Clouds.of(cloud.tensor(device))
            with clock("cues"):
                cues = self.cues(clouds.points)
                part, start = cues.part_logits.argmax(-1), self.start(cues)
            with clock("optimisation"):
                target, weight = snap_keypoints(cues.keypoints, clouds.points, part, cues.log_diagonal.exp())
                fit = fit_keypoints(
                    self.keypoint_prior, self.trees(device), start, cues.beta, target, weight, self.options.iterations,
                    self.options.rate,
                )  # fmt: skip
            estimate = self._report(clouds, fit, part, target, weight)
        return replace(
            estimate, part=cloud.for_every_point(part[0].cpu().numpy(), -1), milliseconds=clock.milliseconds,
            warnings=with_size(warnings, estimate.size, self.categories),
            part_names=part_names(self.base, 0, self.base.shapes[[0]]),
        )  # fmt: skip

    def trees(self, device: torch.device, count: int = 1) -> Trees:
        """The category's tree, so many times."""
        return self.base.shapes.trees[[0] * count].to(device)

    def start(self, cues: Cues) -> Theta:
        """Pose and states as the network says, in the unit of the cloud."""
        trees = self.trees(cues.beta.device, len(cues))
        low, span = state_range(trees)
        scale = cues.log_diagonal[:, None].expand(-1, 3)
        return replace(
            Theta.at_rest(trees), rotation=rotation_of_quaternion(cues.quaternion), translation=cues.translation,
            log_scale=scale, state=torch.where(trees.free, low + cues.state * span, trees.rest),
        )  # fmt: skip

    def _report(self, clouds: Clouds, fit: KeypointFit, part: Tensor, target: Tensor, weight: Tensor) -> Estimate:
        """The 9D poses of the parts; boxes hold the keypoints."""
        posed, prior, K = fit.posed(), self.prior, len(self.prior)
        diagonal = float(fit.theta.log_scale[0, 0].exp() * clouds.scale[0])
        keypoints = self.keypoint_prior.keypoints(fit.beta)[0].double().cpu().numpy()
        low, high = keypoints.min(axis=1), keypoints.max(axis=1)
        rest_center = 0.5 * diagonal * (low + high)
        rotation = posed.rotation[0].double().cpu().numpy()
        origin = (posed.translation[0] * clouds.scale[0] + clouds.center[0]).double().cpu().numpy()
        off = (posed_keypoints(self.keypoint_prior, fit) - target).square().sum(-1)
        left = ((off * weight).sum() / weight.sum().clamp(min=1.0)).sqrt() / fit.theta.log_scale[0, 0].exp()
        lengths = np.where(prior.slides, diagonal, 1.0)
        return estimate_of_parts(
            prior.kinds, prior.parents, prior.rest * lengths, prior.limits * lengths[:, None], rotation,
            origin + np.einsum("kij,kj->ki", rotation, rest_center), diagonal * (high - low), rest_center,
            fit.trees.axis[0].double().cpu().numpy(), diagonal * fit.trees.origin[0].double().cpu().numpy(),
            part[0].cpu().numpy(), float(left), np.array([float((part == k).any()) for k in range(K)]),
        )  # fmt: skip

    def networks(self) -> dict[str, nn.Module]:
        """The two networks."""
        return {"keypoint_prior": self.keypoint_prior, "cues": self.cues}

    def settings(self) -> dict[str, Any]:
        """Sizes and options, in JSON's terms."""
        return {"sizes": asdict(NetworkSizes(self.cues.num_rows, self.cues.width)), "options": asdict(self.options)}

    @classmethod
    def of_settings(cls, settings: dict[str, Any], base: ShapeBase) -> OMAD:
        """The method with these settings, its networks untrained."""
        sizes = from_json_values(NetworkSizes, settings.get("sizes"))
        options = from_json_values(OMADOptions, settings.get("options"))
        return cls(**omad_networks(sizes), base=base, options=options)

    def to(self, device: torch.device | str) -> OMAD:
        """The method on another device."""
        return OMAD(self.keypoint_prior.to(device), self.cues.to(device), self.base, self.options)


def omad_networks(sizes: NetworkSizes, base: ShapeBase | None = None) -> dict[str, Any]:
    """New networks of these sizes, by name; the prior begins with the means of a base, if there is one."""
    mirrored, joint = torch.zeros(sizes.num_rows), None
    if base is not None:
        known = CategoryPrior.of(base.shapes, base.kind)
        mirrored = (base.shapes.box_center[..., 1].abs() < _CENTRAL).all(0).float()
        joint = torch.from_numpy(np.concatenate([known.axis, known.origin], axis=1))
    return {"keypoint_prior": KeypointPrior(mirrored, joint), "cues": CueNetwork(sizes.num_rows, sizes.width)}


def state_range(trees: Trees) -> tuple[Tensor, Tensor]:
    """(B, P) lowest states, and how far states reach from there; half a turn either way where there is no limit."""
    low = torch.where(torch.isfinite(trees.lower), trees.lower, trees.rest - torch.pi)
    high = torch.where(torch.isfinite(trees.upper), trees.upper, trees.rest + torch.pi)
    return low, high - low
