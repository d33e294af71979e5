"""The nearest points of the same part are those of a tree of each part's points."""

from __future__ import annotations

import torch
from scipy.spatial import KDTree

from artperl.agent.part_neighbours import _by_torch, nearest_of_part


def test_nearest_points_of_a_part_are_those_of_a_search_tree_in_either_way_of_finding_them() -> None:
    """Of part 2 nothing is observed, of part 3 nothing is shown, and of every part some of the reference is not."""
    generator = torch.Generator().manual_seed(0)
    B, N, P, M = 3, 50, 4, 20
    points, reference = torch.randn(B, N, 3, generator=generator), torch.randn(B, P, M, 3, generator=generator)
    part = torch.tensor([0, 1, 3])[torch.randint(3, (B, N), generator=generator)]
    shown = torch.rand(B, P, M, generator=generator) < 0.6
    shown[:, 3] = False
    for found in (nearest_of_part(points, part, reference, shown), _by_torch(points, part, reference, shown)):
        for b in range(B):
            for k in range(P):
                own, facing = part[b] == k, shown[b, k].nonzero()[:, 0]
                if own.any() and len(facing):
                    apart, nearest = KDTree(reference[b, k, facing]).query(points[b, own])
                    torch.testing.assert_close(found.there_distance[b, own], torch.from_numpy(apart).float())
                    assert torch.equal(found.there_index[b, own], facing[nearest])
                else:
                    assert torch.isinf(found.there_distance[b, own]).all()
                    assert (found.there_index[b, own] == 0).all()
                if own.any():
                    apart, nearest = KDTree(points[b, own]).query(reference[b, k])
                    torch.testing.assert_close(found.back_distance[b, k], torch.from_numpy(apart).float())
                    assert torch.equal(found.back_index[b, k], own.nonzero()[:, 0][nearest])
                else:
                    assert torch.isinf(found.back_distance[b, k]).all()
                    assert (found.back_index[b, k] == 0).all()
