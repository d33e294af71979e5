"""Kettles are covered at rest, and their bows stand over the lid."""

from __future__ import annotations

import pytest

from artsim import make


@pytest.mark.parametrize("seed", range(12))
def test_lids_lie_on_the_body_and_under_the_bow(seed: int) -> None:
    kettle = make("kettle", seed)
    parts = {part.name: part for part in kettle.parts}
    lid = parts["lid"].bounds
    assert lid[1, 2] > parts["body"].bounds[:, 2].mean()
    joint = kettle.tree.joints[[part.name for part in kettle.parts].index("lid")]
    assert lid[:, 1].mean() == pytest.approx(joint.origin[1], abs=1e-6)
    if "handle" in parts:
        assert parts["handle"].bounds[1, 2] > lid[1, 2]


def test_lids_move_in_every_way() -> None:
    kinds = set()
    for seed in range(40):
        kettle = make("kettle", seed)
        kinds.add(kettle.tree.joints[[part.name for part in kettle.parts].index("lid")].type)
    assert kinds == {"prismatic", "revolute", "continuous", "screw"}
