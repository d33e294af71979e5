"""Perception reads clouds of any object in any order, and learns what is true of them."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor

from artperl.core.clouds import Clouds
from artperl.data.batches import batches
from artperl.data.categories import ARTIMAGE
from artperl.data.sources import DataOptions
from artperl.data.truth import Truth
from artperl.evaluation.samples import VALIDATION_SEEDS, frozen_samples
from artperl.methods.estimator_files import load_estimator
from artperl.perception.network import Perceived, Perception, Votes
from artperl.training.perception_losses import perception_figures, perception_losses
from artsim.datasets.plan import SampleOptions
from artsim.observing.sample import Sample


@pytest.fixture(scope="module")
def batch() -> tuple[Clouds, Truth]:
    return next(batches(DataOptions(["laptop", "eyeglasses"]), 4, 128, 4, workers=0))


def network(rows: int = 4) -> Perception:
    torch.manual_seed(0)
    return Perception(rows, width=16).eval()


def test_shapes_of_what_it_says(batch: tuple[Clouds, Truth]) -> None:
    clouds, truth = batch
    perceived = network()(clouds.points)
    assert perceived.part_logits.shape == (4, 128, 4)
    assert perceived.canonical.shape == (4, 128, 3)
    assert perceived.box_size.shape == truth.box_size.shape == (4, 4, 3)
    assert (perceived.box_size > 0).all()
    assert perceived.valid[:, 0].all()
    assert (perceived.part <= 3).all()


def test_points_are_never_given_to_parts_that_the_object_lacks(batch: tuple[Clouds, Truth]) -> None:
    perceived = network()(batch[0].points)
    lacking = torch.full_like(perceived.valid_logits, -1.0)
    lacking[:, 2] = 1.0
    part = Perceived(**{**vars(perceived), "valid_logits": lacking}).part
    assert set(part.flatten().tolist()) <= {0, 2}


def test_objects_of_a_batch_do_not_depend_on_each_other(batch: tuple[Clouds, Truth]) -> None:
    net, points = network(), batch[0].points
    order = torch.tensor([2, 0, 3, 1])
    together, permuted, alone = net(points), net(points[order]), net(points[1:2])
    for name in ("part_logits", "canonical", "log_diagonal"):
        torch.testing.assert_close(getattr(together, name)[order], getattr(permuted, name), atol=1e-5, rtol=1e-4)
        torch.testing.assert_close(getattr(together, name)[1:2], getattr(alone, name), atol=1e-5, rtol=1e-4)


@pytest.mark.slow
def test_it_learns_a_batch_by_heart(batch: tuple[Clouds, Truth]) -> None:
    clouds, truth = batch
    net = network().train()
    optimizer = torch.optim.Adam(net.parameters(), 3e-3)
    seen: list[dict[str, Tensor]] = []
    for _ in range(80):
        seen.append(perception_losses(net(clouds.points), truth))
        optimizer.zero_grad()
        torch.stack(list(seen[-1].values())).sum().backward()  # type: ignore[no-untyped-call]
        optimizer.step()
    for name in ("part", "canonical", "boxes", "diagonal"):
        assert seen[-1][name] < 0.5 * seen[0][name], name


def test_losses_vanish_for_what_is_true(batch: tuple[Clouds, Truth]) -> None:
    clouds, truth = batch
    perceived = network()(clouds.points)
    sure = 50.0 * (2.0 * truth.part_valid.float() - 1.0)
    true = Perceived(
        100.0 * torch.nn.functional.one_hot(truth.part, 4).float(), truth.canonical, perceived.spread,
        100.0 * truth.own - 50.0, sure, truth.box_center, truth.box_size, truth.diagonal.log(),
    )  # fmt: skip
    losses = perception_losses(true, truth)
    for name in ("part", "canonical", "own", "valid", "boxes", "diagonal"):
        assert losses[name].item() == pytest.approx(0.0, abs=1e-6), name


def test_votes_are_learnt_and_losses_vanish_for_true_ones(batch: tuple[Clouds, Truth]) -> None:
    clouds, truth = batch
    torch.manual_seed(0)
    net = Perception(4, 16, votes=True)
    optimizer = torch.optim.Adam(net.parameters(), 3e-3)
    seen: list[dict[str, Tensor]] = []
    for _ in range(80):
        votes = net(clouds.points)
        seen.append(perception_losses(votes, truth))
        optimizer.zero_grad()
        torch.stack(list(seen[-1].values())).sum().backward()  # type: ignore[no-untyped-call]
        optimizer.step()
    for name in ("canonical", "own", "boxes", "joints", "level", "diagonal"):
        assert seen[-1][name] < 0.5 * seen[0][name], name
    assert isinstance(votes, Votes)
    assert (votes.box[..., 3:] > 0).all()
    level = truth.of_points(truth.level)
    box = truth.of_points(torch.cat([truth.box_center, truth.box_size], dim=-1))
    true = Votes(
        truth.canonical, votes.spread, 100.0 * truth.own - 50.0, truth.diagonal.log(), box,
        truth.of_points(truth.joint), truth.of_points(truth.joint),
        100.0 * torch.nn.functional.one_hot(level, 4).float(),
    )  # fmt: skip
    losses = perception_losses(true, truth)
    for name in ("canonical", "own", "boxes", "joints", "level", "diagonal"):
        assert losses[name].item() == pytest.approx(0.0, abs=1e-6), name
    assert perception_figures(true, truth) == {"accuracy": 1.0, "coordinates": 0.0, "own": 1.0}


@pytest.mark.slow
@pytest.mark.parametrize("category", sorted(ARTIMAGE))
def test_a_denser_cloud_is_read_as_well(category: str) -> None:
    net = load_estimator(category).perception
    samples = frozen_samples([category], 6, 2, SampleOptions(num_points=2048), first_seed=VALIDATION_SEEDS)
    right = {n: np.mean([_read(net, sample, n) for sample in samples]) for n in (1024, 2048)}
    assert min(right.values()) > 0.85  # drawers learn from 4,096 points, and the gaps between fronts are few of 1,024
    assert right[2048] > right[1024] - 0.01


def _read(net: Perception, sample: Sample, num_points: int) -> float:
    """Share of the first points that are given to the right part."""
    points = torch.from_numpy(sample.points[None, :num_points]).float()
    with torch.inference_mode():
        part = net(Clouds.of(points).points).part[0].numpy()
    return float((part == sample.part[:num_points]).mean())
