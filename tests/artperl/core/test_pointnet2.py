"""PointNet++: neighbourhoods, maxima and weighted sums over them."""

from __future__ import annotations

import torch

from artperl.core.pointnet2 import Neighbourhoods, PointNet2, interpolate, strongest


def test_neighbours_are_the_nearest() -> None:
    points = torch.randn(2, 40, 3, generator=torch.Generator().manual_seed(0))
    near = Neighbourhoods.of(points, (10, 4), (5, 5))
    apart = torch.cdist(points[:, :10], points)
    for b in range(2):
        for i in range(10):
            assert set(near.down[0][b, i].tolist()) == set(apart[b, i].argsort()[:5].tolist())
    weight, index = near.up[0]
    torch.testing.assert_close(weight.sum(-1), torch.ones(2, 40))
    best = index.gather(2, weight.argmax(-1, keepdim=True))[..., 0]
    assert torch.equal(best, torch.cdist(points, points[:, :10]).argmin(-1))


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
    found = interpolate(features, weight, index)
    torch.testing.assert_close(found, direct)
    torch.testing.assert_close(interpolate(features.detach(), weight, index), direct.detach())
    (one,) = torch.autograd.grad((found**2).sum(), features, retain_graph=True)
    (other,) = torch.autograd.grad((direct**2).sum(), features)
    torch.testing.assert_close(one, other)


def test_a_sparse_cloud_has_the_features_of_one_that_repeats_its_points() -> None:
    torch.manual_seed(0)
    network = PointNet2(8).eval()
    few = torch.nn.functional.normalize(torch.randn(1, 256, 3), dim=-1)
    many = few.repeat(1, 4, 1)
    with torch.no_grad():
        point, cloud = network(few, 1024)
        points, clouds = network(many)
    torch.testing.assert_close(cloud, clouds, atol=1e-5, rtol=1e-4)
    torch.testing.assert_close(point, points[:, :256], atol=1e-5, rtol=1e-4)
    with torch.no_grad():
        assert (network(few)[1] - cloud).abs().max() > 0.01  # its own levels are coarser
