"""Perception reads clouds of any object in any order, and learns what is true of them."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch import Tensor

from artperl.core.clouds import Clouds
from artperl.core.neighbours import nearest_by_products, nearest_by_trees
from artperl.core.pointnet2 import Neighbourhoods, interpolated, strongest
from artperl.data.batches import batches
from artperl.data.categories import ARTIMAGE, objects_of
from artperl.data.sources import DataOptions, Samples
from artperl.data.truth import Truth
from artperl.estimator import load_estimator
from artperl.evaluation.samples import VALIDATION_SEEDS, frozen_samples
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


def test_place_and_size_of_a_cloud_do_not_matter(batch: tuple[Clouds, Truth]) -> None:
    points = batch[0].points
    other = Clouds.of(3.0 * points + torch.tensor([1.0, -2.0, 5.0]))
    torch.testing.assert_close(other.points, Clouds.of(points).points, atol=1e-4, rtol=1e-4)
    torch.testing.assert_close(other.radius, 3.0 * Clouds.of(points).radius, atol=1e-4, rtol=1e-4)


def test_truth_is_what_the_sample_says() -> None:
    options = SampleOptions(num_points=64)
    clouds, truth = next(batches(DataOptions(["laptop"]), 3, 64, 16, seed=5, workers=0))
    samples = Samples(["laptop"], options, 5, 4, 3)
    for b in range(4):
        sample = samples[b]
        unit = float(clouds.radius[b])
        assert float(truth.diagonal[b]) * unit == pytest.approx(sample.diagonal, rel=1e-5)
        assert truth.part_valid[b].tolist() == [True, True, False]
        rotation, translation = sample.T_camera_part[:, :3, :3], sample.T_camera_part[:, :3, 3]
        canonical = truth.canonical[b].numpy().astype(float) * sample.diagonal
        part = truth.part[b].numpy()
        there = np.einsum("nij,nj->ni", rotation[part], canonical) + translation[part]
        given = (clouds.points[b] * clouds.radius[b] + clouds.center[b]).numpy()
        np.testing.assert_allclose(there, given, atol=2e-3 * sample.diagonal)


def test_batch_n_is_always_the_same() -> None:
    stream = batches(DataOptions(["laptop"]), 2, 32, 4, workers=0)
    batch_list = [next(stream) for _ in range(3)]
    later = next(batches(DataOptions(["laptop"]), 2, 32, 4, first_batch=2, workers=0))
    worked = batches(DataOptions(["laptop"]), 2, 32, 4, workers=2)
    parallel = [next(worked) for _ in range(3)]
    for i in range(3):
        assert torch.equal(batch_list[i][0].points, parallel[i][0].points)
    assert torch.equal(batch_list[2][1].canonical, later[1].canonical)
    assert not torch.equal(batch_list[0][0].points, batch_list[1][0].points)


def test_clouds_are_seen_in_several_batches_and_then_never_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("artperl.data.batches._WINDOW", 3)
    stream = batches(DataOptions(["laptop"]), 2, 32, 8, workers=0)
    centers = [set(next(stream)[0].center[:, 0].round(decimals=5).tolist()) for _ in range(12)]
    fresh = [now.difference(*centers[:n]) for n, now in enumerate(centers)]
    assert [len(views) for views in fresh] == [2] * 12
    for n, views in enumerate(fresh):
        assert not views & set().union(*centers[n + 3 :])
    assert any(views & centers[n + 2] for n, views in enumerate(fresh[:-2]))


@pytest.mark.slow
def test_some_clouds_are_as_a_sensor_sees_them() -> None:
    """The same views, of which a share is rough: points lie off the surfaces that they would lie on."""
    clean, noisy = (next(batches(DataOptions(["drawer"], noisy=share), 4, 256, 32, workers=0)) for share in (0.0, 0.5))
    again = next(batches(DataOptions(["drawer"], noisy=0.5), 4, 256, 32, workers=2))
    assert again[0].points.equal(noisy[0].points)
    same = [bool((a == b).all()) for a, b in zip(clean[0].points, noisy[0].points, strict=True)]
    assert 4 < sum(same) < 28
    assert clean[1].box_size.equal(noisy[1].box_size)


def test_objects_with_too_many_parts_give_way_to_others() -> None:
    samples = Samples(["drawer"], SampleOptions(num_points=16), 0, 1, 3, "any")
    sizes = [len(samples[i].joint_type) for i in range(6)]
    assert max(sizes) <= 3
    assert samples[2].object_id == samples[2].object_id


@pytest.mark.slow
@pytest.mark.parametrize("category", sorted(ARTIMAGE))
def test_objects_have_the_parts_of_artimage(category: str) -> None:
    samples = Samples([category], SampleOptions(num_points=16), 0, 2, 4)
    assert {samples[i].joint_type[1:] for i in range(8)} == {ARTIMAGE[category]}
    assert {obj.tree.types[1:] for obj in objects_of([category], 4, 1_000_000)} == {ARTIMAGE[category]}


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
        100.0 * torch.nn.functional.one_hot(truth.part, 4).float(), truth.canonical, perceived.spread, sure,
        truth.box_center, truth.box_size, truth.diagonal.log(),
    )  # fmt: skip
    losses = perception_losses(true, truth)
    for name in ("part", "canonical", "valid", "boxes", "diagonal"):
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
    for name in ("canonical", "boxes", "joints", "level", "diagonal"):
        assert seen[-1][name] < 0.5 * seen[0][name], name
    assert isinstance(votes, Votes)
    assert (votes.box[..., 3:] > 0).all()
    level = truth.of_points(truth.level)
    box = truth.of_points(torch.cat([truth.box_center, truth.box_size], dim=-1))
    true = Votes(
        truth.canonical, votes.spread, truth.diagonal.log(), box, truth.of_points(truth.joint),
        100.0 * torch.nn.functional.one_hot(level, 4).float(),
    )  # fmt: skip
    losses = perception_losses(true, truth)
    for name in ("canonical", "boxes", "joints", "level", "diagonal"):
        assert losses[name].item() == pytest.approx(0.0, abs=1e-6), name
    assert perception_figures(true, truth) == {"accuracy": 1.0, "coordinates": 0.0}


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


def test_neighbours_are_the_nearest() -> None:
    points = torch.randn(2, 40, 3, generator=torch.Generator().manual_seed(0))
    near = Neighbourhoods.of(points, (10, 4), 5)
    apart = torch.cdist(points[:, :10], points)
    for b in range(2):
        for i in range(10):
            assert set(near.down[0][b, i].tolist()) == set(apart[b, i].argsort()[:5].tolist())
    weight, index = near.up[0]
    torch.testing.assert_close(weight.sum(-1), torch.ones(2, 40))
    best = index.gather(2, weight.argmax(-1, keepdim=True))[..., 0]
    assert torch.equal(best, torch.cdist(points, points[:, :10]).argmin(-1))


def test_trees_and_products_find_the_same_neighbours() -> None:
    generator = torch.Generator().manual_seed(1)
    points, queries = (torch.randn(3, n, 3, generator=generator) for n in (50, 20))
    by_trees, by_products = (
        sorted(zip(near[2, 7].tolist(), index[2, 7].tolist(), strict=True))
        for near, index in (nearest_by_trees(queries, points, 6), nearest_by_products(queries, points, 6))
    )
    assert [i for _, i in by_trees] == [i for _, i in by_products]
    np.testing.assert_allclose([d for d, _ in by_trees], [d for d, _ in by_products], atol=1e-5)
    torch.testing.assert_close(nearest_by_trees(points, points, 1)[1][..., 0], torch.arange(50).expand(3, 50))


def test_strongest_is_the_maximum_over_neighbours_with_its_gradient() -> None:
    generator = torch.Generator().manual_seed(0)
    features = torch.randn(2, 9, 4, generator=generator, requires_grad=True)
    index = torch.randint(0, 9, (2, 5, 3), generator=generator)
    direct = torch.stack([features[b][index[b]].amax(1) for b in range(2)])
    found = strongest(features, index)
    torch.testing.assert_close(found, direct)
    (one,) = torch.autograd.grad((found**2).sum(), features, retain_graph=True)
    (other,) = torch.autograd.grad((direct**2).sum(), features)
    torch.testing.assert_close(one, other)
    torch.testing.assert_close(strongest(features.detach(), index), direct.detach())


def test_interpolated_is_the_weighted_sum_over_neighbours_with_its_gradient() -> None:
    generator = torch.Generator().manual_seed(0)
    features = torch.randn(2, 9, 4, generator=generator, requires_grad=True)
    index = torch.stack([torch.randperm(9, generator=generator)[:3] for _ in range(10)]).reshape(2, 5, 3)
    weight = torch.rand(2, 5, 3, generator=generator)
    direct = torch.stack([(weight[b][..., None] * features[b][index[b]]).sum(1) for b in range(2)])
    found = interpolated(features, weight, index)
    torch.testing.assert_close(found, direct)
    torch.testing.assert_close(interpolated(features.detach(), weight, index), direct.detach())
    (one,) = torch.autograd.grad((found**2).sum(), features, retain_graph=True)
    (other,) = torch.autograd.grad((direct**2).sum(), features)
    torch.testing.assert_close(one, other)


@pytest.mark.slow
@pytest.mark.parametrize("category", sorted(ARTIMAGE))
def test_a_denser_cloud_is_read_as_well(category: str) -> None:
    net = load_estimator(category).perception
    samples = frozen_samples([category], 6, 2, SampleOptions(num_points=2048), first_seed=VALIDATION_SEEDS)
    right = {n: np.mean([_read(net, sample, n) for sample in samples]) for n in (1024, 2048)}
    assert min(right.values()) > 0.9
    assert right[2048] > right[1024] - 0.01


def _read(net: Perception, sample: Sample, num_points: int) -> float:
    """Share of the first points that are given to the right part."""
    points = torch.from_numpy(sample.points[None, :num_points]).float()
    with torch.inference_mode():
        part = net(Clouds.of(points).points).part[0].numpy()
    return float((part == sample.part[:num_points]).mean())
