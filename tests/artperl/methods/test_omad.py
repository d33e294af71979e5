"""OMAD with cues that know the truth is right; its prior learns boxes and joints; it comes back from disk as it was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

import artsim
from artperl.data.batches import row_batches
from artperl.data.categories import objects_of
from artperl.data.sources import DataOptions
from artperl.data.truth import to_batch
from artperl.evaluation.metrics import rotation_error
from artperl.methods.omad import OMAD, OMADOptions, omad_networks, state_range
from artperl.methods.protocol import NetworkSizes
from artperl.perception.omad_networks import CueNetwork, Cues
from artperl.retrieval.shape_base import ShapeBase
from artperl.training.omad_stages import ObjectRows, cue_loss, cue_targets, prior_loss
from artperl.training.options import TrainOptions
from artsim.errors import ConfigError


def learnt(base: ShapeBase, steps: int = 200) -> OMAD:
    """A method whose prior has learnt the objects of a base."""
    torch.manual_seed(0)
    networks = omad_networks(NetworkSizes(base.shapes.trees.num_rows, 16), base)
    prior, generator = networks["keypoint_prior"], torch.Generator().manual_seed(0)
    with torch.no_grad():
        prior.mean.add_(base.shapes.box_center.mean(0)[:, None])
    optimizer = torch.optim.Adam(prior.parameters(), lr=5e-3)
    for _ in range(steps):
        loss, _ = prior_loss(prior, base.shapes, generator)
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    return OMAD(**networks, base=base, options=OMADOptions(iterations=5))


class TrueCues(CueNetwork):
    """Says what is true of one cloud."""

    def __init__(self, cues: Cues, points: torch.Tensor):
        super().__init__(cues.keypoints.shape[1], 16)
        self.told, self.cloud = cues, points

    def forward(self, points: torch.Tensor) -> Cues:
        near = torch.cdist(points, self.cloud).argmin(-1)[0]
        return replace(self.told, part_logits=self.told.part_logits[:, near])


def first_rows(category: str, num_points: int = 1024) -> dict[str, torch.Tensor]:
    data = DataOptions((category,))
    rows = len(objects_of([category], 1, 0)[0])
    return next(row_batches(data, rows, num_points, 4, 0, 3, 0, ObjectRows(rows)))


@pytest.mark.slow
@pytest.mark.parametrize("category", ["laptop", "drawer"])
def test_with_true_cues_the_poses_are_true(category: str) -> None:
    rows = {name: values[:1] for name, values in first_rows(category).items()}
    clouds, truth = to_batch(rows)
    method = learnt(ShapeBase.of(objects_of([category], 6, 600), 96), 150)
    targets = cue_targets(method, clouds, rows, torch.device("cpu"))
    low, span = state_range(method.trees(torch.device("cpu")))
    share = (targets.state - low) / span.clamp(min=1e-9)
    cues = Cues(
        20.0 * torch.nn.functional.one_hot(truth.part, truth.level.shape[1]).float(), targets.keypoints,
        targets.quaternion, targets.translation, truth.diagonal.log(), share, targets.beta,
    )  # fmt: skip
    _, figures = cue_loss(method, cues, truth, targets)
    assert figures["keypoint"] < 1e-5
    assert figures["state"] < 1e-4
    assert figures["degrees"] < 0.5
    method.cues = TrueCues(cues, clouds.points)
    estimate = OMAD(method.keypoint_prior, method.cues, method.base, OMADOptions(iterations=0))(
        rows["points"][0].numpy()
    )
    T = rows["T_camera_part"][0].numpy()
    assert rotation_error(estimate.rotation, T[:, :3, :3]).max() < 6.0  # the prior tells joints within some degrees
    np.testing.assert_allclose(estimate.T_camera_part[0], T[0], atol=1e-3)


@pytest.mark.slow
def test_the_prior_learns_the_boxes_and_the_joints_of_its_objects() -> None:
    base = ShapeBase.of([artsim.make("laptop", 700 + n) for n in range(6)], 96)
    method, generator = learnt(base, 0), torch.Generator().manual_seed(0)
    before = prior_loss(method.keypoint_prior, base.shapes, generator)[1]
    after = prior_loss(learnt(base).keypoint_prior, base.shapes, generator)[1]
    assert after["coverage"] < 0.25 * before["coverage"]
    assert after["surface"] < 0.03
    assert after["joint"] < 0.05


def test_objects_that_are_stretched_are_refused() -> None:
    with pytest.raises(ConfigError, match="learns from whole objects"):
        TrainOptions(method="omad", stretched=0.5)
