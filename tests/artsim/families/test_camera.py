"""Lenses come out towards the front, and shutter buttons go down."""

from __future__ import annotations

import numpy as np
import pytest

from artsim import make


@pytest.mark.parametrize("seed", range(10))
def test_lenses_slide_to_the_front_and_shutters_down(seed: int) -> None:
    camera = make("camera", seed)
    for part, joint in zip(camera.parts, camera.tree.joints, strict=True):
        if joint.type == "prismatic" and part.label == "lens":
            np.testing.assert_allclose(joint.axis, (-1, 0, 0))
            assert joint.lower == 0
            assert part.bounds[0, 0] < 0  # before the middle of the camera
        if part.name == "shutter_button":
            np.testing.assert_allclose(joint.axis, (0, 0, -1))
            assert part.bounds[0, 2] > 0  # above the middle of the camera


@pytest.mark.parametrize("seed", range(10))
def test_a_lens_that_slides_out_stays_in_the_tube_around_it(seed: int) -> None:
    camera = make("camera", seed)
    for k, (part, joint) in enumerate(zip(camera.parts, camera.tree.joints, strict=True)):
        if k and joint.type == "prismatic" and part.label == "lens":
            back, around = part.bounds[1, 0] - joint.upper, camera.parts[joint.parent].bounds[0, 0]
            assert back > around
