"""Carts stand on their wheels, whichever way the casters point."""

from __future__ import annotations

import numpy as np
import pytest

from artsim import make
from artsim.model.transforms import transform_points


@pytest.mark.parametrize("seed", range(12))
def test_wheels_stand_on_the_floor_however_casters_swivel(seed: int) -> None:
    cart = make("cart", seed)
    floor = cart.bounds[0, 2]
    state = cart.tree.rest.copy()
    for k, part in enumerate(cart.parts):
        if part.label == "caster":
            state[k] = 0.7 + k
    poses = cart.tree.forward_kinematics(state)
    for k, part in enumerate(cart.parts):
        if part.label == "wheel":
            low = transform_points(poses[k], part.vertices)[:, 2].min()
            # A wheel is a polygon: the middle of its sides lies 2 % of its radius nearer to the axle.
            assert low == pytest.approx(floor, abs=0.02 * np.ptp(part.vertices[:, 2]))


def test_wheels_turn_about_their_axles_which_lie_across_the_way() -> None:
    for seed in range(6):
        cart = make("cart", seed)
        for k, part in enumerate(cart.parts):
            if part.label == "wheel":
                joint = cart.tree.joints[k]
                assert joint.type == "continuous"
                np.testing.assert_allclose(np.abs(joint.axis), (0, 1, 0))
                np.testing.assert_allclose(part.bounds.mean(axis=0), joint.origin, atol=1e-6)
