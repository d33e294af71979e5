"""One call, from a cloud to poses: any cloud, whatever its size, place and dirt."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
import torch

from artperl.data.categories import objects_of
from artperl.data.truth import to_batch, training_rows
from artperl.evaluation import metrics
from artperl.evaluation.metrics import true_poses
from artperl.evaluation.samples import frozen_samples
from artperl.evaluation.scoring import score
from artperl.methods.estimator_files import load_estimator
from artperl.methods.full import Estimator
from artperl.perception.network import Votes
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artsim.errors import ArtsimError
from artsim.observing.sample import Sample
from tests.artperl.worlds import Oracle, true_votes


def test_who_sees_well_estimates_well(estimator: Estimator, sample: Sample) -> None:
    estimate = estimator(sample.points)
    rotation, center = true_poses(sample)
    assert metrics.rotation_error(estimate.rotation, rotation).max() < 4.0
    assert metrics.translation_error(estimate.translation, center, sample.diagonal).max() < 0.04
    assert (estimate.part == sample.part).mean() > 0.95
    assert estimate.state.shape == (2,)
    assert estimate.joint_type == ("free", "revolute")
    assert estimate.joint_parent.tolist() == [-1, 0]
    assert metrics.axis_error(estimate.joint_axis[1], sample.joint_axis_camera[1]) < 4.0
    assert np.allclose(estimate.rotation, estimate.T_camera_part[:, :3, :3])
    assert np.allclose(estimate.trajectory[-1], estimate.T_camera_part)
    assert ((estimate.visibility >= 0) & (estimate.visibility <= 1)).all()
    assert estimate.reference.startswith("laptop:")
    assert set(estimate.milliseconds) >= {"clean", "perception", "refine"}


def test_dirt_does_not_matter(estimator: Estimator, sample: Sample) -> None:
    rng = np.random.default_rng(0)
    dirty = np.concatenate([
        sample.points, np.full((50, 3), np.nan), rng.normal(size=(40, 3)) * 20.0, np.array([[np.inf, 0.0, 1.0]])
    ])  # fmt: skip
    estimate = estimator(dirty)
    rotation, _ = true_poses(sample)
    assert metrics.rotation_error(estimate.rotation, rotation).max() < 4.0
    shown = len(sample.points)
    assert (estimate.part[shown : shown + 50] == -1).all()
    assert (estimate.part[shown + 50 :] == -1).mean() > 0.9
    assert (estimate.part[:shown] >= 0).mean() > 0.98


@pytest.mark.parametrize("count", [12, 300, 10_000])
def test_clouds_of_any_number_of_points(estimator: Estimator, sample: Sample, count: int) -> None:
    chosen = np.random.default_rng(0).choice(len(sample.points), count)
    noise = np.random.default_rng(1).normal(size=(count, 3)) * 1e-4
    estimate = estimator(sample.points[chosen] + noise)
    assert len(estimate.part) == count
    assert np.isfinite(estimate.T_camera_part).all()


def test_an_estimate_takes_one_thread_and_leaves_torch_as_it_was(estimator: Estimator, sample: Sample) -> None:
    before, used = torch.get_num_threads(), []
    hook = estimator.perception.register_forward_hook(lambda *_: used.append(torch.get_num_threads()))
    try:
        torch.set_num_threads(2)
        estimator(sample.points)
        with pytest.raises(ArtsimError):
            estimator(np.zeros((0, 3)))
        assert used == [1]
        assert torch.get_num_threads() == 2
    finally:
        hook.remove()
        torch.set_num_threads(before)


class Voter(Oracle):
    """Knows of each point what its part is like, and no numbers, also on the mirror image."""

    votes = True

    def forward(self, points: torch.Tensor, standard: int = 0) -> Votes:  # type: ignore[override]
        rows = training_rows(self.sample, 2048, self.num_rows)
        clouds, truth = to_batch({k: torch.from_numpy(np.asarray(v)[None]) for k, v in rows.items()})
        apart = {side: torch.cdist(points * points.new_tensor([side, 1.0, 1.0]), clouds.points) for side in (1.0, -1.0)}
        side = min(apart, key=lambda own: float(apart[own].min(-1)[0].mean()))
        nearest = apart[side].argmin(-1)[0]
        votes = Votes(**{name: v if v.ndim == 1 else v[:, nearest] for name, v in vars(true_votes(truth)).items()})
        mirror = points.new_tensor([1.0, side, 1.0])
        return replace(votes, canonical=votes.canonical * mirror, box=votes.box * torch.cat([mirror, torch.ones(3)]))


@pytest.mark.slow
def test_a_cabinet_of_a_mix_that_no_reference_has_is_put_together_from_votes() -> None:
    """Parts, axes and states of fresh furniture, from a base of other furniture."""
    base = by_boxes(ShapeBase.of(objects_of(["storage_furniture"], 12, 2_000_000, "any", 10), 64))
    seen = [s for s in frozen_samples(["storage_furniture"], 8, 1, parts="any", max_parts=10)
            if np.bincount(s.part, minlength=len(s.joint_type)).min() > 160]  # fmt: skip
    assert len(seen) >= 4
    right = []
    for sample in seen:
        estimate = Estimator(Voter(sample, 10), base)(sample.points)
        assert estimate.joint_parent.tolist() == sample.joint_parent.tolist()
        sliding = [kind == "prismatic" for kind in sample.joint_type]
        assert [kind == "prismatic" for kind in estimate.joint_type] == sliding
        right += (score(Estimator(Voter(sample, 10), base), sample).rotation < 10.0).tolist()
    assert np.mean(right) > 0.9


def test_drawers_slide_as_their_states_say_and_not_into_their_case() -> None:
    drawers = load_estimator("drawer")
    (sample,) = frozen_samples(["drawer"], 1, 1)
    assert drawers.boxes is not None
    boxes = copy.deepcopy(drawers.boxes)
    with torch.no_grad():
        boxes.among[-1].bias[-1] = -100.0  # all are farther in than they can be
    for estimator, shut in ((drawers, False), (replace(drawers, boxes=boxes), True)):
        estimate = estimator(sample.points)
        T = estimate.T_camera_part
        apart = np.einsum("kji,kj->ki", np.broadcast_to(T[0, :3, :3], (4, 3, 3)), T[:, :3, 3] - T[0, :3, 3])
        assert np.allclose(np.linalg.norm(apart, axis=1), np.abs(estimate.state), atol=1e-3)
        assert (estimate.state > -1e-9).all()
        assert shut == np.allclose(estimate.state, 0.0)
