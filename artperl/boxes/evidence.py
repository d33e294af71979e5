"""Where the faces of each part's box may be, as a fitted cloud tells: candidates that a network chooses among.

A reference's box is that of another object, and most faces of a part are hidden. What tells where they are: the points
that lie on the part, at the face or opposite; how large perception takes it to be; and its siblings, since drawers of
one cabinet are mostly as deep as each other.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.clouds import Clouds
from artperl.core.estimate import Estimate, points_at_rest
from artperl.core.neighbours import planes, tree_of
from artperl.perception.network import Perceived
from artperl.perception.preprocess import Cloud

Array = NDArray[np.float64]

BOX_POINTS = 8192
"""Points by which faces of boxes are looked for."""
SHARES = (0.0, 0.004, 0.02, 0.1, 0.5)
"""Of a part's points, that lie farther out than a candidate: labels near a border are not always right."""
NUM_CANDIDATES = len(SHARES) + 7
"""See :attr:`Evidence.candidates`."""
PERCEIVED = len(SHARES) + 2
"""Which of them is where perception has the face."""
_LOOKED_AT, _NEIGHBOURS = 256, 8
"""Points whose surroundings are looked at for noise, and how many of these points there are, with their own."""


@dataclass(frozen=True, eq=False)
class Evidence(Batch):
    """What B clouds tell about boxes of P parts. Rest frame of the estimated object, in diagonals of it.

    Faces are -x, -y, -z, +x, +y, +z.
    """

    center: Tensor
    size: Tensor
    """(B, P, 3) float. Boxes as the fitted reference has them, widened to hold the points."""
    valid: Tensor
    """(B, P) bool."""
    candidates: Tensor
    """(B, P, 6, C) float. How far out of each face of these boxes it may be instead: not at all; at the part's
    :data:`SHARES` of points; at all points; where perception has it; where the part would end, from its outermost point
    opposite, if it were as large as perceived, or as the reference; at its siblings' points; and at the root's."""
    facing: Tensor
    """(B, P, 6) float. Cosine of the angle between the outward normal and the direction to the camera."""
    perceived_size: Tensor
    """(B, P, 3) float."""
    axis: Tensor
    """(B, P, 3) float. Unit vector along which it slides; 0 for parts that turn."""
    share: Tensor
    """(B, P) float. Of the points."""
    roughness: Tensor
    """(B,) float. How far points lie from planes through their neighbours, in the middle: what a sensor's noise leaves
    there, so that outermost points are to be trusted less."""

    @staticmethod
    def of(
        points: Tensor, part: Tensor, T_camera_part: Tensor, axis: Tensor, center: Tensor, size: Tensor,
        perceived_center: Tensor, perceived_size: Tensor, roughness: Tensor,
    ) -> tuple[Evidence, Tensor]:  # fmt: skip
        """Evidence of one cloud, and the diagonal that is its unit.

        Parameters
        ----------
        points : (N, 3) float
            Camera frame, metres.
        part : (N,) int64
        T_camera_part : (K, 4, 4) float
        axis : (K, 3) float
            Unit vectors along which parts slide, camera frame; 0 for others.
        center, size : (K, 3) float
            Boxes in the rest frame, metres.
        perceived_center, perceived_size : (K, 3) float
            Metres; in a rest frame of their own, where the middle of the root's box is the same place.
        roughness : () float
            Of the points: :func:`roughness`, metres.

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
        carried = (points - translation[:, None]) @ rotation / unit
        own = part == torch.arange(len(center), device=part.device)[:, None]
        eye = torch.nn.functional.normalize(-(translation[:, None] @ rotation)[:, 0] - center, dim=-1)
        center, size, perceived_size = center / unit, size / unit, perceived_size / unit
        perceived_center = (perceived_center - perceived_center[:1]) / unit + center[:1]
        evidence = Evidence(
            center=center,
            size=size,
            valid=torch.ones_like(center[:, 0], dtype=torch.bool),
            candidates=_candidates(carried, own, center, size, perceived_center, perceived_size),
            facing=torch.cat([-eye, eye], dim=-1),
            perceived_size=perceived_size,
            axis=(axis[:, None] @ rotation)[:, 0],
            share=own.to(points.dtype).mean(1),
            roughness=roughness / unit,
        )
        return evidence.map(lambda tensor: tensor[None]), unit

    def pad(self, rows: int) -> Evidence:
        """With that many rows for parts."""
        missing = rows - self.valid.shape[1]

        def pad(values: Tensor) -> Tensor:
            return torch.cat([values, values.new_zeros(len(values), missing, *values.shape[2:])], dim=1)

        return self.map(lambda values: pad(values) if values.dim() > 1 else values)


def roughness(points: Tensor) -> Tensor:
    """() median distance, root mean square, of some of the points (N, 3) and their neighbours from planes, metres."""
    cloud, count = points.double().numpy(), min(_NEIGHBOURS, len(points))
    spread = planes(cloud, tree_of(cloud).query(cloud[:_LOOKED_AT], range(1, count + 1))[1])[0]
    return torch.from_numpy(np.sqrt(spread[:, 0].clip(min=0.0) / count)).median().to(points.dtype)


def _candidates(
    carried: Tensor, own: Tensor, center: Tensor, size: Tensor, perceived_center: Tensor, perceived_size: Tensor
) -> Tensor:
    """(K, 6, C) See :attr:`Evidence.candidates`, of points (K, N, 3) in each part's frame, its own being (K, N)."""
    outward = torch.cat([-carried, carried], dim=-1)
    face = _faces(center, size)
    points = _outermost(outward, own, face)
    outermost, opposite = points[..., 0], points[..., 0].roll(3, dims=1)
    places = [
        face, *points.unbind(-1), outward.amax(1), _faces(perceived_center, perceived_size),
        perceived_size.repeat(1, 2) - opposite, size.repeat(1, 2) - opposite, _siblings(outermost, own.any(1)),
        outermost[:1].expand_as(face),
    ]  # fmt: skip
    return torch.stack(places, dim=-1) - face[..., None]


def _faces(center: Tensor, size: Tensor) -> Tensor:
    """(K, 6) how far out each face lies from the origin."""
    return torch.cat([0.5 * size - center, 0.5 * size + center], dim=-1)


def _outermost(outward: Tensor, own: Tensor, face: Tensor) -> Tensor:
    """(K, 6, S) how far out points (K, N, 6) of each part (K, N) reach, but for :data:`SHARES`; its faces if none."""
    rows = face[..., None].repeat(1, 1, len(SHARES))
    for k in own.any(1).nonzero()[:, 0].tolist():
        depth = -outward[k, own[k]].T.numpy()
        place = (torch.tensor(SHARES) * (depth.shape[1] - 1)).round().long().numpy()
        rows[k] = -torch.from_numpy(np.partition(depth, place, axis=1)[:, place])
    return rows


def _siblings(outermost: Tensor, seen: Tensor) -> Tensor:
    """(K, 6) the farthest of other moving parts' outermost points; those of the part itself if no other is seen."""
    number = torch.arange(len(seen), device=seen.device)
    other = (seen & (number > 0) & (number != number[:, None]))[..., None]
    farthest = outermost.masked_fill(~other, -torch.inf).amax(1)
    return torch.where(other.any(1), farthest, outermost)


@dataclass(frozen=True, eq=False)
class BoxContext:
    """What tells about the boxes of one fitted cloud, besides its estimate."""

    points: Array
    """(N, 3) float. Camera frame, metres."""
    log_odds: Array
    """(N, P) float. Of each point to be of each part; NaN for outliers."""
    box_center: Tensor
    box_size: Tensor
    """(P, 3) float. As perceived, in the rest frame, metres."""
    some: NDArray[np.int64]
    """(M,) int64. Points by which faces of boxes are looked for."""
    roughness: Tensor
    """() float. Of these, metres."""

    @staticmethod
    def of(cloud: Cloud, clouds: Clouds, perceived: Perceived) -> BoxContext:
        """All that is known of one cloud."""
        some, metres = cloud.some(BOX_POINTS), (perceived.log_diagonal.exp() * clouds.scale).cpu()
        log_odds = perceived.part_logits.log_softmax(-1)[0].double().cpu().numpy()
        return BoxContext(
            cloud.points, cloud.for_every_point(log_odds, np.nan), perceived.box_center[0].cpu() * metres,
            perceived.box_size[0].cpu() * metres, some, roughness(torch.from_numpy(_single(cloud.points[some]))),
        )  # fmt: skip

    def evidence(self, estimate: Estimate, rows: int) -> tuple[Evidence, float]:
        """Evidence for the boxes of an estimate, padded to that many rows, and its unit in metres."""
        T, K = estimate.T_camera_part, len(estimate.size)
        slides = np.array(estimate.joint_type)[:, None] == "prismatic"
        arrays = (
            self.points[self.some], T, np.where(slides, estimate.joint_axis, 0.0),
            points_at_rest(estimate.translation, T), estimate.size,
        )  # fmt: skip
        points, poses, axis, center, size = (torch.from_numpy(_single(values)) for values in arrays)
        evidence, unit = Evidence.of(
            points, torch.from_numpy(estimate.part[self.some]), poses, axis, center, size,
            self.box_center[:K], self.box_size[:K], self.roughness,
        )  # fmt: skip
        return evidence.pad(rows), float(unit)


def _single(values: Array) -> NDArray[np.float32]:
    return values.astype(np.float32)
