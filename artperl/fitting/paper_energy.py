"""The paper's refinement: equations 6 and 7 of ArtPERL, minimised by a gradient optimiser."""

from __future__ import annotations

from dataclasses import replace

import torch
from torch import Tensor

from artperl.core.pose import Posed, Theta, Trees, clamp_state, pose_parts
from artperl.core.rotations import rotate, rotation_from_vector
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.levenberg_marquardt import Refined


def part_energy(shapes: Shapes, observed: Observed, posed: Posed, two_sided: bool = True) -> Tensor:
    """Equation 6: chamfer distance between each part's observed points and the posed reference's, summed over parts.

    The paper prints "s R P' - t", where it must add t. Distances are squared and counted in diagonals of the reference.

    Parameters
    ----------
    shapes : Shapes
    observed : Observed
    posed : Posed
    two_sided : bool
        False leaves out the way from the reference to the cloud, which a partial view draws to the parts of the
        surface that happen to be seen.

    Returns
    -------
    (B,) float
    """
    points = posed.points(shapes.points, shapes.box_center)
    B, P, M, _ = points.shape
    of_part = torch.nn.functional.one_hot(observed.part, P).transpose(1, 2) * observed.weight[:, None]  # (B, P, N)
    with torch.no_grad():  # gradients flow through the distances of the nearest pairs alone
        apart = torch.cdist(points.flatten(1, 2), observed.points).unflatten(1, (P, M))
        to_reference = apart.argmin(2)
        to_cloud = apart.masked_fill(of_part[:, :, None] <= 0, torch.inf).argmin(-1)
    near = points.gather(2, to_reference[..., None].expand(-1, -1, -1, 3))
    seen = of_part.sum(-1)
    total = (of_part * (observed.points[:, None] - near).square().sum(-1)).sum(-1) / seen.clamp(min=1e-12)
    if two_sided:
        cloud = observed.points.gather(1, to_cloud.flatten(1)[..., None].expand(-1, -1, 3)).reshape(B, P, M, 3)
        total = total + (cloud - points).square().sum(-1).mean(-1)
    counted = (seen > 0) & shapes.has_surface
    return torch.where(counted, total, 0.0).sum(1) / shapes.diagonal**2


def joint_energy(trees: Trees, rotation: Tensor) -> Tensor:
    """Equation 7: both parts of a joint must carry its direction to the same vector.

    The paper prints R(k1) twice, which would not depend on the poses; the second is R(k2). Poses that come from Theta
    obey it whatever the state, so that it only counts for parts that are posed one by one.

    Parameters
    ----------
    trees : Trees
    rotation : (B, P, 3, 3) float
        Of every part: rest frame -> camera.

    Returns
    -------
    (B,) float
    """
    parent = rotation.gather(1, trees.parent[..., None, None].expand_as(rotation))
    apart = torch.linalg.vector_norm(rotate(parent, trees.axis) - rotate(rotation, trees.axis), dim=-1)
    return (apart * (trees.valid & (trees.depth > 0))).sum(1)


def refine_by_gradient(
    shapes: Shapes,
    observed: Observed,
    start: Theta,
    iterations: int = 100,
    rate: float = 0.01,
    two_sided: bool = True,
) -> Refined:
    """Minimise E_P + E_J over the pose and the joint states with Adam, the scale fixed (section 4.4).

    The best state met on the way is returned, so that the energy never rises; states stay within their limits.

    Parameters
    ----------
    shapes : Shapes
    observed : Observed
    start : Theta
    iterations : int
    rate : float
        First step of Adam, in radians and diagonals; it falls to a tenth along half a cosine.
    two_sided : bool
        See :func:`part_energy`.
    """
    trees = shapes.trees
    B, P = trees.valid.shape
    start = replace(start, state=clamp_state(trees, start.state)).detach()
    change = torch.zeros(B, 6 + P, dtype=start.state.dtype, device=start.state.device, requires_grad=True)
    optimizer = torch.optim.Adam([change], lr=rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, iterations, 0.1 * rate)
    pivot = (observed.points * observed.weight[..., None]).sum(1) / observed.weight.sum(1, keepdim=True).clamp(
        min=1e-12
    )
    length = torch.where(trees.slide != 0, shapes.diagonal[:, None], 1.0)

    def moved() -> Theta:
        turn = rotation_from_vector(change[:, :3])
        translation = rotate(turn, start.translation - pivot) + pivot + shapes.diagonal[:, None] * change[:, 3:6]
        state = clamp_state(trees, start.state + length * change[:, 6:])
        return replace(start, rotation=turn @ start.rotation, translation=translation, state=state)

    first = best_energy = torch.full((B,), torch.inf, dtype=change.dtype, device=change.device)
    best, steps = start, torch.zeros(B, dtype=torch.int64, device=change.device)
    for i in range(iterations + 1):
        theta = moved()
        posed = pose_parts(trees, theta, shapes.box_center)
        energy = part_energy(shapes, observed, posed, two_sided) + joint_energy(trees, posed.rotation)
        better = energy.detach() < best_energy
        best, best_energy = theta.detach().where(better, best), torch.where(better, energy.detach(), best_energy)
        first, steps = (best_energy, steps) if i == 0 else (first, steps + better)
        if i < iterations:
            optimizer.zero_grad()
            energy.sum().backward()
            optimizer.step()
            schedule.step()
    return Refined(best, shapes.trees.axis, best_energy, first, steps)
