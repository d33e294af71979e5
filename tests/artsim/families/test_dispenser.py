"""Pumps are pressed down; taps and levers are at the front."""

from __future__ import annotations

import numpy as np
import pytest

from artsim import make


@pytest.mark.parametrize("seed", range(12))
def test_pumps_go_down_and_their_nozzles_reach_to_the_front(seed: int) -> None:
    dispenser = make("dispenser", seed)
    for k, part in enumerate(dispenser.parts):
        joint = dispenser.tree.joints[k]
        if part.label == "pump":
            np.testing.assert_allclose(joint.axis, (0, 0, -1))
            assert joint.origin[0] - part.bounds[0, 0] > part.bounds[1, 0] - joint.origin[0]
        elif part.label == "lever":
            assert part.bounds[0, 0] < 0
