"""Distractors are closed solids."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from artsim.scenes.props import DISTRACTORS, distractor

pytestmark = pytest.mark.slow


@pytest.mark.parametrize("name", sorted(DISTRACTORS))
def test_distractors_are_closed_solids_of_a_handy_size(name: str) -> None:
    for seed in range(5):
        solid, materials = DISTRACTORS[name](np.random.default_rng(seed))
        assert len(materials) == len(solid.pieces)
        mesh = trimesh.Trimesh(*solid.union(), process=False)
        assert mesh.is_volume
        assert 0.02 < mesh.extents.max() < 0.3
    assert len(distractor(np.random.default_rng(0))[1]) == 1
