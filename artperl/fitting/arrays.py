"""One object of a batch as NumPy arrays: what compiled loops work on. Shapes are as the batch has them, without B."""

from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from artperl.core.pose import Theta
from artperl.core.shapes import Shapes
from artperl.fitting.correspondence import Target

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


class Tree(NamedTuple):
    """See :class:`artperl.core.trees.Trees`."""

    parent: Indices
    axis: Array
    origin: Array
    lower: Array
    upper: Array
    rest: Array
    turn: Array
    slide: Array
    source: Indices
    multiplier: Array
    offset: Array
    carries: Mask
    order: Indices
    """Parts, parents before their children."""


class Reference(NamedTuple):
    """See :class:`artperl.core.shapes.Shapes`; coordinates of points stand one axis after the other, (P, 3, M)."""

    box_center: Array
    points: Array
    normals: Array
    spacing: Array


class State(NamedTuple):
    """See :class:`artperl.core.pose.Theta`."""

    rotation: Array
    translation: Array
    log_scale: Array
    state: Array
    shift: Array
    stretch: Array


class View(NamedTuple):
    """See :class:`artperl.fitting.correspondence.Target`; ``rays`` are (3, N): coordinates and their squared length."""

    points: Array
    part: Indices
    share: Array
    middle: Array
    unit: float
    rays: NDArray[np.float32]
    gap: float


def tree_of(shapes: Shapes, row: int) -> Tree:
    """The tree of one object."""
    trees = shapes.trees
    names = ("parent", "axis", "origin", "lower", "upper", "rest", "turn", "slide", "source", "multiplier", "offset")
    fields: dict[str, Any] = {name: _double(getattr(trees, name)[row]) for name in (*names, "carries")}
    return Tree(**fields, order=np.argsort(trees.depth[row].cpu().numpy(), kind="stable"))


def reference_of(shapes: Shapes, row: int) -> Reference:
    """The shape of one object."""
    points, normals = (values[row].transpose(1, 2) for values in (shapes.points, shapes.normals))
    return Reference(*(_double(values) for values in (shapes.box_center[row], points, normals, shapes.spacing[row])))


def state_of(theta: Theta, row: int) -> State:
    """The state of one object."""
    return State(*(_double(getattr(theta, name)[row]) for name in State._fields))


def view_of(target: Target, row: int) -> View:
    """One cloud."""
    rays = target.rays[row].double().cpu()
    return View(
        _double(target.observed.points[row]), target.observed.part[row].cpu().numpy(), _double(target.share[row]),
        _double(target.middle[row, 0]), float(target.unit[row]),
        torch.cat([rays.T, rays.square().sum(-1)[None]]).float().numpy(), float(target.gap[row]),
    )  # fmt: skip


def _double(values: torch.Tensor) -> NDArray[np.float64]:
    """Contiguous, floats in double precision; masks and indices as they are."""
    own = values.double() if values.is_floating_point() else values
    return own.contiguous().cpu().numpy()
