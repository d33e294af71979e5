"""The method "full", from a cloud to the 9D pose of every part (ArtPERL, section 4, extended).

In the order of the paper: perception and retrieval (4.2), the fit on Theta (4.1, 4.3, 4.4), boxes.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import torch
from numpy.typing import ArrayLike, NDArray
from torch import nn

from artperl.boxes.evidence import BoxContext, Evidence
from artperl.boxes.network import Boxes
from artperl.boxes.placement import place_boxes
from artperl.core.clock import Clock
from artperl.core.clouds import Clouds
from artperl.core.confidence import Calibration, PartCalibration
from artperl.core.device import find_device
from artperl.core.estimate import Estimate, estimate_of_fit, widen
from artperl.core.threads import steady_torch
from artperl.core.ways import way_chances
from artperl.fitting.hypotheses import Context, Fit
from artperl.fitting.normal_alignment import align_normals
from artperl.fitting.options import EstimatorOptions
from artperl.fitting.part_symptoms import part_symptoms
from artperl.fitting.search import find_fit
from artperl.methods.estimator_writing import changed_values, save_estimator
from artperl.methods.many import estimate_many
from artperl.methods.tracking import track
from artperl.methods.views import estimate_frames, estimate_views
from artperl.perception.cloud_checks import cloud_warnings, with_size
from artperl.perception.label_smoothing import smooth_perceived
from artperl.perception.mirroring import votes_both_ways
from artperl.perception.network import Perceived, Perception, Votes
from artperl.perception.part_grouping import PerceivedTree, group_votes
from artperl.perception.preprocess import Cloud
from artperl.retrieval.part_names import part_names
from artperl.retrieval.references import retrieve_references
from artperl.retrieval.shape_base import ShapeBase
from artsim.errors import ArtsimError

_LATE_POINTS = 8192
"""Points that tell normals."""
_OWN = 0.9
"""Probability from which a point is taken for one of the object: a foreign point moves faces of boxes, while a point of
the object that is left out is missed by nobody."""
_MOST_FOREIGN = 0.5
"""Share of points that may be taken for something else; masks as bad as that are no masks of the object."""
_MOVED = 0.01
"""Scales of a cloud by which others move its middle, or change its scale, before it is looked at again. Clean clouds
stay below: of these, single points are taken for something else."""


@dataclass(eq=False)
class Estimator:
    """Everything that is needed to estimate poses of a category, or of several.

    An estimate takes one thread of the processor, so that several processes may estimate side by side.

    Parameters
    ----------
    perception : Perception
    base : ShapeBase
    options : EstimatorOptions, optional
    calibration : Calibration, optional
    boxes : Boxes, optional
        Without one, boxes are the reference's, enlarged to hold the points.
    part_calibration : PartCalibration, optional
    """

    name: ClassVar[str] = "full"
    perception: Perception
    base: ShapeBase
    options: EstimatorOptions = field(default_factory=EstimatorOptions)
    calibration: Calibration = field(default_factory=Calibration)
    boxes: Boxes | None = None
    part_calibration: PartCalibration = field(default_factory=PartCalibration)

    def __post_init__(self) -> None:
        self.perception.eval()
        self.base = self.base.to(self.perception.device)
        if self.boxes is not None:
            self.boxes.to(self.perception.device)

    @property
    def categories(self) -> tuple[str, ...]:
        """Categories of the references."""
        return tuple(dict.fromkeys(self.base.categories))

    @property
    def device(self) -> torch.device:
        """Where it works."""
        return self.perception.device

    def to(self, device: torch.device | str) -> Estimator:
        """Move it to a device, such as "cuda", and return it, as torch's modules do.

        Raises
        ------
        ConfigError
            When there is no such device.
        """
        self.perception.to(find_device(device))
        self.__post_init__()
        return self

    def save(self, folder: str | Path, about: Mapping[str, Any] | None = None) -> None:
        """Write it into a folder, which ``load_estimator`` takes: see :mod:`artperl.methods.estimator_writing`."""
        save_estimator(self, Path(folder), about or {})

    def __repr__(self) -> str:
        return f"<Estimator of {', '.join(self.categories)}: {len(self.base.categories)} references, on {self.device}>"

    def networks(self) -> dict[str, nn.Module]:
        """Its networks by name."""
        networks = {"perception": self.perception, "boxes": self.boxes}
        return {name: network for name, network in networks.items() if network is not None}

    def settings(self) -> dict[str, Any]:
        """Sizes of its networks and options, in JSON's terms."""
        sizes, own = {"perception": ("num_rows", "width", "votes"), "boxes": ("num_rows", "width")}, self.networks()
        return {
            **{net: {key: getattr(own[net], key) for key in keys} for net, keys in sizes.items() if net in own},
            "options": changed_values(asdict(self.options), asdict(EstimatorOptions())),
            "calibration": asdict(self.calibration),
            "part_calibration": asdict(self.part_calibration),
        }

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
        return self.with_fit(points)[0]

    def with_fit(self, points: ArrayLike) -> tuple[Estimate, Fit]:
        """An estimate, and the fitted reference that it is of."""
        with steady_torch(), torch.inference_mode():
            clock = Clock()
            estimate, known, fit = self._fit(points, clock)
            if self.boxes is None:
                return estimate, fit
            with clock("boxes"):
                return place_boxes(self.boxes, estimate, known), fit

    def track(self, clouds: Iterable[ArrayLike]) -> Iterator[Estimate]:
        """Estimates of the clouds of one moving object, each from the last: :func:`artperl.methods.tracking.track`."""
        return track(self.with_fit, clouds)

    def views(self, clouds: Sequence[ArrayLike], T_world_camera: ArrayLike) -> Estimate:
        """The estimate of an object that stands still, from several sides: :mod:`artperl.methods.views`."""
        return estimate_views(self, clouds, T_world_camera)

    def frames(self, clouds: Sequence[ArrayLike]) -> list[Estimate]:
        """Estimates of one object whose joints have moved between clouds: :mod:`artperl.methods.views`."""
        return estimate_frames(self, clouds)

    def many(self, clouds: Iterable[ArrayLike], workers: int = 1) -> Iterator[Estimate | ArtsimError]:
        """Estimates of many clouds, in several processes: :func:`artperl.methods.many.estimate_many`."""
        return estimate_many(self, clouds, workers)

    def evidence(self, points: ArrayLike) -> tuple[Estimate, Evidence, float]:
        """What :attr:`boxes` learn from: an estimate that goes without them, the evidence, and its unit in metres."""
        with steady_torch(), torch.inference_mode():
            estimate, known, _ = self._fit(points, Clock())
            return estimate, *known.evidence(estimate, self.perception.num_rows)

    def with_confidence(self, calibration: Calibration, part_calibration: PartCalibration) -> Estimator:
        """The estimator with another confidence of the whole, and of parts."""
        return replace(self, calibration=calibration, part_calibration=part_calibration)

    def _fit(self, points: ArrayLike, clock: Clock) -> tuple[Estimate, BoxContext, Fit]:
        """The estimate with the boxes of the reference, what is known for better ones, and the fit."""
        options = self.options
        with clock("clean"):
            cloud = Cloud.of(points, options.num_points)
            warnings = cloud_warnings(cloud)
        cloud, clouds, perceived, outlier_share = self._perceive_own(cloud, clock)
        seen = cloud.tensor(self.perception.device)
        with clock("retrieval"):
            found = retrieve_references(self.base, perceived, options.references)
        fit = find_fit(Context(seen, clouds, perceived, found, options), clock).to("cpu")
        with clock("labels"):
            part = cloud.for_every_point(fit.observed.part[0].numpy(), -1)
        if options.normal_alignment:
            with clock("normals"):
                some = cloud.some(_LATE_POINTS)
                theta = align_normals(fit.shapes, fit.theta, cloud.points[some], part[some])
                fit = replace(fit, theta=theta)
        with clock("report"):
            estimate = estimate_of_fit(fit.shapes, fit.observed, [fit.start, fit.theta], part)
            center, size = widen(estimate.rotation, estimate.translation, estimate.size, cloud.points, part)
            estimate = replace(
                estimate,
                translation=center,
                size=size,
                reference=self.base.name(fit.row),
                residual=fit.residual,
                disagreement=fit.disagreement,
                expected_error=float(perceived.spread.exp().median()),
                outlier_share=outlier_share,
                milliseconds=clock.milliseconds,
                part_names=part_names(self.base, fit.row, fit.shapes),
                warnings=with_size(warnings, estimate.size, self.categories),
            )
            if isinstance(perceived, PerceivedTree):
                ways = way_chances(perceived.way_distance[0, : len(estimate.state)].double().cpu().numpy())
                estimate = replace(estimate, ways=ways)
            symptoms = part_symptoms(fit.shapes, fit.observed, fit.theta, perceived.to("cpu"), estimate.visibility)
            estimate = estimate.judged(self.calibration, self.part_calibration, symptoms)
            return estimate, BoxContext.of(cloud, clouds, perceived), fit

    def _perceive_own(self, cloud: Cloud, clock: Clock) -> tuple[Cloud, Clouds, Perceived, float]:
        """The points of the object, what is perceived of them, and the share of the others.

        Points of something else move the middle and the scale of the cloud, by which a network sees it. Where they have
        moved them, it looks again without those that it takes for something else. Where these are most of the cloud, it
        does not know such an object, and nothing is left out.
        """
        clouds = Clouds.of(cloud.tensor(self.perception.device))
        seen, own = self.perceive(clouds, clock)
        foreign = own < _OWN
        share = float(foreign.mean())
        if 0.0 < share < _MOST_FOREIGN:
            kept = torch.from_numpy(~foreign).to(clouds.points.device)
            rest = Clouds.of(clouds.points[:, kept])
            moved = max(float(torch.linalg.vector_norm(rest.center)), abs(float(rest.scale) - 1.0))
            if moved > _MOVED:
                cloud = cloud.without(foreign, self.options.num_points)
                clouds = Clouds.of(cloud.tensor(self.perception.device))
                seen, _ = self.perceive(clouds, clock)
            else:
                cloud, seen = cloud.keep(~foreign), seen.of_points(kept)
                clouds = replace(clouds, points=clouds.points[:, kept])
        if not isinstance(seen, Votes):
            return cloud, clouds, seen, share
        with clock("part grouping"):
            return cloud, clouds, group_votes(seen), share

    def perceive(self, clouds: Clouds, clock: Clock) -> tuple[Perceived | Votes, NDArray[np.float64]]:
        """What a network sees of one cloud, smoothed; and the probability of each point to be of the object."""
        with clock("perception"):
            seen = votes_both_ways(self.perception, clouds.points, self.options.num_points)
            own = seen.own_logits[0].sigmoid().double().cpu().numpy()
        if not (self.options.label_smoothing or (own < _OWN).any()):
            return seen, own
        with clock("label smoothing"):
            return smooth_perceived(clouds, seen, self.options.label_smoothing)
