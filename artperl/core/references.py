"""What retrieval hands to the fit: objects of the base that may explain a cloud."""

from dataclasses import dataclass

from torch import Tensor

from artperl.core.pose import AxisPrior
from artperl.core.shapes import Shapes


@dataclass(frozen=True, eq=False)
class References:
    """R objects of the base that may explain a cloud, the nearest first."""

    shapes: Shapes
    """R rows, as the base has them."""
    row: Tensor
    """(R,) int64. Of the base."""
    axis_priors: dict[int, AxisPrior | None]
    """By row of the base, how the axes of such objects lean; None where they do not."""
