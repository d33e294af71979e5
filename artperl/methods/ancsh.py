"""A-NCSH (Li et al., CVPR 2020); docs/method_ancsh.md has what was settled.

One network gives each point its part and its place in the part's and in the object's normalised frame; another one lets
points vote for joints. Each part is fitted to its places by RANSAC and Umeyama's closed form; then the rotations of all
parts are optimised under the joints that were voted for.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import nn

from artperl.core.category_prior import CategoryPrior
from artperl.core.clock import Clock
from artperl.core.clouds import Clouds
from artperl.core.estimate import Estimate
from artperl.core.part_estimate import estimate_of_parts
from artperl.core.threads import steady_torch
from artperl.fitting.inferred_parts import place_inferred, turn_inferred
from artperl.fitting.joint_votes import vote_axis, vote_pivot
from artperl.fitting.kinematic_pairs import couple_rotations
from artperl.fitting.umeyama import Similarity, ransac_umeyama
from artperl.methods.protocol import NetworkSizes
from artperl.perception.ancsh_networks import CoordinateNetwork, JointNetwork
from artperl.perception.cloud_checks import cloud_warnings, with_size
from artperl.perception.preprocess import Cloud
from artperl.retrieval.part_names import part_names
from artperl.retrieval.shape_base import ShapeBase
from artsim.common.json_records import from_json_values

Array = NDArray[np.float64]

_FEWEST = 6
"""Points of a part below which nothing is fitted to it."""


@dataclass(frozen=True)
class ANCSHOptions:
    """What the method leaves to choose."""

    num_points: int = 1024
    """Points of an observation."""
    iterations: int = 1000
    """Hypotheses of RANSAC for each part. Their cost is cut, not counted, so that a tenth of the paper's suffice."""
    inlier: float = 0.1
    """Distance of an inlier, in units of the part's frame."""
    joint_weight: float = 1.0
    """Of a joint in the optimisation, against the relative error of a part's points."""
    box_quantile: float = 0.98
    """Share of a part's points that its box holds: the others are taken for noise."""


@dataclass(frozen=True, eq=False)
class _Places:
    """Of N points: camera frame, metres; parts; places in the part's frame, and in the object's."""

    points: Array
    part: NDArray[np.int64]
    npcs: Array
    naocs: Array
    scale: Array
    shift: Array


class ANCSH:
    """Articulation-aware normalised coordinate spaces.

    Parameters
    ----------
    coordinates : CoordinateNetwork
    joints : JointNetwork
    base : ShapeBase
        Objects of the category, which have one kinematic tree. Of them only :class:`CategoryPrior` is used.
    options : ANCSHOptions, optional
    """

    name: ClassVar[str] = "ancsh"

    def __init__(
        self, coordinates: CoordinateNetwork, joints: JointNetwork, base: ShapeBase, options: ANCSHOptions | None = None
    ):  # fmt: skip
        self.coordinates, self.joints = coordinates.eval(), joints.eval()
        self.base, self.prior, self.options = base, CategoryPrior.of(base.shapes, base.kind), options or ANCSHOptions()

    @property
    def categories(self) -> tuple[str, ...]:
        """The category that it learnt."""
        return tuple(dict.fromkeys(self.base.categories))

    def __call__(self, points: ArrayLike) -> Estimate:
        """Estimate the pose of every part; see :class:`artperl.methods.protocol.Method`."""
        clock, rng = Clock(), np.random.default_rng(0)
        with steady_torch(), torch.inference_mode():
            cloud = Cloud.of(points, self.options.num_points)
            warnings = cloud_warnings(cloud)
            clouds = Clouds.of(cloud.tensor(next(self.joints.parameters()).device))
            with clock("coordinates"):
                places = self._places(cloud, clouds)
            with clock("joints"):
                axis, origin = self._joints(clouds, places)
            with clock("ransac"):
                fits = self._fit_parts(places, rng)
            with clock("kinematics"):
                estimate = self._couple(places, fits, axis, origin)
        return replace(
            estimate, part=cloud.for_every_point(places.part, -1), milliseconds=clock.milliseconds,
            warnings=with_size(warnings, estimate.size, self.categories),
            part_names=part_names(self.base, 0, self.base.shapes[[0]]),
        )  # fmt: skip

    def _places(self, cloud: Cloud, clouds: Clouds) -> _Places:
        """Part and places of each point, by the first network."""
        said = self.coordinates(clouds.points).to("cpu")
        part = said.part_logits[0].argmax(-1)
        npcs = said.npcs[0][torch.arange(len(part)), part]
        naocs = said.scale[0] * npcs + said.shift[0]
        values = (v.double().numpy() for v in (npcs, naocs, said.scale[0, :, 0], said.shift[0]))
        return _Places(cloud.seen.astype(np.float64), part.numpy(), *values)

    def _joints(self, clouds: Clouds, places: _Places) -> tuple[Array, Array]:
        """(K, 3) axes and places of the joints in the rest frame, in diagonals, by the votes of the second network.

        A joint for which nobody votes is where it is on average in the category.
        """
        said = self.joints(clouds.points).to("cpu")
        joint = said.joint_logits[0].argmax(-1).numpy()
        votes, offset, heat = (v[0].double().numpy() for v in (said.axis, said.offset, said.heat.sigmoid()))
        axis, origin = self.prior.axis.copy(), self.prior.origin.copy()
        for k in range(1, len(self.prior)):
            voters = joint == k
            if voters.any():
                axis[k] = vote_axis(votes[voters])
                origin[k] = vote_pivot(places.naocs[voters], offset[voters], heat[voters]) - 0.5
        return axis, origin

    def _fit_parts(
        self, places: _Places, rng: np.random.Generator
    ) -> list[tuple[Similarity, NDArray[np.bool_]] | None]:
        """For each part, the similarity from its frame to the camera, and its points that agree; None if unseen."""
        fits: list[tuple[Similarity, NDArray[np.bool_]] | None] = []
        for k in range(len(self.prior)):
            own = places.part == k
            if own.sum() < _FEWEST:
                fits.append(None)
                continue
            options = self.options
            found, agree = ransac_umeyama(
                places.npcs[own], places.points[own], rng, options.iterations, options.inlier
            )  # fmt: skip
            chosen = np.zeros(len(own), dtype=bool)
            chosen[np.flatnonzero(own)[agree]] = True
            fits.append((found, chosen))
        return fits

    def _couple(
        self, places: _Places, fits: list[tuple[Similarity, NDArray[np.bool_]] | None], axis: Array, origin: Array
    ) -> Estimate:  # fmt: skip
        """The estimate of parts whose rotations obey the joints."""
        prior, K = self.prior, len(self.prior)
        scale, start = np.ones(K), np.tile(np.eye(3), (K, 1, 1))
        rows = [np.zeros(0, dtype=int)] * K
        for k, fit in enumerate(fits):
            if fit is not None:
                scale[k], start[k], rows[k] = fit[0].scale, fit[0].rotation, np.flatnonzero(fit[1])
        seen = np.array([fit is not None for fit in fits])
        start = turn_inferred(start, seen, prior, axis)
        source, target = [places.npcs[own] for own in rows], [places.points[own] for own in rows]
        rotation = couple_rotations(
            source, target, scale, start, prior.kinds, prior.parents, axis, self.options.joint_weight
        )  # fmt: skip
        box, middle, own_scale = self._boxes(places, rows)
        diagonal = float(np.median(scale[seen] / own_scale[seen])) if seen.any() else 1.0
        size, rest_center = diagonal * box, diagonal * middle
        size[seen] = scale[seen, None] * box[seen] / own_scale[seen, None]
        center = np.zeros((K, 3))
        for k in range(K):
            if seen[k]:
                offset = source[k].mean(axis=0) - 0.5
                center[k] = target[k].mean(axis=0) - scale[k] * rotation[k] @ offset
        center = place_inferred(center, rotation, seen, prior, rest_center, diagonal * axis, diagonal * origin)
        left = [center[k] + scale[k] * (source[k] - 0.5) @ rotation[k].T - target[k] for k in range(K) if seen[k]]
        residual = float(np.sqrt((np.concatenate(left) ** 2).sum(axis=1).mean())) / diagonal if left else np.inf
        lengths = np.where(prior.slides, diagonal, 1.0)
        return estimate_of_parts(
            prior.kinds, prior.parents, prior.rest * lengths, prior.limits * lengths[:, None], rotation, center, size,
            rest_center, axis, diagonal * origin, places.part, residual, seen.astype(np.float64),
        )  # fmt: skip

    def _boxes(self, places: _Places, rows: list[NDArray[np.int64]]) -> tuple[Array, Array, Array]:
        """Sizes and centres of the parts' boxes in diagonals of the object, and sizes of their frames.

        A box reaches as far from the middle of its frame as its points do, on either side alike.
        """
        box, middle = self.prior.box_size.copy(), self.prior.box_center.copy()
        frame = np.linalg.norm(box, axis=1)
        for k, own in enumerate(rows):
            if len(own):
                frame[k], shift = np.median(places.scale[own]), np.median(places.shift[own], axis=0)
                reach = np.quantile(np.abs(places.npcs[own] - 0.5), self.options.box_quantile, axis=0)
                box[k], middle[k] = 2.0 * frame[k] * reach, 0.5 * frame[k] + shift - 0.5
        return box, middle, frame

    def networks(self) -> dict[str, nn.Module]:
        """The two networks."""
        return {"coordinates": self.coordinates, "joints": self.joints}

    def settings(self) -> dict[str, Any]:
        """Sizes and options, in JSON's terms."""
        sizes = NetworkSizes(self.joints.num_rows, self.joints.width)
        return {"sizes": asdict(sizes), "options": asdict(self.options)}

    @classmethod
    def of_settings(cls, settings: dict[str, Any], base: ShapeBase) -> ANCSH:
        """The method with these settings, its networks untrained."""
        sizes = from_json_values(NetworkSizes, settings.get("sizes"))
        options = from_json_values(ANCSHOptions, settings.get("options"))
        return cls(**ancsh_networks(sizes), base=base, options=options)

    def to(self, device: torch.device | str) -> ANCSH:
        """The method on another device."""
        return ANCSH(self.coordinates.to(device), self.joints.to(device), self.base, self.options)


def ancsh_networks(sizes: NetworkSizes) -> dict[str, Any]:
    """New networks of these sizes, by name."""
    return {
        "coordinates": CoordinateNetwork(sizes.num_rows, sizes.width),
        "joints": JointNetwork(sizes.num_rows, sizes.width),
    }
