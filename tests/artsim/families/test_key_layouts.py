"""Layouts of keyboards."""

from collections.abc import Callable

import numpy as np
import pytest

from artsim.families.key_layouts import (
    MOST_KEYS,
    Cell,
    compact_layout,
    extent,
    full_layout,
    half_layout,
    macro_layout,
    number_layout,
)
from artsim.making.draws import Draws

Layout = Callable[[Draws], list[list[Cell]]]


@pytest.mark.parametrize("layout", [full_layout, compact_layout, number_layout, macro_layout, half_layout])
def test_no_two_keys_of_a_layout_overlap(layout: Layout) -> None:
    for seed in range(30):
        groups = layout(Draws(np.random.default_rng(seed)))
        cells = np.array([cell for group in groups for cell in group])
        apart = np.abs(cells[:, None, :2] - cells[None, :, :2]) - 0.5 * (cells[:, None, 2:] + cells[None, :, 2:])
        clear = (apart > -1e-9).any(axis=-1) | np.eye(len(cells), dtype=bool)
        assert clear.all(), (seed, np.argwhere(~clear))
        assert (cells[:, 2:] > 0.4).all()
        assert len(groups) <= MOST_KEYS


def test_the_extent_is_that_of_the_outermost_keys() -> None:
    np.testing.assert_allclose(extent([[(0.5, 0.5, 1.0, 1.0)], [(3.0, 1.5, 2.0, 1.0)]]), (4.0, 2.0))
