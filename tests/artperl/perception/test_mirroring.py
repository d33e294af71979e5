"""Votes on a cloud and on its mirror image."""

from __future__ import annotations

import pytest
import torch

from artperl import load_estimator
from artperl.perception.mirroring import votes_both_ways
from artperl.perception.network import Perception, Votes
from tests.artperl.worlds import made

MIRROR = torch.tensor([1.0, -1.0, 1.0])


def test_a_mirror_image_is_seen_as_the_mirror_image_of_what_is_seen() -> None:
    torch.manual_seed(0)
    net, points = Perception(4, 8, votes=True).eval(), 0.4 * torch.randn(1, 300, 3)
    seen = votes_both_ways(net, points, 300)
    image = votes_both_ways(net, points * torch.tensor([-1.0, 1.0, 1.0]), 300)
    assert isinstance(seen, Votes)
    assert isinstance(image, Votes)
    close = torch.testing.assert_close
    close(image.canonical * MIRROR, seen.canonical, atol=1e-5, rtol=1e-4)
    close(image.box[..., :3] * MIRROR, seen.box[..., :3], atol=1e-5, rtol=1e-4)
    for name in ("level_logits", "own_logits", "spread", "log_diagonal"):
        close(getattr(image, name), getattr(seen, name), atol=1e-5, rtol=1e-4)
    close(image.box[..., 3:], seen.box[..., 3:], atol=1e-5, rtol=1e-4)
    assert torch.equal(seen.joint, net(points).joint)


def test_a_network_that_numbers_parts_looks_once() -> None:
    torch.manual_seed(0)
    net, points = Perception(4, 8).eval(), 0.4 * torch.randn(1, 300, 3)
    assert torch.equal(votes_both_ways(net, points, 300).canonical, net(points, 300).canonical)


@pytest.mark.slow
def test_the_shipped_network_takes_a_mirrored_laptop_for_a_laptop() -> None:
    """Left and right of the camera are left and right of the object."""
    net, sample = load_estimator("generic").perception, made("laptop", 3)
    points = torch.from_numpy(sample.points)
    points = (points - points.mean(0)) / (2.0 * points.std(0).norm())
    one, image = (net(cloud[None]) for cloud in (points, points * torch.tensor([-1.0, 1.0, 1.0])))
    off = (image.canonical * MIRROR - one.canonical).norm(dim=-1)
    assert float(off.median()) < 0.05
