"""What references are searched by: the boxes of an object's parts, as perceived or as known."""

import torch
from torch import Tensor

from artperl.retrieval.shape_base import ShapeBase

_MISSING = 4.0
"""Distance, in diagonals, between objects of which one has a part that the other lacks."""

EMBEDDED = 7
"""Numbers of each part in an embedding."""


def box_embedding(valid: Tensor, box_center: Tensor, box_size: Tensor) -> Tensor:
    """Euclidean distance between embeddings is the difference of the parts' boxes, root of the sum of squares.

    Parameters
    ----------
    valid : (B, P) bool
        Parts that the objects have.
    box_center, box_size : (B, P, 3) float
        In the rest frame, in diagonals of the object.

    Returns
    -------
    (B, 7 P) float
    """
    has = valid.to(box_size.dtype)[..., None]
    return torch.cat([_MISSING * has, box_center * has, box_size * has], dim=-1).flatten(1)


def by_boxes(base: ShapeBase) -> ShapeBase:
    """The base, to be searched by :func:`box_embedding`."""
    shapes = base.shapes
    unit = shapes.diagonal[:, None, None]
    return base.with_embeddings(box_embedding(shapes.trees.valid, shapes.box_center / unit, shapes.box_size / unit))
