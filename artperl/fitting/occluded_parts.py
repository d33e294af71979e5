"""States of hinges whose part hardly shows: those in which no more of it would be seen. Beyond the paper.

A temple that is folded behind its frame leaves no point in a cloud, and nothing pulls its reference from where it was.
But the cloud says where the temple is not: wherever a camera would see it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray

from artperl.core.kd_tree import KDTree
from artperl.core.pose import Theta, pose_parts
from artperl.core.shapes import Shapes

Array = NDArray[np.float64]

_HARDLY = 0.025
"""Share of the points up to which a part, with all that moves with it, hardly shows."""
_TELLING = 3
"""Points that tell the state of a joint."""
_STATES = 65
"""That are tried, from one limit to the other."""
_GAP = 2.5
"""Within an outline the nearest ray is hardly ever farther off than so many times the mean distance of neighbours."""
_AHEAD = 0.015
"""Diagonals by which a surface must lie before what is seen to be seen instead."""
_OFF, _FAR = 0.01, 3.0
"""Diagonals by which points are off the surface of their part, and how many of these count at most."""
_LESS_LIKELY = 4.0
"""Logarithm of how much less likely than the likeliest state the fit must be to be given up."""


@dataclass(frozen=True)
class _View:
    """What a camera sees: depths, by where rays meet the plane at depth 1, and how far apart these are there."""

    rays: KDTree
    depth: Array
    apart: float

    @staticmethod
    def of(points: Array) -> _View | None:
        """The view of a cloud (N, 3), points of which may come more than once; None where it is a single ray."""
        rays, first = np.unique(points[:, :2] / points[:, 2:], axis=0, return_index=True)
        if len(rays) < 2:
            return None
        tree = KDTree.of(rays)
        return _View(tree, points[first, 2], float(np.sqrt(tree.nearest(rays, 2)[0][:, 1]).mean()))

    @property
    def density(self) -> float:
        """Rays to a unit of the plane, if they are random."""
        return 0.25 / self.apart**2

    def would_show(self, points: Array, margin: float) -> NDArray[np.bool_]:
        """(N,) whether surfaces at points (N, 3) would be seen, beside or before what is seen."""
        squared, nearest = (values[:, 0] for values in self.rays.nearest(points[:, :2] / points[:, 2:], 1))
        return (squared > (_GAP * self.apart) ** 2) | (points[:, 2] < self.depth[nearest] - margin)


def pose_occluded_parts(shapes: Shapes, theta: Theta, points: Array, part: NDArray[np.int64]) -> Theta:
    """Theta of one object whose hinges with hardly visible parts are where these would not show more than they do.

    A state is the less likely the more points of the part a camera would have seen beyond those that it has, and the
    farther these are from the surface. Hinges of which fewer than three points tell, and those that the fit has in a
    state that is much less likely than another, get the median of all states by their likelihood.

    Parameters
    ----------
    shapes : Shapes
    theta : Theta
    points : (N, 3) float
        Camera frame, metres.
    part : (N,) int64
        -1 for points of no part.
    """
    trees = shapes.trees
    count = np.bincount(part[part >= 0], minlength=trees.num_rows)
    moved = trees.carries[0].numpy() @ count
    moved = np.bincount(trees.source[0].numpy(), moved, minlength=trees.num_rows)  # followers move with their source
    hinges = trees.free & (trees.turn != 0) & shapes.has_surface & torch.isfinite(trees.upper - trees.lower)
    hardly = np.flatnonzero(hinges[0].numpy() & (moved <= _HARDLY * len(points)))
    view = _View.of(points) if len(hardly) else None
    if view is None:
        return theta
    for k in hardly:  # parents come before their children
        grid = np.linspace(float(trees.lower[0, k]), float(trees.upper[0, k]), _STATES)
        states = np.append(grid, float(theta.state[0, k]))
        *tried, fitted = _log_likelihood(shapes, theta, int(k), states, view, points[part == k])
        if moved[k] < _TELLING or fitted < max(tried) - _LESS_LIKELY:
            share = np.exp(np.array(tried) - max(tried))
            share /= share.sum()
            state = theta.state.clone()
            state[0, k] = float(np.interp(0.5, share.cumsum() - 0.5 * share, grid))
            theta = replace(theta, state=state)
    return theta


def _log_likelihood(shapes: Shapes, theta: Theta, k: int, states: Array, view: _View, own: Array) -> Array:
    """(S,) of states (S,) of part k, of which points (n, 3) are seen, but for a constant."""
    many, state = shapes.repeat(len(states)), theta.state.repeat(len(states), 1)
    state[:, k] = torch.from_numpy(states).to(state)
    posed = pose_parts(many.trees, replace(theta.repeat(len(states)), state=state), many.box_center)
    surface = posed.points(many.points, many.box_center)[:, k].double().numpy()
    normal = posed.normals(many.normals)[:, k].double().numpy()
    unit = float(shapes.diagonal[0] * theta.log_scale[0].mean().exp())
    area = float(shapes.spacing[0, k] * posed.scale[0, k].mean()) ** 2  # that a point of the surface stands for
    facing = -(surface * normal).sum(-1) / np.linalg.norm(surface, axis=-1)
    shows = facing > 0.0
    shows[shows] = view.would_show(surface[shows], _AHEAD * unit)
    more = view.density * area * (np.where(shows, facing, 0.0) / surface[..., 2] ** 2).sum(1)
    # Roots of Poisson counts have a variance of a quarter; half as sure, since surfaces are a reference's.
    likelihood: Array = -0.5 * np.maximum(np.sqrt(more) - np.sqrt(len(own)), 0.0) ** 2
    if len(own):
        off = np.stack([np.sqrt(KDTree.of(here).nearest(own, 1)[0][:, 0]) for here in surface]) / (_OFF * unit)
        likelihood -= 0.5 * (np.minimum(off, _FAR) ** 2).sum(1)
    return likelihood
