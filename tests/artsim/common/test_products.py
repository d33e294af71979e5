"""Small products are sums in order, and those of BLAS up to rounding."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from artsim.common import products

RNG = np.random.default_rng(0)
SMALL = st.floats(-1e3, 1e3)


@given(st.lists(st.tuples(SMALL, SMALL), min_size=1, max_size=4))
def test_an_inner_product_is_a_sum_of_rounded_products_in_order(pairs: list[tuple[float, float]]) -> None:
    a, b = np.array(pairs).T
    expected = 0.0
    for x, y in pairs:
        product = float(Fraction(x) * Fraction(y))  # a product of two doubles, rounded once
        expected = float(Fraction(expected) + Fraction(product))
    assert products.dot(a, b) == expected
    assert products.dot(a[None], b[None]).tolist() == [expected]
    assert products.dot(list(a), list(b)) == expected


def test_products_are_those_of_blas_up_to_rounding() -> None:
    matrices, others = RNG.normal(size=(2, 7, 4, 4))
    vectors = RNG.normal(size=(7, 4))
    np.testing.assert_allclose(products.matmul(matrices, others), matrices @ others, atol=1e-14)
    np.testing.assert_allclose(products.apply(matrices, vectors), (matrices @ vectors[..., None])[..., 0], atol=1e-14)
    np.testing.assert_allclose(products.norm(vectors), np.linalg.norm(vectors, axis=1), atol=1e-14)
    np.testing.assert_allclose(products.norm(products.unit(vectors)), 1.0, atol=1e-15)
    assert products.norm(vectors[0]) == products.norm(vectors)[0]
