"""Starts for chains of joints: a beam search down the tree, in which the parts below tell how those above have turned.

How far a round link has rolled does not show on itself but on what hangs from it. So no joint is settled before the
next: the best few dozen mixes of states are followed from the root down, each joint takes every state of a grid, and
what counts is how far the points of all parts so far are from them.
"""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from artperl.core.batch import Batch, concatenate
from artperl.core.pose import Posed, Theta, pose_parts
from artperl.core.rotations import rotate, rotation_from_vector
from artperl.core.shapes import Observed, Shapes
from artperl.core.trees import Trees
from artperl.fitting.arrays import reference_of, view_of
from artperl.fitting.correspondence import Target
from artperl.fitting.levenberg_marquardt import refine
from artperl.fitting.match_loops import misfits
from artperl.fitting.refine_options import RefineOptions

_STATES = 24
"""States that each joint takes, besides that of the start."""
_TURN = 0.7
"""Radians by which the root is turned about each axis of the camera, one way and the other."""
_ROOTS = 8
"""Poses of the root that are followed."""
_ROOT_ITERATIONS = 6
_LIKELY = 0.1
"""Probability from which a point may be one of a part's."""
_PART_POINTS = 64
"""Points of a part that are compared with it."""
_OUTLINE_RAYS = 256
"""Points of the cloud that tell its outline."""
_SAME = 0.1
"""Radians and diagonals by which what hangs from a chain may lie elsewhere after half turns."""


@dataclass(frozen=True, eq=False)
class _Part(Batch):
    """A part of one object, as an object of its own, and the points that are likely to show it."""

    shape: Shapes
    target: Target

    def misfit(
        self, rotation: Tensor, translation: Tensor, options: RefineOptions, before: Tensor, keep: int
    ) -> Tensor:  # fmt: skip
        """(B,) robust distance of its points from the part in B poses ``T_camera_part``, and what was known before.

        It may be infinite where so many others are lower.
        """
        R, t, known = (values.double().contiguous().cpu().numpy() for values in (rotation, translation, before))
        found = misfits(
            reference_of(self.shape, 0), view_of(self.target, 0), R, t, known, keep, options.outline_weight,
            options.robust_end,
        )  # fmt: skip
        return torch.from_numpy(found).to(before)


def beam(
    shapes: Shapes, cloud: Tensor, probability: Tensor, start: Theta, count: int, width: int, options: RefineOptions
) -> Theta:
    """The best states of a reference that a beam search finds.

    Parameters
    ----------
    shapes : Shapes
        One reference.
    cloud : (1, N, 3) float
        Camera frame, metres, in random order.
    probability : (1, N, P) float
        That a point belongs to a part.
    start : Theta
        Of one row.
    count : int
        States that are asked for.
    width : int
        Hypotheses that are followed.
    options : RefineOptions

    Returns
    -------
    Theta
        ``count`` rows, the best first; fewer where the tree has not as many.
    """
    trees, solid = shapes.trees, shapes.has_surface[0]
    options = replace(options, outline_weight=options.outline_weight / max(1, int(solid.sum())))
    parts = {k: _part(shapes, k, cloud, probability[..., k]) for k in solid.nonzero()[:, 0].tolist()}
    joints, turn = _joint_order(trees)
    theta = _roots(parts[0], start, options) if 0 in parts else start
    cost = torch.zeros_like(theta.translation[:, 0])
    cost = _misfit(parts, turn == 0, _pose(shapes, theta), options, cost, width)
    for number, joint in enumerate(joints, start=1):
        states = torch.cat([_grid(trees, joint).expand(len(theta), -1), theta.state[:, joint, None]], dim=1)
        theta, cost = theta.repeat(states.shape[1]), cost.repeat_interleave(states.shape[1])
        state = theta.state.clone()
        state[:, joint] = states.flatten()
        theta = replace(theta, state=state)
        cost = _misfit(parts, turn == number, _pose(shapes, theta), options, cost, width)
        best = cost.argsort(stable=True)[:width]
        theta, cost = theta[best], cost[best]
    return theta[:count]


def half_turns(shapes: Shapes, theta: Theta) -> Theta | None:
    """Other states of a reference in which all but two of its parts lie where they do; None if there are none.

    Of three joints in a row, the first and the last turn by half, and the one between bends the other way. Where the
    axes meet as in a shoulder or a wrist, what hangs from them stays, and only the shape of two round links differs.

    Parameters
    ----------
    shapes : Shapes
        One reference.
    theta : Theta
        Of one row.
    """
    trees, parent = shapes.trees, shapes.trees.parent[0].tolist()
    turns = (trees.free[0] & (trees.turn[0] != 0.0) & (trees.slide[0] == 0.0)).tolist()
    in_a_row = [(parent[parent[k]], parent[k], k) for k in range(len(parent))]
    others = [_bend_other_way(trees, theta, *row) for row in in_a_row if all(turns[joint] for joint in row)]
    if not others:
        return None
    before, found = _pose(shapes, theta), []
    for other, last in others:
        after = _pose(shapes, other)
        twist = (after.rotation - before.rotation)[:, last].abs().amax()
        apart = torch.linalg.vector_norm((after.center - before.center)[:, last]) / shapes.diagonal
        within = ((other.state >= trees.lower) & (other.state <= trees.upper) | (other.state == theta.state)).all()
        if bool(within & (twist < _SAME) & (apart < _SAME)):
            found.append(other)
    return concatenate(found) if found else None


def _bend_other_way(trees: Trees, theta: Theta, first: int, middle: int, last: int) -> tuple[Theta, int]:
    """The first and the last joint turned by half, the one between bent the other way; and the last one's number."""
    state = theta.state.clone()
    state[:, middle] = 2.0 * trees.rest[:, middle] - state[:, middle]
    for joint in (first, last):
        back = state[:, joint] + torch.pi > trees.upper[:, joint]
        state[:, joint] += torch.where(back, -torch.pi, torch.pi)
    return replace(theta, state=state), last


def _part(shapes: Shapes, part: int, cloud: Tensor, probability: Tensor) -> _Part:
    """One part; its points count for the square of their probability, and all together for as many as they are."""
    likely = (probability[0] > _LIKELY).nonzero()[:, 0]
    likely = probability[0].argmax()[None] if len(likely) == 0 else likely
    weight = probability[:, likely].square()
    some = likely[:_PART_POINTS]
    own = Observed.of(cloud[:, some], torch.zeros_like(some)[None], weight[:, :_PART_POINTS])
    target = Target.of(own, shapes.diagonal)
    whole = Target.of(Observed.of(cloud[:, :_OUTLINE_RAYS], torch.zeros_like(cloud[:, :_OUTLINE_RAYS, 0])), target.unit)
    share = target.share * weight.sum() / cloud.shape[1]
    return _Part(shapes.part(part), replace(target, share=share, rays=whole.rays, gap=whole.gap))


def _joint_order(trees: Trees) -> tuple[list[int], Tensor]:
    """Free joints in the order of their depth, and (P,) after how many of them each part has its place."""
    joints = [j for j in trees.depth[0].argsort(stable=True).tolist() if trees.free[0, j]]
    number = torch.zeros_like(trees.depth[0])
    number[joints] = torch.arange(1, len(joints) + 1, device=number.device)
    return joints, (trees.carries[0] * number[trees.source[0]][:, None]).amax(0)


def _roots(root: _Part, start: Theta, options: RefineOptions) -> Theta:
    """The start with its root where it fits its own points best, after turns about all axes."""
    turns = torch.tensor([-_TURN, 0.0, _TURN], device=start.translation.device)
    turn = rotation_from_vector(torch.cartesian_prod(turns, turns, turns))
    pivot = rotate(start.rotation, root.shape.box_center[:, 0])
    many, theta = root.map(lambda tensor: tensor.expand(len(turn), *tensor.shape[1:])), start.repeat(len(turn))
    rotation, translation = turn @ theta.rotation, theta.translation + pivot - rotate(turn, pivot.expand(len(turn), 3))
    placed = replace(Theta.at_rest(many.shape.trees), rotation=rotation, translation=translation)
    alone = replace(options, outline_weight=0.0, iterations=_ROOT_ITERATIONS)
    refined = refine(many.shape, many.target.observed, placed, alone, rigid=True)
    best = refined.energy.argsort()[:_ROOTS]
    found = refined.theta[best]
    return replace(theta[best], rotation=found.rotation, translation=found.translation)


def _grid(trees: Trees, joint: int) -> Tensor:
    """(S,) states within a joint's limits, evenly spread; all round where it has none."""
    lower, upper = trees.lower[0, joint], trees.upper[0, joint]
    if not bool(torch.isfinite(upper - lower)):
        lower, upper = trees.rest[0, joint] - torch.pi, trees.rest[0, joint] + torch.pi
    middle = torch.arange(0.5, _STATES, dtype=lower.dtype, device=lower.device)
    return lower + (upper - lower) * middle / _STATES


def _pose(shapes: Shapes, theta: Theta) -> Posed:
    """One reference in several states."""
    trees = shapes.trees.map(lambda tensor: tensor.expand(len(theta), *tensor.shape[1:]))
    return pose_parts(trees, theta, shapes.box_center)


def _misfit(
    parts: dict[int, _Part], chosen: Tensor, posed: Posed, options: RefineOptions, before: Tensor, keep: int
) -> Tensor:  # fmt: skip
    """(B,) misfit of the chosen parts together, as posed, and what was known before (B,).

    Infinite for such as are not among the best, of which so many are kept.
    """
    total, own = before, [k for k in parts if chosen[k]]
    for k in own:
        # Only with the last part it is known which are the best.
        kept = min(keep, len(before)) if k == own[-1] else len(before)
        total = parts[k].misfit(posed.rotation[:, k], posed.translation[:, k], options, total, kept)
    return total
