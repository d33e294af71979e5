"""Clouds at a common place and size."""

from __future__ import annotations

import torch

from artperl.core.clouds import Clouds
from artsim.observing.sample import Sample


def test_clouds_know_where_they_were(sample: Sample) -> None:
    points = torch.from_numpy(sample.points)[None]
    clouds = Clouds.of(points)
    back = clouds.points * clouds.scale[:, None, None] + clouds.center[:, None]
    torch.testing.assert_close(back, points)


def test_place_and_size_of_a_cloud_do_not_matter(sample: Sample) -> None:
    points = torch.from_numpy(sample.points)[None].double()
    clouds, other = Clouds.of(points), Clouds.of(3.0 * points + torch.tensor([1.0, -2.0, 5.0]))
    torch.testing.assert_close(other.points, clouds.points)
    torch.testing.assert_close(other.scale, 3.0 * clouds.scale)
