"""A first guess at every part's pose, from where the perception network says that points lie in the rest frame."""

from dataclasses import replace

import torch
from torch import Tensor

from artperl.core.clouds import Clouds
from artperl.core.pose import Theta, clamp_state, parent_pose, pose_parts, theta_from_parts
from artperl.core.rotations import rotate
from artperl.core.shapes import Shapes
from artperl.perception.network import Perceived

_ROUNDS = 4
_LEAST = 8.0
"""Points from which a part's own pose is trusted; with fewer it stands as at rest against the root."""
_HIDDEN = 0.25
"""Share of the points of another part below which the root hardly shows."""
_FEW = 3
"""Points that tell the state of a joint."""


def part_poses(clouds: Clouds, perceived: Perceived) -> tuple[Tensor, Tensor, Tensor]:
    """Pose of each part by robust weighted Procrustes alignment of its points (Umeyama 1991, without scale).

    The size of the object is the network's: a part seen from one side does not tell it.

    Returns
    -------
    rotation : (B, P, 3, 3) float
        Of ``T_camera_part``.
    center : (B, P, 3) float
        Box centres in the camera frame, metres.
    size : (B, P, 3) float
        Box sizes, metres.
    """
    unit = perceived.log_diagonal.exp()[:, None, None]
    goal = perceived.canonical * unit
    trusted = trust(perceived)
    weight = trusted
    for _ in range(_ROUNDS):
        rotation, translation = procrustes(goal, clouds.points, weight)
        off = rotate(rotation[:, :, None], goal[:, None]) + translation[:, :, None] - clouds.points[:, None]
        distance = off.square().sum(-1)
        typical = (distance * weight).sum(2, keepdim=True) / weight.sum(2, keepdim=True).clamp(min=1e-9)
        weight = trusted / (1.0 + distance / typical.clamp(min=1e-6)) ** 2
    unseen = (trusted > 0).sum(2) < _LEAST
    rotation = torch.where(unseen[..., None, None], rotation[:, :1], rotation)
    translation = torch.where(unseen[..., None], translation[:, :1], translation)
    center = rotate(rotation, perceived.box_center * unit) + translation
    metres = clouds.scale[:, None, None]
    return rotation, center * metres + clouds.center[:, None], perceived.box_size * unit * metres


def trust(perceived: Perceived) -> Tensor:
    """(B, P, N) weight of each point for each part: 0 unless it is labelled so, less where its place is unsure."""
    member = torch.nn.functional.one_hot(perceived.part, perceived.part_logits.shape[2]).transpose(1, 2)
    return member * (-perceived.spread.clamp(-4.0, 2.0)).exp()[:, None]


def start(clouds: Clouds, perceived: Perceived, references: Shapes, count: int) -> tuple[Shapes, Theta]:
    """References adapted to what is perceived, and the states that bring them nearest to the points.

    The root is where :func:`part_poses` has it. The other parts follow down the tree: each joint takes the one state
    that suits its part's points best, so that a thin or hardly visible part cannot turn as no joint of it could.

    Parameters
    ----------
    clouds : Clouds
    perceived : Perceived
        Both of B objects.
    references : Shapes
        ``count`` for each object, neighbours together.
    count : int

    Returns
    -------
    Shapes, Theta
        B * count rows. The shapes have the perceived boxes, so that the states carry no scale.
    """
    trees = references.trees
    rows = trees.num_rows
    rotation, center, size = (pose[:, :rows].repeat_interleave(count, dim=0) for pose in part_poses(clouds, perceived))
    fitted = theta_from_parts(trees, references.box_center, references.box_size, rotation, center, size)
    metres = (perceived.log_diagonal.exp() * clouds.scale).repeat_interleave(count, dim=0)[:, None, None]
    whole = fitted.log_scale.exp()[:, None]
    # From where the reference's boxes are to where they are perceived; the root's lie on each other.
    missing = perceived.box_center[:, :rows].repeat_interleave(count, dim=0) * metres - whole * references.box_center
    origin, known = missing[:, :1], perceived.valid[:, :rows].repeat_interleave(count, dim=0) & trees.valid
    missing = torch.where(known[..., None], missing - origin, 0.0)
    shift = missing - missing.gather(1, trees.parent[..., None].expand(-1, -1, 3))
    shapes = adapt_shapes(references, replace(fitted, shift=shift))
    plain = torch.zeros_like(shift)
    theta = replace(fitted, log_scale=plain[:, 0], stretch=plain, shift=plain, state=shapes.trees.rest)
    own = perceived[torch.arange(len(clouds)).repeat_interleave(count)]
    source = own.canonical * metres - origin
    target = (clouds.points * clouds.scale[:, None, None] + clouds.center[:, None]).repeat_interleave(count, dim=0)
    return shapes, _follow(shapes, theta, source, target, trust(own)[:, :rows])


def starts_by_another_part(
    clouds: Clouds, perceived: Perceived, shapes: Shapes, theta: Theta, states: int
) -> Theta | None:
    """Starts of one object whose root hardly shows: where the part with most points lets the root be.

    A base that is hidden behind its lid has no pose of its own to start from; but the lid is somewhere, and the base is
    hinged to it.

    Parameters
    ----------
    clouds : Clouds
    perceived : Perceived
    shapes : Shapes
    theta : Theta
        All of one object, the last two as :func:`start` gives them.
    states : int
        Of the joint in between, from one limit to the other.

    Returns
    -------
    Theta or None
        Of so many rows; None where the root shows.
    """
    trees, weight = shapes.trees, trust(perceived)[:, : shapes.trees.num_rows]
    count = (weight > 0).sum(2)[0]
    joint = trees.free & (trees.depth == 1) & torch.isfinite(trees.upper - trees.lower)
    k = int(count.masked_fill(~joint[0], -1).argmax())
    if not joint[0, k] or count[0] > _HIDDEN * count[k]:
        return None
    many, grid = shapes.repeat(states), torch.linspace(0.0, 1.0, states).to(theta.state)
    state = theta.state.repeat(states, 1)
    state[:, k] = trees.lower[0, k] + grid * (trees.upper - trees.lower)[0, k]
    theta = replace(theta.repeat(states), state=state)
    posed = pose_parts(many.trees, theta, many.box_center)
    rotation, center, _ = (pose[:, k] for pose in part_poses(clouds, perceived))
    turn = rotation @ posed.rotation[:, k].mT
    theta = replace(
        theta, rotation=turn @ theta.rotation, translation=center + rotate(turn, theta.translation - posed.center[:, k])
    )
    metres = (perceived.log_diagonal.exp() * clouds.scale)[:, None, None]
    source = perceived.canonical * metres - (perceived.box_center[:, :1] * metres - shapes.box_center[:, :1])
    target = clouds.points * clouds.scale[:, None, None] + clouds.center[:, None]
    every = [values.expand(states, -1, -1) for values in (source, target, weight)]
    return _follow(many, theta, *every)


def _follow(shapes: Shapes, theta: Theta, source: Tensor, target: Tensor, weight: Tensor) -> Theta:
    """Joint states, from the root down, that bring points nearest to their partners; others stay at rest.

    Parameters
    ----------
    shapes : Shapes
    theta : Theta
        Of B objects, with the root in place.
    source, target : (B, N, 3) float
        Points in the rest frame, and in the camera frame.
    weight : (B, P, N) float
        Of each point for each part.
    """
    trees = shapes.trees
    told = trees.free & ((weight > 0).sum(2) >= _FEW)
    for depth in range(1, int(trees.depth.max()) + 1):
        posed = pose_parts(trees, theta, shapes.box_center)
        rotation, translation = parent_pose(trees, posed)
        axis, origin = trees.axis[:, :, None], posed.origin_rest[:, :, None]
        here = (target[:, None] - translation[:, :, None]) @ rotation - origin
        there = source[:, None] - origin
        across = there - (there * axis).sum(-1, keepdim=True) * axis
        sine = (weight * (axis * torch.linalg.cross(across, here)).sum(-1)).sum(2)
        cosine = (weight * (across * here).sum(-1)).sum(2)
        slid = (weight * ((here - there) * axis).sum(-1)).sum(2) / weight.sum(2).clamp(min=1e-9)
        step = torch.where(trees.turn != 0, torch.atan2(sine, cosine), slid)
        turn_more = torch.where(trees.rest + step < trees.lower, 2.0 * torch.pi, 0.0) * (trees.turn != 0)
        turn_less = torch.where(trees.rest + step > trees.upper, 2.0 * torch.pi, 0.0) * (trees.turn != 0)
        options = torch.stack([step, step + turn_more, step - turn_less]) + trees.rest
        off = (options - torch.maximum(torch.minimum(options, trees.upper), trees.lower)).abs()
        state = options.gather(0, off.argmin(0)[None])[0]
        state = torch.where(told & (trees.depth == depth), clamp_state(trees, state), theta.state)
        theta = replace(theta, state=state)
    return theta


def adapt_shapes(shapes: Shapes, theta: Theta) -> Shapes:
    """References that have the shape which ``theta`` gives them, so that a state without scale poses them alike."""
    trees = shapes.trees
    posed = pose_parts(trees, theta, shapes.box_center)
    unit = torch.where((trees.slide != 0) & (trees.turn == 0), posed.reach, 1.0)
    mean_scale = posed.scale.mean(-1)
    return Shapes(
        trees=replace(
            trees, origin=posed.origin_rest, lower=trees.lower * unit, upper=trees.upper * unit,
            rest=trees.rest * unit, slide=torch.where(trees.turn == 0, trees.slide, trees.slide * posed.reach),
            offset=trees.offset * unit,
        ),
        box_center=posed.center_rest,
        box_size=shapes.box_size * posed.scale,
        points=posed.center_rest[:, :, None]
        + posed.scale[:, :, None] * (shapes.points - shapes.box_center[:, :, None]),
        normals=torch.nn.functional.normalize(shapes.normals / posed.scale[:, :, None], dim=-1),
        spacing=shapes.spacing * mean_scale,
        diagonal=shapes.diagonal * theta.log_scale.mean(-1).exp(),
    )  # fmt: skip


def resize_shapes(shapes: Shapes, diagonal: Tensor) -> Shapes:
    """References with the diagonals (B,) asked for."""
    plain = Theta.at_rest(shapes.trees)
    log_scale = (diagonal.to(plain.state.dtype) / shapes.diagonal).log()[:, None].expand(-1, 3)
    return adapt_shapes(shapes, replace(plain, log_scale=log_scale))


def procrustes(source: Tensor, target: Tensor, weight: Tensor) -> tuple[Tensor, Tensor]:
    """Rigid motions that bring weighted points nearest to their partners.

    Parameters
    ----------
    source, target : (B, N, 3) float
    weight : (B, P, N) float

    Returns
    -------
    rotation : (B, P, 3, 3) float
    translation : (B, P, 3) float
        ``target = rotation @ source + translation``.
    """
    share = weight / weight.sum(2, keepdim=True).clamp(min=1e-9)
    source_mean, target_mean = share @ source, share @ target
    covariance = torch.einsum("bpn,bni,bnj->bpij", share, target, source)
    covariance = covariance - target_mean[..., :, None] * source_mean[..., None, :]
    u, _, vt = torch.linalg.svd(covariance.double())
    turn = torch.eye(3, dtype=u.dtype, device=u.device).expand(u.shape).clone()
    turn[..., 2, 2] = torch.linalg.det(u @ vt).sign()
    rotation = (u @ turn @ vt).to(source.dtype)
    return rotation, target_mean - rotate(rotation, source_mean)
