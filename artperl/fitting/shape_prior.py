"""How far an object's shape may differ from its reference's: a Gaussian prior on scale, stretch, shift and lean."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.pose import AxisPrior
from artperl.core.shapes import Shapes
from artperl.fitting.columns import Columns
from artperl.fitting.refine_options import RefineOptions

_AXIS_FLOOR = 0.02
"""Radians by which an axis may lean in any direction, besides those that the objects of the base show."""


@dataclass(frozen=True, eq=False)
class ShapePrior(Batch):
    """What deviations p of B references cost: ``p . precision p``, in squared diagonals."""

    active: Tensor
    """(B, D) bool. Parameters that move at all, in the order of :class:`Columns`. D ends after the shifts where no axis
    leans."""
    precision: Tensor
    """(B, D, D) float. Pose and states cost nothing."""

    @staticmethod
    def of(shapes: Shapes, unit: Tensor, options: RefineOptions, axis_prior: AxisPrior | None) -> ShapePrior:
        """The prior of references whose objects have diagonals ``unit (B,)``."""
        trees = shapes.trees
        B, P = trees.valid.shape
        columns = Columns(P)
        always = torch.ones(B, 6, dtype=torch.bool, device=unit.device)
        stretched = (trees.valid & shapes.has_surface).repeat_interleave(3, dim=1)
        shifted = (trees.valid & (trees.depth > 0)).repeat_interleave(3, dim=1)
        active = torch.cat([always, trees.free, always[:, :3], stretched, shifted], dim=1)
        if axis_prior is not None:
            active = torch.cat([active, (axis_prior.leans & (trees.turn != 0)).repeat_interleave(3, dim=1)], dim=1)
        precision = unit.new_zeros(B, active.shape[1], active.shape[1])
        eye, mean = torch.eye(3, device=unit.device), torch.full((3, 3), 1.0 / 3.0, device=unit.device)
        precision[:, columns.log_scale, columns.log_scale] = (
            mean / 3.0 / options.sigma_scale**2 + (eye - mean) / options.sigma_aspect**2
        )
        diagonal = precision.diagonal(dim1=1, dim2=2)
        diagonal[:, columns.stretch] = options.sigma_stretch**-2
        diagonal[:, columns.shift] = (unit[:, None] * options.sigma_shift) ** -2
        if axis_prior is not None:
            floor = _AXIS_FLOOR**2 * torch.eye(3 * P, device=unit.device)
            precision[:, columns.lean, columns.lean] = torch.linalg.inv(axis_prior.covariance + floor).to(unit.dtype)
        precision = precision * active[:, None] * active[:, :, None]
        return ShapePrior(active, options.prior_weight * precision)
