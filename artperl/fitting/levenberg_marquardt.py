"""Refinement under kinematic constraints (ArtPERL, section 4.4), on Theta: what every result obeys, by construction.

Two solvers: :func:`refine`, Levenberg-Marquardt on robust distances from the observed points to the reference's
surface, takes milliseconds; :func:`refine_by_gradient` minimises the paper's energy (equations 6 and 7).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor
from torch.nn import functional

from artperl.core.batch import Batch
from artperl.core.pose import AxisPrior, Posed, Theta, Trees, clamp_state, complete_state, joint_axes, parent_pose
from artperl.core.rotations import rotate, rotation_from_vector
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.correspondence import GLIDE, Matches, Target, match
from artsim.errors import ConfigError

_AXIS_FLOOR = 0.02
"""Radians by which an axis that leans may do so in any direction."""


@dataclass(frozen=True)
class RefineOptions:
    """How the reference is fitted. Lengths are in diagonals of the observed object.

    A sigma says how far a property of the object may differ from the reference's; 0 keeps the reference's.
    """

    iterations: int = 20
    """At most; fewer when nothing improves any more, and none to leave the start as it is."""
    rigid_iterations: int = 4
    """Of these, the first that leave the reference's shape as it is."""
    robust_start: float = 0.2
    robust_end: float = 0.03
    narrowing: float = 0.6
    """Distance at which a point loses its say (Geman-McClure): at first, at last, and its share kept per iteration."""
    sigma_scale: float = 0.3
    """Logarithm of the overall scale."""
    sigma_aspect: float = 0.2
    """Logarithm of the scale along each axis against the overall scale."""
    sigma_stretch: float = 0.1
    """Logarithm of a part's own scale against that of the whole."""
    sigma_shift: float = 0.1
    """Position of a joint's anchor."""
    sigma_size: float = 0.1
    """Logarithm of a part's size against the size that is expected, where one is."""
    outline_weight: float = 0.3
    """Weight of the reference's points outside the cloud's outline against that of the cloud's points."""
    prior_weight: float = 5e-6
    """Squared distance that a deviation of one sigma costs."""
    tolerance: float = 1e-3
    """Relative decrease of the energy, made by a step or promised by one that failed, below which an object is done."""

    def __post_init__(self) -> None:
        if not 0 <= self.iterations <= 10_000 or not 0.0 < self.robust_end <= self.robust_start:
            raise ConfigError("refinement needs a number of iterations and 0 < robust_end <= robust_start")


@dataclass(frozen=True, eq=False)
class Refined(Batch):
    """Outcome of a refinement of B objects.

    Attributes
    ----------
    theta : Theta
    axis : (B, P, 3) float
        The reference's axes as they lean now: those of ``shapes.trees`` unless they were free to.
    energy, start_energy : (B,) float
        Of the result and of the start; the first is never larger.
    iterations : (B,) int64
        That changed something.
    """

    theta: Theta
    axis: Tensor
    energy: Tensor
    start_energy: Tensor
    iterations: Tensor


def refine(
    shapes: Shapes,
    observed: Observed,
    start: Theta,
    options: RefineOptions | None = None,
    expected_size: Tensor | None = None,
    axis_prior: AxisPrior | None = None,
) -> Refined:
    """Fit references to observed clouds by Levenberg-Marquardt on Theta.

    Every iteration matches the points anew, and a step is taken only if the robust energy, matched anew, falls; for an
    object whose step fails, damping grows. Joint states stay within their limits.

    Parameters
    ----------
    shapes : Shapes
    observed : Observed
    start : Theta
        For several starts of one object, repeat the rows of shapes and clouds.
    options : RefineOptions, optional
    expected_size : (B, P, 3) float, optional
        Sizes of the parts' boxes, metres, that something else predicts; NaN where nothing does.
    axis_prior : AxisPrior, optional
        Lets axes lean away from the reference's; without it they stay.

    Returns
    -------
    Refined
    """
    options = options or RefineOptions()
    unit = shapes.diagonal * start.log_scale.mean(-1).exp()
    prior = _Prior.of(shapes, unit, options, expected_size, axis_prior)
    start = replace(start, state=clamp_state(shapes.trees, start.state))
    target = Target.of(observed, unit)
    current, lean = match(shapes, target, start, options.outline_weight), torch.zeros_like(start.shift)
    current_cost = prior.cost(start, lean)
    first = robust(current, options.robust_end) + current_cost
    damping = torch.full_like(unit, 1e-2)
    steps = torch.zeros_like(unit, dtype=torch.int64)
    settled = torch.zeros_like(unit, dtype=torch.bool)
    width, normal, turned = options.robust_start, None, shapes
    for i in range(options.iterations):
        rigid = i < options.rigid_iterations
        if normal is None:
            normal = _Normal.of(turned, target, current, lean, prior, width, rigid)
        step = normal.step(damping, prior.active.shape[1])
        theta, leant = _moved(shapes.trees, current.theta, lean, step, target.middle)
        moved = leaning(shapes, leant)
        candidate = match(moved, target, theta, options.outline_weight)
        cost = prior.cost(theta, leant)
        before, after = robust(current, width) + current_cost, robust(candidate, width) + cost
        better = after < before
        current_cost, lean = torch.where(better, cost, current_cost), torch.where(better[:, None, None], leant, lean)
        if bool(better.all()):
            current, turned = candidate, moved
        else:
            current = candidate.where(better, current)
            turned = leaning(shapes, lean)
        steps += better
        if width == options.robust_end and not rigid:
            worth = torch.where(better, before - after, normal.promised(step))
            settled |= worth < options.tolerance * before
        damping = torch.where(better, 0.3 * damping, 10.0 * damping).clamp(1e-3, 1e8)
        before_width, width = width, max(options.robust_end, options.narrowing * width)
        if bool(better.any()) or width != before_width or i + 1 == options.rigid_iterations:
            normal = None  # what it says is of another state, or of other weights
        if bool(settled.all()):
            break
    final = robust(current, options.robust_end) + current_cost
    # Steps that paid at a larger width need not have paid at the last one.
    improved = final < first
    lean = torch.where(improved[:, None, None], lean, 0.0)
    energy = torch.where(improved, final, first)
    return Refined(current.theta.where(improved, start), leaning(shapes, lean).trees.axis, energy, first, steps)


def leaning(shapes: Shapes, lean: Tensor) -> Shapes:
    """References whose axes are turned by rotation vectors (B, P, 3)."""
    if not bool(lean.any()):
        return shapes
    return replace(shapes, trees=replace(shapes.trees, axis=rotate(rotation_from_vector(lean), shapes.trees.axis)))


@dataclass(frozen=True, eq=False)
class _Prior(Batch):
    """Which parameters p move, and what they cost: ``p . precision p - 2 pull . p + constant``.

    Parameters are ordered as :func:`_maps` says.
    """

    active: Tensor
    precision: Tensor
    pull: Tensor
    constant: Tensor

    @staticmethod
    def of(
        shapes: Shapes, unit: Tensor, options: RefineOptions, expected_size: Tensor | None, axis_prior: AxisPrior | None
    ) -> _Prior:
        """The prior of references whose objects have diagonals ``unit (B,)``."""
        trees = shapes.trees
        B, P = trees.valid.shape
        eye, mean = torch.eye(3, device=unit.device), torch.full((3, 3), 1.0 / 3.0, device=unit.device)
        always = torch.ones(B, 6, dtype=torch.bool, device=unit.device)
        scaled = torch.full((B, 3), options.sigma_scale > 0 or options.sigma_aspect > 0, device=unit.device)
        stretched = (trees.valid & shapes.has_surface & (options.sigma_stretch > 0)).repeat_interleave(3, dim=1)
        shifted = (trees.valid & (trees.depth > 0) & (options.sigma_shift > 0)).repeat_interleave(3, dim=1)
        active = torch.cat([always, trees.free, scaled, stretched, shifted], dim=1)
        if axis_prior is not None:
            active = torch.cat([active, (axis_prior.leans & (trees.turn != 0)).repeat_interleave(3, dim=1)], dim=1)
        tight = 1e-4  # a sigma of 0 for one of two that share the same parameters
        whole, stretches = slice(6 + P, 9 + P), slice(9 + P, 9 + 4 * P)
        precision = unit.new_zeros(B, active.shape[1], active.shape[1])
        precision[:, whole, whole] = (
            mean / 3.0 / max(options.sigma_scale, tight) ** 2 + (eye - mean) / max(options.sigma_aspect, tight) ** 2
        )
        diagonal = precision.diagonal(dim1=1, dim2=2)
        diagonal[:, stretches] = max(options.sigma_stretch, tight) ** -2
        shifts = slice(stretches.stop, stretches.stop + 3 * P)
        diagonal[:, shifts] = (unit[:, None] * max(options.sigma_shift, tight)) ** -2
        pull, constant = unit.new_zeros(B, active.shape[1]), torch.zeros_like(unit)
        if axis_prior is not None:
            axes = slice(shifts.stop, None)
            floor = _AXIS_FLOOR**2 * torch.eye(3 * P, device=unit.device)
            precision[:, axes, axes] = torch.linalg.inv(axis_prior.covariance + floor).to(unit.dtype)
        if expected_size is not None:
            known = torch.isfinite(expected_size) & (expected_size > 0) & (shapes.box_size > 0)
            missing = torch.where(known, (expected_size / shapes.box_size).log(), 0.0) / options.sigma_size
            adds = unit.new_zeros(B, P, 3, active.shape[1])  # log_scale and stretch add up to a part's own scale
            adds[..., whole] = eye
            adds[..., stretches] = torch.eye(3 * P, device=unit.device).reshape(P, 3, 3 * P)
            adds = (adds * known[..., None] / options.sigma_size).flatten(1, 2)
            precision = precision + adds.transpose(1, 2) @ adds
            pull = pull + (adds * missing.flatten(1)[..., None]).sum(1)
            constant = constant + missing.square().sum((1, 2))
        precision = precision * active[:, None] * active[:, :, None]
        weight = options.prior_weight
        return _Prior(active, weight * precision, weight * pull * active, weight * constant)

    def cost(self, theta: Theta, lean: Tensor) -> Tensor:
        """(B,)"""
        values = self.values(theta, lean)
        return (values * ((self.precision @ values[..., None])[..., 0] - 2.0 * self.pull)).sum(-1) + self.constant

    def values(self, theta: Theta, lean: Tensor) -> Tensor:
        """(B, D) deviations of the reference's shape; the other parameters count as 0."""
        pose = torch.zeros_like(self.active[:, : 6 + theta.state.shape[1]], dtype=theta.state.dtype)
        shape = [theta.log_scale, theta.stretch.flatten(1), theta.shift.flatten(1), lean.flatten(1)]
        return torch.cat([pose, *shape], dim=1)[:, : self.active.shape[1]]


def robust(matches: Matches, width: float) -> Tensor:
    """(B,) mean robust squared distance in diagonals.

    Geman-McClure's ``w^2 e^2 / (w^2 + e^2)``: it falls when the width w shrinks, so that narrowing it on the way never
    raises the energy either.
    """
    square = matches.square
    return (matches.weight * (width**2 * square / (width**2 + square))).sum(1)


@dataclass(frozen=True, eq=False)
class _Normal(Batch):
    """Normal equations of the reweighted least squares, of D parameters: the same until something changes.

    Attributes
    ----------
    curvature : (B, D, D) float64
    slope : (B, D) float64
    moves : (B, D) float64
        1 for parameters that move, 0 for others.
    """

    curvature: Tensor
    slope: Tensor
    moves: Tensor

    @staticmethod
    def of(
        shapes: Shapes, target: Target, matches: Matches, lean: Tensor, prior: _Prior, width: float, rigid: bool
    ) -> _Normal:
        """At a state; shape parameters are left out when ``rigid``."""
        weight = matches.weight * (width**2 / (width**2 + matches.square)) ** 2
        directions = torch.stack([matches.normal, GLIDE * (matches.excess > 0)[..., None] * matches.across], dim=2)
        residual = torch.stack([matches.offset, GLIDE * matches.excess], dim=2).flatten(1)
        leans = prior.active.shape[1] > 9 + 7 * shapes.trees.num_rows
        rows = _rates(shapes, target.middle, matches, directions, rigid).flatten(1, 2)
        maps = _maps(shapes, target.middle, matches.theta, matches.posed, rigid, leans)
        maps = maps / target.unit[:, None, None, None]
        D = maps.shape[-1]
        active = prior.active[:, :D]
        # Sums over each part's points, few numbers, are taken before parameters come in, which are many.
        own = functional.one_hot(matches.part, maps.shape[1]).transpose(1, 2) * weight[:, None]
        weighted = (own.repeat_interleave(2, dim=2)[..., None] * rows[:, None]).transpose(2, 3)
        maps = (maps * active[:, None, None]).flatten(1, 2)
        square = (weighted @ rows[:, None] @ maps.unflatten(1, weighted.shape[1:3])).flatten(1, 2)
        precision = prior.precision[:, :D, :D]
        curvature = (maps.transpose(1, 2) @ square + precision).double()
        slope = (maps.transpose(1, 2) @ (weighted @ residual[:, None, :, None]).flatten(1, 2))[..., 0]
        slope = slope + (precision @ prior.values(matches.theta, lean)[:, :D, None])[..., 0] - prior.pull[:, :D]
        slope = slope.double()
        # A state at its limit stays there while the energy falls beyond it.
        D_states = slice(6, 6 + shapes.trees.num_rows)
        state = matches.theta.state
        held = torch.zeros_like(active)
        held[:, D_states] = ((state <= shapes.trees.lower) & (slope[:, D_states] > 0)) | (
            (state >= shapes.trees.upper) & (slope[:, D_states] < 0)
        )
        moves = (active & ~held).double()
        return _Normal(curvature * moves[:, None] * moves[:, :, None], slope, moves)

    def step(self, damping: Tensor, count: int) -> Tensor:
        """(B, count) damped Gauss-Newton step of all parameters; those that were left out stay."""
        diagonal = self.curvature.diagonal(dim1=1, dim2=2)
        floor = 1e-6 * diagonal.mean(-1, keepdim=True) + 1e-30
        curvature = self.curvature + torch.diag_embed(damping[:, None] * diagonal + floor + (1.0 - self.moves))
        step = torch.linalg.solve(curvature, -(self.slope * self.moves)[..., None])[..., 0].to(damping.dtype)
        return functional.pad(step, (0, count - step.shape[1]))

    def promised(self, step: Tensor) -> Tensor:
        """(B,) by how much the energy would fall after a step (B, count) if every point kept its match."""
        own = step[:, : self.slope.shape[1]].to(self.slope)
        return -(own * (2.0 * self.slope + (self.curvature @ own[..., None])[..., 0])).sum(-1).to(step.dtype)


def _rates(shapes: Shapes, middle: Tensor, matches: Matches, directions: Tensor, rigid: bool) -> Tensor:
    """What the points' offsets from the reference change by, in few numbers, whatever the tree: see :func:`_maps`.

    Parameters
    ----------
    middle : (B, 1, 3) float
        What the object turns about.
    directions : (B, R, 2, 3) float
        Of the offsets, in the camera frame; they turn with the part.

    Returns
    -------
    (B, R, 2, 6) float
        When the part turns about the middle (3) and moves (3); unless ``rigid``, (B, R, 2, 9): when it grows about its
        box centre (3), too.
    """
    point, posed = (matches.point - middle)[:, :, None].expand_as(directions), matches.posed
    rates = [torch.linalg.cross(point, directions), directions]
    if not rigid:
        rotation = _rows(posed.rotation.flatten(2), matches.part).unflatten(2, (3, 3))
        grown = _rows(posed.scale, matches.part) * (matches.local - _rows(shapes.box_center, matches.part))
        rates.append((directions @ rotation) * grown[:, :, None])
    return -torch.cat(rates, dim=-1)


def _maps(shapes: Shapes, middle: Tensor, theta: Theta, posed: Posed, rigid: bool, leans: bool) -> Tensor:
    """How each part turns, moves and grows with the parameters.

    Returns
    -------
    (B, P, 6, D) float, unless ``rigid`` (B, P, 9, D)
        Rows as :func:`_rates` has them; with them, derivatives of the offsets of a part's points are ``rates @ map``.
        Columns: turn about the middle (3), motion (3), states (P), and unless ``rigid`` log_scale (3), stretch (3 P),
        shift (3 P) and, if axes lean at all, lean (3 P).
    """
    trees = shapes.trees
    B, P = trees.valid.shape
    axis, origin = joint_axes(trees, posed)
    turn, arm = trees.turn[..., None], origin - middle
    carried = trees.carries.transpose(1, 2).to(axis.dtype)[:, :, None]  # (B, P, 1, joints)
    # The moment about a joint's axis is that about the middle less the direction's own about the axis (Pluecker).
    slide = (trees.slide * posed.reach)[..., None] * axis - turn * torch.linalg.cross(axis, arm)
    lines = torch.cat([turn * axis, slide], dim=-1).transpose(1, 2)
    follow = trees.multiplier[..., None] * functional.one_hot(trees.source, P)
    whole, stretches = slice(6 + P, 9 + P), slice(9 + P, 9 + 4 * P)
    shifts, leant = slice(9 + 4 * P, 9 + 7 * P), slice(9 + 7 * P, 9 + 10 * P)
    last = slice(6 + P) if rigid else leant if leans else shifts
    maps = axis.new_zeros(B, P, 6 if rigid else 9, last.stop)
    maps[:, :, :6, :6] = torch.eye(6, device=axis.device)
    maps[:, :, :6, 6 : 6 + P] = (carried * lines[:, None]) @ follow[:, None]
    if rigid:
        return maps
    above, _ = parent_pose(trees, posed)
    maps[:, :, 3:6, whole] = _scale_lever(shapes, theta, posed, above)
    maps[:, :, 6:, whole] = torch.eye(3, device=axis.device)
    maps[:, :, 6:, stretches] = torch.eye(3 * P, device=axis.device).reshape(P, 3, 3 * P)
    maps[:, :, 3:6, shifts] = torch.einsum("bpj,bjri->bprji", carried[:, :, 0], above).flatten(3)
    if leans:
        # An axis that leans by d takes what is turned by R, about the anchor, to exp(d) R exp(-d).
        turned = above.transpose(-1, -2) @ posed.rotation
        swing = (turn[..., None] * (above - above @ turned)).transpose(-1, -2)
        lines = torch.cat([swing, -torch.linalg.cross(swing, arm[:, :, None].expand_as(swing))], dim=-1)
        maps[:, :, :6, leant] = carried.repeat_interleave(3, dim=-1) * lines.flatten(1, 2).transpose(1, 2)[:, None]
    return maps


def _scale_lever(shapes: Shapes, theta: Theta, posed: Posed, above: Tensor) -> Tensor:
    """(B, P, 3, 3) how each part's box centre moves in the camera frame when log_scale grows along each axis."""
    trees = shapes.trees
    whole = theta.log_scale.exp()[:, None]
    center = posed.rotation * (whole * shapes.box_center)[:, :, None]
    # Anchors move too, and with them all that they carry; what a joint's own turn does to that cancels its parent's.
    anchor = (above - posed.rotation) * (whole * trees.origin)[:, :, None]
    # Prismatic joints reach farther: d reach / d log_scale_i = (scale_i axis_i)^2 / reach.
    step = (complete_state(trees, theta.state) - trees.rest) * trees.slide
    longer = step[..., None] * (whole * trees.axis) ** 2 / posed.reach[..., None]
    along = rotate(above, trees.axis)[..., None] * longer[:, :, None]
    return center + torch.einsum("bjk,bjxi->bkxi", trees.carries.to(center.dtype), anchor + along)


def _moved(trees: Trees, theta: Theta, lean: Tensor, step: Tensor, middle: Tensor) -> tuple[Theta, Tensor]:
    """Theta and lean after a step of the parameters that :func:`_maps` lists; states stay within their limits."""
    P = trees.num_rows
    turn = rotation_from_vector(step[:, :3])
    pivot = middle[:, 0]
    parts = step[:, 9 + P : 9 + 7 * P].reshape(len(step), 2, P, 3)
    moved = Theta(
        turn @ theta.rotation,
        rotate(turn, theta.translation - pivot) + pivot + step[:, 3:6],
        theta.log_scale + step[:, 6 + P : 9 + P],
        clamp_state(trees, theta.state + step[:, 6 : 6 + P]),
        theta.shift + parts[:, 1],
        theta.stretch + parts[:, 0],
    )
    leant = step[:, 9 + 7 * P :]
    return moved, lean + leant.reshape(lean.shape) if leant.shape[1] else lean


def _rows(values: Tensor, part: Tensor) -> Tensor:
    """(B, R, ...) the row of (B, P, C) that each part index (B, R) names."""
    return values.gather(1, part[..., None].expand(-1, -1, values.shape[-1]))
