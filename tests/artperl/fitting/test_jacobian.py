"""The Jacobian against automatic differentiation."""

from __future__ import annotations

from dataclasses import replace

import torch

import artsim
from artperl.core.pose import Theta, pose_parts
from artperl.core.rotations import rotate, rotation_from_vector
from artperl.core.shapes import Observed, Shapes
from artperl.fitting.correspondence import Target
from tests.artperl.fitting.torch_jacobian import part_rates, residual_rates, retract
from tests.artperl.fitting.torch_matches import Matches, match


def test_the_jacobian_is_the_derivative_of_the_distances() -> None:
    objects = [artsim.make("drawer", 2), artsim.make("laptop", 1), artsim.make("drawer", 3)]
    shapes = Shapes.from_objects(objects, 32, dtype=torch.float64)
    wide = torch.full_like(shapes.trees.rest, 9.0)  # derivatives end at limits
    shapes = replace(shapes, trees=replace(shapes.trees, lower=-wide, upper=wide))
    B, P = shapes.trees.valid.shape
    rng = torch.Generator().manual_seed(0)

    def normal(*shape: int) -> torch.Tensor:
        return torch.randn(*shape, generator=rng, dtype=torch.float64)

    theta = Theta(rotation_from_vector(normal(B, 3)), torch.tensor([0.0, 0.0, 3.0]).double() + 0.1 * normal(B, 3),
                  0.2 * normal(B, 3), shapes.trees.rest + 0.3,
                  0.05 * normal(B, P, 3), 0.1 * normal(B, P, 3))  # fmt: skip
    part = torch.randint(0, P, (B, 40), generator=rng) % shapes.trees.valid.sum(1, keepdim=True)
    points = theta.translation[:, None] + 0.5 * normal(B, 40, 3)
    target = Target.of(Observed.of(points, part), shapes.diagonal)
    matches = match(shapes, target, theta, 0.0)
    directions = torch.stack([matches.normal, matches.tangent], dim=2)
    in_part = torch.einsum("bnji,bndj->bndi", _of_part(matches, matches.posed.rotation), directions)

    def distance(step: torch.Tensor) -> torch.Tensor:
        """Offsets from discs that move with their parts."""
        moved, lean = retract(shapes.trees, theta, torch.zeros_like(theta.shift), step, target.middle)
        leant = replace(shapes.trees, axis=rotate(rotation_from_vector(lean), shapes.trees.axis))
        posed = pose_parts(leant, moved, shapes.box_center)
        rotation = _of_part(matches, posed.rotation)
        adapted = _of_part(matches, posed.center_rest) + _of_part(matches, posed.scale) * (
            matches.local - _of_part(matches, shapes.box_center)
        )
        disc = (rotation @ adapted[..., None])[..., 0] + _of_part(matches, posed.translation)
        return torch.einsum("bnij,bndj,bni->bnd", rotation, in_part, matches.point - disc)

    D = 9 + 10 * P
    expected = torch.autograd.functional.jacobian(distance, torch.zeros(B, D, dtype=torch.float64))
    expected = torch.stack([expected[b, :, :, b] for b in range(B)])
    parts = part_rates(shapes, target.middle, theta, matches.posed, rigid=False, leans=True)
    found = residual_rates(shapes, target.middle, matches, directions, rigid=False) @ _of_part(matches, parts)
    shift = 9 + 4 * P
    expected[..., shift : shift + 3] = 0.0  # the root's anchor is nobody's
    slides = (shapes.trees.turn == 0).repeat_interleave(3, dim=1)
    expected[..., 9 + 7 * P :] *= ~slides[:, None, None]  # rails do not lean
    torch.testing.assert_close(found, expected, atol=1e-9, rtol=1e-9)


def _of_part(matches: Matches, values: torch.Tensor) -> torch.Tensor:
    return torch.stack([values[b, matches.part[b]] for b in range(len(values))])
