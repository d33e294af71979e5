"""Points that vote for the same box are one part, however many parts there are."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from artperl.core.clouds import Clouds
from artperl.data.truth import Truth, to_batch, training_rows
from artperl.evaluation.samples import frozen_samples
from artperl.perception.network import Votes
from artperl.perception.part_grouping import _backed, clusters, differences, group_votes
from artsim.observing.sample import Sample
from tests.artperl.worlds import true_votes

ROWS = 10


def seen(sample: Sample, num_points: int = 2048) -> tuple[Clouds, Truth]:
    rows = training_rows(sample, num_points, ROWS)
    return to_batch({name: torch.from_numpy(np.asarray(values)[None]) for name, values in rows.items()})


@pytest.mark.slow
@pytest.mark.parametrize("category", ["storage_furniture", "drawer", "robot_arm", "eyeglasses"])
@pytest.mark.parametrize("noise", [0.0, 0.004])
def test_true_votes_find_the_parts_that_are_seen(category: str, noise: float) -> None:
    generator = torch.Generator().manual_seed(0)
    samples = frozen_samples([category], 6, 1, parts="any", max_parts=ROWS)
    for sample in samples:
        truth = seen(sample)[1]
        votes = true_votes(truth)
        votes = Votes(**{**vars(votes), "box": votes.box + noise * torch.randn(votes.box.shape, generator=generator)})
        found = group_votes(votes)
        count = truth.part[0].bincount(minlength=ROWS)
        if bool((count[truth.part_valid[0]] < 40).any()):
            continue  # of a part that is not seen nobody can tell
        K = int(truth.part_valid.sum())
        assert found.valid[0].sum() == K
        torch.testing.assert_close(found.box_center[0, :K], truth.box_center[0, :K], atol=0.001 + 2 * noise, rtol=0)
        torch.testing.assert_close(found.box_size[0, :K], truth.box_size[0, :K], atol=0.001 + 2 * noise, rtol=0)
        torch.testing.assert_close(found.joint[0, :K], truth.joint[0, :K])
        assert found.parent[0, 1:K].tolist() == sample.joint_parent[1:].tolist()
        assert (found.part == truth.part).float().mean() > 0.99


def test_stray_votes_are_of_no_part() -> None:
    rng = np.random.default_rng(0)
    drawer, door = np.array([0.0, 0.0, 0.3, 0.4, 0.3, 0.1]), np.array([0.0, 0.0, -0.1, 0.02, 0.3, 0.4])
    votes = np.concatenate([np.tile(drawer, (40, 1)), np.tile(door, (20, 1)), rng.uniform(-0.5, 0.5, (5, 6))])
    found = clusters(votes[:, :3], votes, 3)
    assert [set(group) for group in found] == [set(range(40)), set(range(40, 60))]
    assert clusters(votes[-2:, :3], votes[-2:], 3) == []


def test_what_lies_between_two_parts_is_no_third_one() -> None:
    """A few points on the edge from one drawer to the next vote for something between: most of its box is theirs."""
    boxes = np.array([[0.0, 0.0, 0.0, 0.4, 0.3, 0.1], [0.0, 0.0, 0.1, 0.4, 0.3, 0.1], [0.0, 0.0, 0.05, 0.4, 0.3, 0.1]])
    owner = np.repeat([0, 1, 2], [60, 60, 8])
    place = boxes[owner, :3] + np.random.default_rng(0).uniform(-0.5, 0.5, (128, 3)) * boxes[owner, 3:]
    found = clusters(place, boxes[owner], 3)
    assert len(found) == 2
    alone = clusters(place[owner == 2], boxes[owner[owner == 2]], 3)
    assert len(alone) == 1


@settings(deadline=None)
@given(count=st.integers(1, 8), height=st.floats(0.06, 0.3), seed=st.integers(0, 99))
def test_drawers_of_a_row_are_told_apart_whatever_their_number(count: int, height: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = np.array([[0.0, 0.0, n * height, 0.4, 0.3, 0.95 * height] for n in range(count)])
    owner = np.repeat(np.arange(count), 40)
    votes = boxes[owner] + rng.normal(0.0, 0.03 * height, (40 * count, 6))
    place = boxes[owner, :3] + rng.uniform(-0.5, 0.5, (40 * count, 3)) * boxes[owner, 3:]
    found = clusters(place, votes, 4)
    assert len(found) == count
    for group in found:
        assert len(set(owner[group])) == 1


def test_differences_do_not_depend_on_which_comes_first() -> None:
    boxes = np.random.default_rng(0).uniform(0.0, 1.0, (30, 6))
    apart = differences(boxes[:, None], boxes[None])
    np.testing.assert_allclose(apart, apart.T)
    assert (np.diag(apart) == 0).all()


def test_there_is_a_root_even_if_no_point_says_so() -> None:
    (sample,) = frozen_samples(["laptop"], 1, 1)
    truth = seen(sample)[1]
    votes = true_votes(truth)
    no_root = torch.full_like(votes.level_logits, -20.0)
    no_root[..., 1] = 0.0
    found = group_votes(Votes(**{**vars(votes), "level_logits": no_root}))
    assert bool(found.valid[0, 0])
    assert bool((found.joint[0, 0] == 0).all())


def test_votes_that_back_each_other_are_those_with_small_differences() -> None:
    box = np.random.default_rng(0).random((60, 6)) * 0.3
    np.testing.assert_array_equal(_backed(box), differences(box[:, None], box[None]) < 0.6)
