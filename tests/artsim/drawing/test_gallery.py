"""A gallery shows what it is asked for, in rows that fit a page."""

import io

import numpy as np
import pytest
from PIL import Image

import artsim
from artsim.drawing.gallery import draw_gallery, opening_states


def test_one_picture_shows_an_object_opened_and_of_three_the_first_is_at_rest() -> None:
    laptop = artsim.make("laptop", seed=7)
    (opened,) = opening_states(laptop, 1)
    at_rest, _, last = opening_states(laptop, 3)
    np.testing.assert_array_equal(at_rest, laptop.tree.rest)
    np.testing.assert_array_equal(opened, last)
    assert opened[1] > np.deg2rad(40.0)


@pytest.mark.slow
def test_nine_pictures_stand_in_a_row() -> None:
    globe = artsim.make("globe", seed=1)
    sizes = {
        (count, states): Image.open(io.BytesIO(draw_gallery([globe] * count, states))).size
        for count, states in ((1, 1), (2, 1), (3, 3), (10, 1))
    }
    width, height = sizes[1, 1]
    assert sizes[2, 1] == (2 * width, height)
    assert sizes[3, 3] == (9 * width, height)
    assert sizes[10, 1] == (9 * width, 2 * height)
