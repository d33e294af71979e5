"""What is true of a sample, as networks learn it."""

from __future__ import annotations

import numpy as np
import pytest

from artperl.data.batches import batches
from artperl.data.sources import DataOptions, Samples
from artsim.datasets.plan import SampleOptions


def test_truth_is_what_the_sample_says() -> None:
    options = SampleOptions(num_points=64)
    clouds, truth = next(batches(DataOptions(["laptop"]), 3, 64, 16, seed=5, workers=0))
    samples = Samples(["laptop"], options, 5, 4, 3)
    for b in range(4):
        sample = samples[b]
        unit = float(clouds.scale[b])
        assert float(truth.diagonal[b]) * unit == pytest.approx(sample.diagonal, rel=1e-5)
        assert truth.part_valid[b].tolist() == [True, True, False]
        rotation, translation = sample.T_camera_part[:, :3, :3], sample.T_camera_part[:, :3, 3]
        canonical = truth.canonical[b].numpy().astype(float) * sample.diagonal
        part = truth.part[b].numpy()
        there = np.einsum("nij,nj->ni", rotation[part], canonical) + translation[part]
        given = (clouds.points[b] * clouds.scale[b] + clouds.center[b]).numpy()
        np.testing.assert_allclose(there, given, atol=2e-3 * sample.diagonal)


def test_what_is_true_of_joints_is_what_the_sample_says() -> None:
    """A door's axis passes its box at the pivot; a drawer has a direction alone; a link's level counts its joints."""
    for category in ("storage_furniture", "robot_arm"):
        _, truth = next(batches(DataOptions([category], parts="any"), 10, 64, 4, seed=3, workers=0))
        samples = Samples([category], SampleOptions(num_points=64), 3, 1, 10, "any")
        sample, joint = samples[0], truth.joint[0].double().numpy()
        for k, kind in enumerate(sample.joint_type):
            if k == 0:
                assert not joint[0].any()
                continue
            turning = kind in ("revolute", "continuous")
            np.testing.assert_allclose(joint[k, :3], 0.0 if turning else sample.joint_axis[k], atol=1e-6)
            np.testing.assert_allclose(joint[k, 3:6], sample.joint_axis[k] if turning else 0.0, atol=1e-6)
            if turning:
                at = sample.box_center[k] + sample.diagonal * joint[k, 6:] - sample.joint_origin[k]
                np.testing.assert_allclose(np.cross(at, sample.joint_axis[k]), 0.0, atol=1e-5)
            level, parent = 1, int(sample.joint_parent[k])
            while parent:
                level, parent = level + 1, int(sample.joint_parent[parent])
            assert int(truth.level[0, k]) == level
