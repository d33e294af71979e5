"""The paper's retrieval loss is what it prints, and vectors depend on parts."""

from __future__ import annotations

import pytest
import torch

from artperl.retrieval.siamese import Siamese, contrastive_loss, spread_order


def test_the_loss_is_that_of_equation_2() -> None:
    vectors = torch.tensor([[0.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    own = torch.tensor([[0.3, 0.0, 0.4], [0.6, 0.0, 0.0]])
    same = [0.5**2, 2.0**2 + 0.6**2]
    other = [(1.0 - 0.6) ** 2, 0.0]  # the second is farther than the margin
    expected = 0.5 * (0.5 * sum(same) / 2) + 0.5 * (0.5 * sum(other) / 2)
    torch.testing.assert_close(contrastive_loss(vectors, own), torch.tensor(expected))
    far = torch.eye(3)
    assert contrastive_loss(far, far) < 1e-12


def test_vectors_depend_on_which_part_a_point_belongs_to() -> None:
    torch.manual_seed(0)
    network, cloud = Siamese(3, 8), torch.randn(2, 160, 3)
    part = torch.randint(3, (2, 160))
    vector = network(cloud, part)
    assert vector.shape == (2, 24)
    torch.testing.assert_close(network(cloud, part), vector)
    assert not torch.allclose(network(cloud, (part + 1) % 3), vector)
    assert torch.isfinite(network(cloud, torch.zeros_like(part))).all()


@pytest.mark.slow
def test_learning_draws_clouds_of_the_same_object_together() -> None:
    torch.manual_seed(1)
    shapes = torch.randn(6, 160, 3) * torch.linspace(0.3, 1.5, 6)[:, None, None]
    part = torch.randint(2, (6, 160))
    network = Siamese(2, 8)
    optimizer = torch.optim.Adam(network.parameters(), 3e-3)
    for _ in range(60):
        noisy = shapes + 0.02 * torch.randn_like(shapes)
        loss = contrastive_loss(network(noisy, part), network(shapes, part))
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    apart = torch.cdist(network(shapes + 0.02 * torch.randn_like(shapes), part), network(shapes, part))
    assert apart.argmin(1).tolist() == list(range(6))


def test_vectors_do_not_depend_on_the_order_of_points() -> None:
    torch.manual_seed(0)
    network, cloud = Siamese(2, 8), torch.randn(3, 200, 3)
    part = (cloud[..., 0] > 0.2).long()
    order = torch.randperm(200)
    torch.testing.assert_close(network(cloud[:, order], part[:, order]), network(cloud, part), atol=1e-5, rtol=1e-4)


def test_the_first_points_are_spread_over_the_cloud() -> None:
    torch.manual_seed(0)
    cloud = torch.randn(2, 300, 3)
    order = spread_order(cloud, 40)
    assert (order.sort(1).values == torch.arange(300)).all()
    first = cloud.gather(1, order[:, :40, None].expand(-1, -1, 3))
    random = cloud[:, :40]
    assert (torch.cdist(cloud, first).amin(-1).amax(1) < 0.8 * torch.cdist(cloud, random).amin(-1).amax(1)).all()
