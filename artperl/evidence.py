"""What a fitted cloud says of where the faces of each part's box are.

A reference's box is that of another object, and most faces of a part are hidden. What tells where they are: the points
that lie on the part; what lies beside it, as the next drawer's front; what perception expects; and the space that the
camera looks through, since a face that stood out would be seen before what lies behind it.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from artperl.batch import Batch

QUANTILES = (0.004, 0.02, 0.1, 0.5, 0.9, 0.98, 0.996)
"""Of the points of a part, along each axis."""
LEVELS = (-0.08, -0.05, -0.03, -0.02, -0.01, -0.005, 0.0, 0.005, 0.01, 0.02, 0.03, 0.05, 0.08)
"""How far out faces are probed, in diagonals of the object."""
NUM_POINTS = 512
"""Points of a cloud that are looked at one by one."""

_PLACES = ((0.0, 0.0), (-0.75, -0.75), (-0.75, 0.75), (0.75, -0.75), (0.75, 0.75))
"""Where each face is probed, in half-sizes from its middle."""
_ON_SURFACE = 0.01
"""A probe no farther than that, in diagonals, before or behind what is seen lies on it."""
_BESIDE = 2.0
"""A probe that many times as far from the nearest point as their neighbours are, as seen, has nothing behind it."""


@dataclass(frozen=True, eq=False)
class Evidence(Batch):
    """B clouds of N points about boxes of P parts. Rest frame of the estimated object, in diagonals of it.

    Attributes
    ----------
    center, size : (B, P, 3) float
        Boxes as the fitted reference has them, widened to hold the points.
    valid : (B, P) bool
    points : (B, N, 3) float
        Carried to rest by the part that each is of.
    ray : (B, N, 3) float
        Directions from the camera to the points, likewise.
    part : (B, N) int64
    quantiles : (B, P, Q, 3) float
        :data:`QUANTILES` of the points of each part; its box's centre where there are none.
    count : (B, P) float
        Share of the points.
    eye : (B, P, 3) float
        Unit vectors from the boxes to the camera.
    probes : (B, P, 6, L, 3) float
        Of each face (-x, -y, -z, +x, +y, +z) moved out by :data:`LEVELS`: the shares that lie before what is seen
        there, beside all that is seen, and on it.
    perceived_center, perceived_size : (B, P, 3) float
        Boxes as perception has them, the root's in the same place.
    """

    center: Tensor
    size: Tensor
    valid: Tensor
    points: Tensor
    ray: Tensor
    part: Tensor
    quantiles: Tensor
    count: Tensor
    eye: Tensor
    probes: Tensor
    perceived_center: Tensor
    perceived_size: Tensor

    @staticmethod
    def of(
        points: Tensor, part: Tensor, T_camera_part: Tensor, center: Tensor, size: Tensor, perceived_center: Tensor,
        perceived_size: Tensor,
    ) -> tuple[Evidence, Tensor]:  # fmt: skip
        """Evidence of one cloud, and the diagonal that is its unit.

        Parameters
        ----------
        points : (N, 3) float
            Camera frame, metres.
        part : (N,) int64
        T_camera_part : (K, 4, 4) float
        center, size : (K, 3) float
            Boxes in the rest frame, metres.
        perceived_center, perceived_size : (K, 3) float
            Metres.

        Returns
        -------
        Evidence
            One row.
        unit : () float
            Metres.
        """
        low, high = (center - 0.5 * size).amin(0), (center + 0.5 * size).amax(0)
        unit = torch.linalg.vector_norm(high - low)
        rotation, translation = T_camera_part[:, :3, :3], T_camera_part[:, :3, 3]
        ray = torch.nn.functional.normalize(points, dim=-1)
        rest = ((points - translation[part])[:, None] @ rotation[part])[:, 0] / unit
        own = part == torch.arange(len(center), device=part.device)[:, None]
        eye = -(translation[:, None] @ rotation)[:, 0] / unit - center / unit
        evidence = Evidence(
            center=center / unit,
            size=size / unit,
            valid=torch.ones_like(center[:, 0], dtype=torch.bool),
            points=rest[:NUM_POINTS],
            ray=(ray[:, None] @ rotation[part])[:NUM_POINTS, 0],
            part=part[:NUM_POINTS],
            quantiles=_quantiles(rest, own, center / unit),
            count=own.to(points.dtype).mean(1),
            eye=torch.nn.functional.normalize(eye, dim=-1),
            probes=_probes(points / unit, ray, rotation, translation / unit, center / unit, size / unit),
            perceived_center=(perceived_center - perceived_center[:1] + center[:1]) / unit,
            perceived_size=perceived_size / unit,
        )
        return evidence.map(lambda tensor: tensor[None]), unit

    def padded(self, rows: int) -> Evidence:
        """With that many rows for parts."""
        missing = rows - self.valid.shape[1]
        by_point = {"points": self.points, "ray": self.ray, "part": self.part}
        fields = {
            name: torch.cat([values, values.new_zeros(len(values), missing, *values.shape[2:])], dim=1)
            for name, values in vars(self).items()
            if name not in by_point
        }
        return Evidence(**fields, **by_point)


def _quantiles(points: Tensor, own: Tensor, center: Tensor) -> Tensor:
    """(K, Q, 3) of points (N, 3), those of each part (K, N)."""
    ordered = points.expand(len(own), -1, -1).masked_fill(~own[..., None], torch.inf).sort(dim=1).values
    count = own.sum(1, keepdim=True)
    share = torch.tensor(QUANTILES, device=points.device)
    place = (share * (count - 1)).round().clamp(min=0).long()
    found = ordered.gather(1, place[..., None].expand(-1, -1, 3))
    return torch.where((count > 0)[..., None], found, center[:, None])


def _probes(points: Tensor, ray: Tensor, rotation: Tensor, translation: Tensor, center: Tensor, size: Tensor) -> Tensor:
    """(K, 6, L, 3) See :attr:`Evidence.probes`; all lengths in diagonals."""
    K, half, levels = len(center), 0.5 * size, torch.tensor(LEVELS, device=points.device)
    places = torch.tensor(_PLACES, device=points.device)
    faces = []
    for sign in (-1.0, 1.0):
        for axis in range(3):
            probe = center[:, None, None].repeat(1, len(levels), len(places), 1)
            probe[..., axis] += sign * (half[:, axis, None] + levels)[..., None]
            for across, place in zip([i for i in range(3) if i != axis], places.T, strict=True):
                probe[..., across] += (half[:, across, None] * place)[:, None]
            faces.append(probe)
    probe = torch.stack(faces, dim=1).flatten(1, 3)
    posed = (probe @ rotation.transpose(1, 2) + translation[:, None]).flatten(0, 1)
    depth = torch.linalg.vector_norm(posed, dim=-1)
    seen = torch.linalg.vector_norm(points, dim=-1)
    # Small clouds hold points several times.
    between = _apart(ray[:NUM_POINTS].unique(dim=0), ray.unique(dim=0))
    spacing = between.topk(min(3, between.shape[1]), largest=False).values[:, -1].median()
    apart, nearest = _apart(posed / depth[:, None], ray).min(-1)
    beside = apart > _BESIDE * spacing
    behind = seen[nearest] - depth
    told = torch.stack([~beside & (behind > _ON_SURFACE), beside, ~beside & (behind.abs() <= _ON_SURFACE)], dim=-1)
    return told.to(points.dtype).reshape(K, 6, len(levels), len(places), 3).mean(3)


def _apart(first: Tensor, second: Tensor) -> Tensor:
    """(N, M) distances, exactly 0 between equal points."""
    return torch.cdist(first, second, compute_mode="donot_use_mm_for_euclid_dist")
