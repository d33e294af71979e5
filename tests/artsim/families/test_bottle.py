"""Bottles are closed at rest; what closes them comes off, upward or to the back."""

from __future__ import annotations

import numpy as np
import pytest

from artsim import make
from artsim.model.transforms import transform_points


@pytest.mark.parametrize("seed", range(12))
def test_closures_leave_the_mouth_upward_or_to_the_back(seed: int) -> None:
    bottle = make("bottle", seed)
    for k, part in enumerate(bottle.parts):
        if part.name not in ("lid", "cup", "stopper") or bottle.tree.joints[k].type == "continuous":
            continue
        opened = bottle.tree.rest.copy()
        opened[k] = bottle.tree.joints[k].upper
        T = bottle.tree.forward_kinematics(opened)[k]
        moved = transform_points(T, part.vertices).mean(axis=0) - part.vertices.mean(axis=0)
        assert moved[2] > 0 or moved[0] > 0
        # A cap that turns on its thread moves the mean of its vertices a little.
        assert moved[0] > -1e-3 * bottle.diagonal
        assert abs(moved[1]) < 1e-3 * bottle.diagonal


def test_pumps_are_pressed_down_into_a_collar_that_turns() -> None:
    pumps = [o for o in (make("bottle", seed) for seed in range(40)) if any(p.name == "pump" for p in o.parts)]
    assert pumps
    for bottle in pumps:
        k = [part.name for part in bottle.parts].index("pump")
        joint = bottle.tree.joints[k]
        assert joint.type == "prismatic"
        np.testing.assert_allclose(joint.axis, (0, 0, -1))
        assert bottle.parts[joint.parent].name == "collar"
