"""What the benchmark of stages takes for the truth is the truth, and its last stage is the method's result."""

from __future__ import annotations

import numpy as np
import pytest
import torch

import artsim
from artperl.evaluation.metrics import rotation_error
from artperl.methods.artperl import ArtPERL
from artperl.methods.retrieved import Sizes
from artperl.retrieval.shape_base import ShapeBase
from artperl.retrieval.siamese import by_siamese
from benchmarks.stages import LINES, STAGES, measure
from tests.artperl.worlds import view


@pytest.fixture(scope="module")
def method() -> ArtPERL:
    base = ShapeBase.of([artsim.make("laptop", seed) for seed in range(3)], 96)
    torch.manual_seed(0)
    networks = ArtPERL.new_networks(Sizes(2, segmentation=16, siamese=8, policy=16))
    return ArtPERL(**networks, base=by_siamese(base, networks["siamese"].eval()))


def test_stages_end_with_the_estimate_and_the_truth_stays_the_truth(method: ArtPERL) -> None:
    obj = artsim.make("laptop", 40)
    sample = view(obj, 3)
    found = measure(method, [obj], [sample])
    assert all(tuple(found[line]) == STAGES for line in LINES)
    estimate = method(sample.points)
    off = rotation_error(estimate.rotation, sample.T_camera_part[:, :3, :3])
    np.testing.assert_allclose([part["mean"] for part in found["method"]["refinement"]], off, atol=0.01)
    start = rotation_error(estimate.trajectory[0, :, :3, :3], sample.T_camera_part[:, :3, :3])
    assert np.mean([part["mean"] for part in found["method"]["best start"]]) <= start.mean() + 0.01
    assert max(part["mean"] for part in found["own shape, true labels"]["from the truth"]) < 1.0
    assert 1 <= found["rank"] <= 3
