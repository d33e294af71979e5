"""Shiny and clear surfaces come back in part, all others whole."""

from __future__ import annotations

import numpy as np
import pytest

from artsim import Camera
from artsim.making.solids import box
from artsim.model.appearance import Lights, Material, Sun
from artsim.renderers.scene import Scene
from artsim.scenes.ground_truth import observe_scene
from artsim.scenes.missing_returns import missing_share
from artsim.scenes.props import place_solid

DAYLIGHT = Lights(Sun((0.0, 0.0, -1.0), (1.0, 1.0, 1.0)), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
CHROME, GLASS, CARD = (
    Material((1, 1, 1), 0.22, metallic=0.85),
    Material((1, 1, 1), 0.1, transmission=0.8),
    Material((1, 1, 1)),
)


def test_only_polished_metal_and_clear_bodies_are_missed() -> None:
    assert missing_share(CARD) == 0.0
    assert missing_share(CHROME) == pytest.approx((0.85 * 0.78) ** 2)
    assert missing_share(Material((1, 1, 1), 1.0, metallic=1.0)) == 0.0  # rough metal scatters


@pytest.mark.parametrize("shiny", [CHROME, GLASS])
def test_holes_lie_on_the_shiny_half_in_its_share_and_the_truth_keeps_no_hole(shiny: Material) -> None:
    plate = box((0, -1, -1), (0.1, 0, 1)) + box((0, 0, -1), (0.1, 1, 1))
    scene = Scene((place_solid("plate", plate, [CARD, shiny]),), (), (), DAYLIGHT)
    camera = Camera.look_at((-2, 0, 0), (0, 0, 0), 240, 180)
    seen = observe_scene(scene, [camera], 256, "raycast", misses=True, seed=3)[0]
    shown = seen.frame.instance_ids == 0
    hole = shown & (seen.depth == 0)
    # The camera looks towards +X: +Y is on its left.
    left = np.arange(240) < 118
    right = np.arange(240) >= 122
    assert not hole[:, right].any()
    assert hole[:, left].sum() / shown[:, left].sum() == pytest.approx(missing_share(shiny), abs=0.06)
    sample = seen.samples[0]
    assert sample is not None
    assert np.array_equal(sample.part_mask != 255, shown)
    column, row = camera.project(sample.points).astype(int).T
    assert not hole[row, column].any()
    assert np.array_equal(seen.depth[~hole], seen.frame.depth[~hole])
