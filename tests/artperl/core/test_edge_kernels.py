"""Sums and maxima over neighbours: torch's own operations are the oracle, forwards and backwards."""

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch.nn import functional

from artperl.core.edge_kernels import Strongest, StrongestByGathering
from artperl.core.pointnet2 import interpolate


def _drawn(seed: int, rows: int, queries: int, neighbours: int, channels: int):
    rng = torch.Generator().manual_seed(seed)
    features = torch.randn(rows, channels, generator=rng, requires_grad=True)
    index = torch.randint(0, rows, (queries, neighbours), generator=rng)
    return (
        features,
        index,
        torch.rand(queries, neighbours, generator=rng),
        torch.randn(queries, channels, generator=rng),
    )


def _gradient(result: torch.Tensor, features: torch.Tensor, upstream: torch.Tensor) -> torch.Tensor:
    return torch.autograd.grad(result, features, upstream)[0]


SIZES = st.tuples(st.integers(0, 2**31), st.integers(1, 40), st.integers(1, 50), st.integers(1, 9), st.integers(1, 20))


@given(SIZES, st.sampled_from([Strongest, StrongestByGathering]))
def test_a_maximum_is_that_of_embedding_bag(sizes, kernel):
    features, index, _, upstream = _drawn(*sizes)
    ours, theirs = kernel.apply(features, index), functional.embedding_bag(index, features, mode="max")
    assert torch.equal(ours, theirs)
    torch.testing.assert_close(_gradient(ours, features, upstream), _gradient(theirs, features, upstream))


@given(SIZES)
def test_a_weighted_sum_is_that_of_embedding_bag(sizes):
    features, index, weight, upstream = _drawn(*sizes)
    ours = interpolate(features[None], weight[None], index[None])[0]
    theirs = functional.embedding_bag(index, features, mode="sum", per_sample_weights=weight)
    torch.testing.assert_close(ours, theirs)
    torch.testing.assert_close(_gradient(ours, features, upstream), _gradient(theirs, features, upstream))


@pytest.mark.parametrize("dtype", [torch.bfloat16, torch.float32])
def test_results_and_gradients_keep_the_precision_of_the_features(dtype):
    features, index, weight, upstream = _drawn(0, 7, 5, 3, 4)
    features = features.detach().to(dtype).requires_grad_()
    kernels = Strongest.apply(features, index), StrongestByGathering.apply(features, index)
    for result in (*kernels, interpolate(features[None], weight[None], index[None])[0]):
        assert result.dtype == dtype
        assert _gradient(result, features, upstream.to(dtype)).dtype == dtype


def test_of_equal_features_the_first_gets_the_gradient():
    features = torch.ones(3, 1, requires_grad=True)
    highest = Strongest.apply(features, torch.tensor([[2, 0, 1]]))
    assert _gradient(highest, features, torch.ones(1, 1)).flatten().tolist() == [0.0, 0.0, 1.0]
