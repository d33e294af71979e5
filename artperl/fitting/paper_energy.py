"""The paper's refinement: equations 6 and 7 of ArtPERL, minimised by a gradient optimiser."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from artperl.core.batch import Batch
from artperl.core.pose import Posed, Theta, clamp_state, pose_parts
from artperl.core.rotations import rotate, rotation_from_vector
from artperl.core.shapes import Observed, Shapes, faces_camera
from artperl.core.trees import Trees


@dataclass(frozen=True, eq=False)
class Minimum(Batch):
    """Where a minimisation of B objects ends.

    Attributes
    ----------
    theta : Theta
    energy, start_energy : (B,) float
        Of equations 6 and 7, in the end and at the start.
    """

    theta: Theta
    energy: Tensor
    start_energy: Tensor


def part_energy(shapes: Shapes, observed: Observed, posed: Posed, unit: Tensor) -> Tensor:
    """Equation 6: chamfer distance between each part's observed points and the posed reference's, summed over parts.

    The paper prints "s R P' - t", where it must add t. Of the reference only what faces the camera counts: a partial
    cloud is not near to what its camera did not see. Distances are squared.

    Parameters
    ----------
    shapes : Shapes
    observed : Observed
    posed : Posed
    unit : (B,) float
        Metres that count as 1.

    Returns
    -------
    (B,) float
    """
    points = posed.points(shapes.points, shapes.box_center)
    B, P, M, _ = points.shape
    of_part = torch.nn.functional.one_hot(observed.part, P).transpose(1, 2) * observed.weight[:, None]  # (B, P, N)
    with torch.no_grad():  # gradients flow through the distances of the nearest pairs alone
        shown = faces_camera(points, posed.normals(shapes.normals)) & shapes.has_surface[..., None]
        apart = torch.cdist(points.flatten(1, 2), observed.points).unflatten(1, (P, M))
        to_reference = apart.masked_fill(~shown[..., None], torch.inf).argmin(2)
        to_cloud = apart.masked_fill(of_part[:, :, None] <= 0, torch.inf).argmin(-1)
        seen, facing = of_part.sum(-1), shown.sum(-1)
    near = points.gather(2, to_reference[..., None].expand(-1, -1, -1, 3))
    there = (of_part * (observed.points[:, None] - near).square().sum(-1)).sum(-1) / seen.clamp(min=1e-12)
    cloud = observed.points.gather(1, to_cloud.flatten(1)[..., None].expand(-1, -1, 3)).reshape(B, P, M, 3)
    back = (shown * (cloud - points).square().sum(-1)).sum(-1) / facing.clamp(min=1)
    return torch.where((seen > 0) & (facing > 0), there + back, 0.0).sum(1) / unit**2


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
    shapes: Shapes, observed: Observed, start: Theta, iterations: int = 100, rate: float = 0.01
) -> Minimum:
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
    """
    trees = shapes.trees
    B, P = trees.valid.shape
    start = replace(start, state=clamp_state(trees, start.state)).detach()
    unit = shapes.diagonal * start.log_scale.mean(1).exp()
    change = torch.zeros(B, 6 + P, dtype=start.state.dtype, device=start.state.device, requires_grad=True)
    optimizer = torch.optim.Adam([change], lr=rate)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, iterations, 0.1 * rate)
    share = observed.weight / observed.weight.sum(1, keepdim=True).clamp(min=1e-12)
    pivot = (observed.points * share[..., None]).sum(1)
    length = torch.where(trees.slide != 0, shapes.diagonal[:, None], 1.0)

    def moved() -> Theta:
        turn = rotation_from_vector(change[:, :3])
        translation = rotate(turn, start.translation - pivot) + pivot + unit[:, None] * change[:, 3:6]
        state = clamp_state(trees, start.state + length * change[:, 6:])
        return replace(start, rotation=turn @ start.rotation, translation=translation, state=state)

    first = least = torch.full((B,), torch.inf, dtype=change.dtype, device=change.device)
    best = start
    for i in range(iterations + 1):
        theta = moved()
        energy = total_energy(shapes, observed, theta, unit)
        better = energy.detach() < least
        best, least = theta.detach().where(better, best), torch.where(better, energy.detach(), least)
        first = least if i == 0 else first
        if i < iterations:
            optimizer.zero_grad()
            energy.sum().backward()
            optimizer.step()
            schedule.step()
    return Minimum(best, least, first)


def total_energy(shapes: Shapes, observed: Observed, theta: Theta, unit: Tensor) -> Tensor:
    """(B,) E = E_P + E_J of the parts as Theta poses them."""
    posed = pose_parts(shapes.trees, theta, shapes.box_center)
    return part_energy(shapes, observed, posed, unit) + joint_energy(shapes.trees, posed.rotation)
