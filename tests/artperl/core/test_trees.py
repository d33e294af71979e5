"""A batch of kinematic trees says of each tree what the tree says of itself."""

from __future__ import annotations

import numpy as np
import pytest

import artsim
from artperl.core.trees import KINDS, Trees
from artsim.errors import KinematicsError


def test_a_batch_of_trees_says_what_each_tree_says() -> None:
    trees = [artsim.make(category, 3).tree for category in ("laptop", "drawer", "eyeglasses")]
    batch = Trees.stack(trees)
    assert batch.num_rows == max(len(tree) for tree in trees)
    for b, tree in enumerate(trees):
        K = len(tree)
        assert batch.valid[b].tolist() == [True] * K + [False] * (batch.num_rows - K)
        assert [KINDS[kind] for kind in batch.kind[b, :K].tolist()] == list(tree.types)
        assert batch.parent[b, 1:K].tolist() == list(tree.parents[1:])
        assert batch.depth[b, :K].tolist() == list(tree.depths)
        assert np.flatnonzero(batch.free[b].numpy()).tolist() == list(tree.free_joints)
        np.testing.assert_allclose(batch.axis[b, :K].numpy(), tree.axes)


def test_trees_that_do_not_fit_are_refused() -> None:
    tree = artsim.make("eyeglasses", 1).tree
    with pytest.raises(KinematicsError, match="2 rows"):
        Trees.stack([tree], num_rows=2)
    with pytest.raises(KinematicsError, match="no tree"):
        Trees.stack([])
