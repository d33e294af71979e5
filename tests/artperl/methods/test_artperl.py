"""The paper's method estimates what it can, and comes back from disk as it was."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

import artsim
from artperl.agent.actions import BINS, NOTHING, NUM_AXES, SCALE, nearest_bin, residual
from artperl.agent.decision_process import Fitting, FittingOptions
from artperl.agent.ppo import PPOOptions, rollout
from artperl.agent.start import MeanView
from artperl.core.shapes import Observed
from artperl.evaluation.metrics import rotation_error
from artperl.fitting.refine_options import RefineOptions
from artperl.methods.artperl import ArtPERL, ArtPERLOptions
from artperl.methods.estimator_files import load_estimator
from artperl.methods.estimator_writing import save_estimator
from artperl.methods.retrieved import Sizes
from artperl.perception.segmentation import Segmentation
from artperl.retrieval.shape_base import ShapeBase
from artperl.retrieval.siamese import by_siamese
from artperl.training.fitting_problems import part_truth
from artsim.errors import ConfigError, DatasetError
from artsim.observing.sample import Sample
from tests.artperl.worlds import view

SIZES = Sizes(2, segmentation=16, siamese=8, policy=16)


class Truth(Segmentation):
    """Knows the part of every point of one sample."""

    def __init__(self, sample: Sample):
        super().__init__(2, 16)
        points = torch.from_numpy(sample.points).float()
        self.center, local = points.mean(0), points - points.mean(0)
        self.points, self.part = local, torch.from_numpy(sample.part.astype(np.int64))

    def forward(self, points: torch.Tensor) -> torch.Tensor:
        known = self.points / torch.linalg.vector_norm(self.points, dim=-1).square().mean().sqrt() / 2.0
        nearest = torch.cdist(points[0], known).argmin(-1)
        return 10.0 * torch.nn.functional.one_hot(self.part[nearest], 2)[None].float()


def untrained(base: ShapeBase, options: ArtPERLOptions | None = None) -> ArtPERL:
    torch.manual_seed(0)
    networks = ArtPERL.new_networks(SIZES)
    siamese = networks["siamese"]
    return ArtPERL(**networks, base=by_siamese(base, siamese.eval()), options=options)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def base() -> ShapeBase:
    return ShapeBase.of([artsim.make("laptop", seed) for seed in range(4)], 128)


def test_its_own_object_is_fitted_from_a_near_start() -> None:
    """True labels, the object itself as reference, and a policy that does nothing: the refinement does the rest.

    Of three starts the one nearest to the truth is kept.
    """
    obj = artsim.make("laptop", 11)
    sample = view(obj, 3)
    method = untrained(ShapeBase.of([obj], 256))
    method.segmentation = Truth(sample)
    for parameter in method.policy.heads.parameters():
        torch.nn.init.zeros_(parameter)  # the mean step is none
    _, rotation, _, _, _, _ = part_truth(sample, 2)
    # The start is the true view but for ten degrees, and the joint is where the start has it: half-way.
    seen = rotation[0].T.numpy() @ np.array([0.0, 0.0, -1.0])  # towards the camera, in the rest frame
    azimuth, elevation = np.rad2deg(np.arctan2(-seen[1], -seen[0])), np.rad2deg(np.arcsin(seen[2]))
    views = tuple(MeanView(azimuth + 8.0 + aside, elevation + 6.0) for aside in (-70.0, 0.0, 70.0))
    method.options = replace(method.options, starts=views)
    estimate = method(sample.points)
    assert rotation_error(estimate.rotation, rotation.numpy()).max() < 3.0
    assert (estimate.part == sample.part).mean() > 0.99
    assert len(estimate.trajectory) == 1 + 12 * 2 + 1  # start, the agent's steps of both levels, refinement
    start = rotation_error(estimate.trajectory[0][:, :3, :3], rotation.numpy())
    assert start.max() > 8.0
    assert start[0] < 15.0


def test_the_root_scales_and_its_scale_reaches_the_boxes(base: ShapeBase) -> None:
    method = untrained(base, ArtPERLOptions(starts=(MeanView(),), refine=RefineOptions(iterations=0)))
    for parameter in method.policy.heads.parameters():
        torch.nn.init.zeros_(parameter)  # no step along any other axis
    with torch.no_grad():  # of a free joint, the first scale axis, one step of 0.09 in each of 12 rounds
        method.policy.heads.bias.view(-1, NUM_AXES)[0, SCALE.start] = BINS[NOTHING + 4]
    estimate = method(view(artsim.make("laptop", 7), 1).points)
    row = method.base.object_ids.index(estimate.reference.split(":")[1])
    ratio = estimate.size / base.shapes.box_size[row, :2].numpy()
    np.testing.assert_allclose(ratio[0], ratio[1], rtol=1e-4)  # one scale of all parts, by Theta
    np.testing.assert_allclose(ratio[0, 0] / ratio[0, 1:], np.exp(12 * 0.09), rtol=1e-3)


def test_the_deployed_policy_is_the_learnt_one(base: ShapeBase) -> None:
    """On every axis the method takes the action that rollouts draw most often, as often as the policy says."""
    times, options = 400, FittingOptions(steps=1, observed_points=64, reference_points=24)
    method = untrained(base, ArtPERLOptions(fitting=options))
    torch.nn.init.normal_(method.policy.heads.weight, std=6.0, generator=torch.Generator().manual_seed(0))
    sample = view(artsim.make("laptop", 5), 2, 256)
    points, part = torch.from_numpy(sample.points)[None].float(), torch.from_numpy(sample.part.astype(np.int64))[None]
    reference, observed = base.shapes[[0]], Observed.of(points, part)
    before, after, *_ = method.fit(reference, observed)
    S = len(before)
    episodes = Fitting(reference.repeat(S * times), observed.repeat(S * times), before.repeat(times), options)
    with torch.no_grad():
        probability = method.policy(episodes.view()[::times])[0][:, 0].softmax(-1)
    step = residual(reference.repeat(S), before, after, episodes.radius[::times])
    taken = nearest_bin(step)[:, 0]  # the root begins
    buffer, _ = rollout(method.policy, episodes, before.repeat(times), PPOOptions(), torch.Generator().manual_seed(0))
    drawn = buffer.action[: S * times, 0].unflatten(0, (S, times))
    often = torch.nn.functional.one_hot(drawn, len(BINS)).double().mean(1)
    error = (probability * (1.0 - probability) / times).sqrt()
    assert ((often - probability).abs() <= 4.5 * error + 3.0 / times).all()
    first, second = probability.topk(2, -1).values.unbind(-1)
    clear = first - second > 0.2
    assert clear.sum() > 10
    assert len(taken[clear].unique()) > 2
    assert torch.equal(often.argmax(-1)[clear], taken[clear])


def test_the_method_without_shipped_weights_says_how_to_train_it() -> None:
    with pytest.raises(
        DatasetError, match=r"train it: artperl train --category stapler --method artperl --preset long"
    ):
        load_estimator("stapler", method="artperl")


def test_an_estimator_of_the_method_full_is_not_taken_for_one(base: ShapeBase, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no such option"):
        load_estimator(tmp_path, method="artperl", seen_from=(-75.0, 75.0))
    with pytest.raises(ConfigError, match="there is no method 'other'"):
        load_estimator(tmp_path, method="other")


def test_damaged_settings_are_refused(base: ShapeBase, tmp_path: Path) -> None:
    save_estimator(untrained(base), tmp_path, {})
    settings = (tmp_path / "estimator.json").read_text()
    for old, new in (('"num_rows": 2', '"num_rows": 2000000000'), ('"siamese": 8', '"siamese": 9')):
        assert old in settings
        (tmp_path / "estimator.json").write_text(settings.replace(old, new))
        with pytest.raises(DatasetError):
            load_estimator(tmp_path, method="artperl")
