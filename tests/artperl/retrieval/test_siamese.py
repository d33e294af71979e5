"""The paper's retrieval loss is what it prints, and vectors depend on parts."""

from __future__ import annotations

import torch

from artperl.retrieval.siamese import Siamese, contrastive_loss, margins


def test_the_loss_is_that_of_equation_2_with_a_margin_for_each_pair() -> None:
    vectors = torch.tensor([[0.0, 0.0, 0.0], [0.0, 2.0, 0.0]])
    own = torch.tensor([[0.3, 0.0, 0.4], [0.6, 0.0, 0.0]])
    same = [0.5**2, 2.0**2 + 0.6**2]
    other = [(1.0 - 0.6) ** 2, (3.0 - (0.3**2 + 2.0**2 + 0.4**2) ** 0.5) ** 2]
    expected = 0.5 * (0.5 * sum(same) / 2) + 0.5 * (0.5 * sum(other) / 2)
    margin = torch.tensor([[9.0, 1.0], [3.0, 9.0]])  # the same object has none
    torch.testing.assert_close(contrastive_loss(vectors, own, margin), torch.tensor(expected))
    far = torch.eye(3)
    assert contrastive_loss(far, far, 2.0**0.5 * torch.ones(3, 3)) < 1e-12


def test_margins_are_one_on_average_and_grow_with_the_difference_of_boxes() -> None:
    found = margins(torch.tensor([[0.0, 0.0], [3.0, 4.0], [0.0, 1.0]]))
    assert (found.diagonal() == 0.0).all()
    torch.testing.assert_close(found[0, 1] / found[0, 2], torch.tensor(5.0))
    torch.testing.assert_close(found.sum() / 6, torch.tensor(1.0))
    assert (margins(torch.ones(2, 7)) == 0.0).all()


def test_vectors_depend_on_which_part_a_point_belongs_to() -> None:
    torch.manual_seed(0)
    network, cloud = Siamese(3, 8), torch.randn(2, 160, 3)
    part = torch.randint(3, (2, 160))
    vector = network(cloud, part)
    assert vector.shape == (2, 8)
    torch.testing.assert_close(network(cloud, part), vector)
    assert not torch.allclose(network(cloud, (part + 1) % 3), vector)
    assert torch.isfinite(network(cloud, torch.zeros_like(part))).all()


def test_vectors_do_not_depend_on_the_order_of_points() -> None:
    torch.manual_seed(0)
    network, cloud = Siamese(2, 8), torch.randn(3, 200, 3)
    part = (cloud[..., 0] > 0.2).long()
    order = torch.randperm(200)
    torch.testing.assert_close(network(cloud[:, order], part[:, order]), network(cloud, part), atol=1e-5, rtol=1e-4)
