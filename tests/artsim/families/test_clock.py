"""Hands of clocks turn clockwise, and pendulums hang down."""

from __future__ import annotations

import numpy as np
import pytest

from artsim import make
from artsim.model.transforms import transform_points


@pytest.mark.parametrize("seed", range(10))
def test_hands_turn_clockwise_as_seen_from_the_front(seed: int) -> None:
    clock = make("clock", seed)
    hands = [k for k, part in enumerate(clock.parts) if part.label == "hand"]
    assert 2 <= len(hands) <= 3
    state = clock.tree.rest.copy()
    state[hands] = 0.1
    poses = clock.tree.forward_kinematics(state)
    for k in hands:
        from_axis = clock.parts[k].vertices - clock.tree.origins[k]
        tip = clock.parts[k].vertices[np.argmax(np.linalg.norm(from_axis[:, 1:], axis=1))]
        after = transform_points(poses[k], tip[None])[0]
        # Seen from -X with Z up, +Y is on the left.
        right = -np.array([tip[1], after[1]]) + clock.tree.origins[k][1]
        up = np.array([tip[2], after[2]]) - clock.tree.origins[k][2]
        turned = np.diff(np.unwrap(np.arctan2(right, up)))  # from the top towards the right
        assert turned == pytest.approx(0.1)


def test_pendulums_hang_from_their_pivot_and_swing_both_ways() -> None:
    found = 0
    for seed in range(30):
        clock = make("clock", seed)
        for k, part in enumerate(clock.parts):
            if part.name == "pendulum":
                found += 1
                joint = clock.tree.joints[k]
                assert part.vertices[:, 2].max() <= joint.origin[2] + 1e-9
                assert joint.lower == -joint.upper
    assert found
