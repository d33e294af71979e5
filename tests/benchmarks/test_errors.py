"""What the benchmark of errors says a known face, label or opening would be worth is what it is worth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from artperl.core.estimate import Estimate
from artperl.estimator import load_estimator
from artperl.evaluation.metrics import true_poses
from artperl.evaluation.samples import frozen_samples
from artsim.observing.sample import Sample
from benchmarks.errors import BINS, Told, in_bins, moving_parts

_SEEDS = 1_300_000
"""Neither of streams and bases, nor of any set of tests or validation."""


@pytest.fixture(scope="module")
def drawers() -> list[Sample]:
    return frozen_samples(["drawer"], 2, 2, first_seed=_SEEDS)


def exact(estimate: Estimate, sample: Sample) -> Estimate:
    rotation, center = true_poses(sample)
    return replace(
        estimate, rotation=rotation, translation=center, size=sample.box_size.copy(),
        T_camera_part=sample.T_camera_part, part=sample.part.astype(np.int64),
    )  # fmt: skip


def test_boxes_that_are_too_deep_are_right_once_their_depth_is_known(drawers: list[Sample]) -> None:
    true = exact(load_estimator("drawer")(drawers[0].points), drawers[0])
    deep = replace(true, size=true.size * (1.25, 1.0, 1.0))
    for good, off in zip(moving_parts(true, drawers[0]), moving_parts(deep, drawers[0]), strict=True):
        assert [good[name] for name in ("posed", "x known", "y known", "z known")] == pytest.approx([1.0] * 4)
        assert off["x known"] == pytest.approx(1.0)
        assert [off[name] for name in ("posed", "y known", "z known")] == pytest.approx([0.8] * 3)
        assert off["labelled"] == 1.0 or (np.isnan(off["labelled"]) and off["points"] == 0)


def test_parts_are_told_apart_by_how_far_they_have_moved(drawers: list[Sample]) -> None:
    sample = drawers[1]
    low, high = sample.joint_limits[1:].T
    rows = moving_parts(exact(load_estimator("drawer")(sample.points), sample), sample)
    assert [row["percent moved"] for row in rows] == pytest.approx(100 * (sample.joint_state[1:] - low) / (high - low))
    table = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    for by in BINS:
        assert sum(means["parts"] for means in in_bins(table, by).values()) == len(rows)


@pytest.mark.slow
def test_an_estimator_that_is_told_labels_uses_them(drawers: list[Sample]) -> None:
    estimator = load_estimator("drawer")
    for sample in drawers:
        told = Told(**vars(estimator), sample=sample)(sample.points).part
        assert np.mean(told == sample.part) > 0.98
        assert np.mean(told == sample.part) >= np.mean(estimator(sample.points).part == sample.part)
