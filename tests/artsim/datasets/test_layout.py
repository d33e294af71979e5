"""The order of samples on disk shows few objects at a time, of every category."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from artsim.datasets.layout import at_place
from artsim.datasets.splits import SPLITS, showing_order

pytestmark = pytest.mark.slow


@given(st.integers(1, 60), st.integers(0, 100), st.integers(0, 59))
def test_a_split_that_grows_keeps_what_lies_in_finished_laps(objects: int, rounds: int, more: int) -> None:
    """Laps end after 8, 16, 32, 48, ... rounds, so that at least half of what is there is kept from 8 rounds on."""
    finished = max(end for end in [0, 8, *range(16, 116, 16)] if end <= rounds)
    kept = [at_place(place, objects, rounds) for place in range(finished * objects)]
    assert kept == [at_place(place, objects, rounds + more) for place in range(finished * objects)]
    assert kept == [at_place(place, objects) for place in range(finished * objects)]
    assert 2 * finished >= rounds or rounds < 8
    assert sorted(at_place(p, objects, rounds) for p in range(rounds * objects)) == [
        (r, n) for r in range(rounds) for n in range(objects)
    ]


@given(st.lists(st.tuples(st.sampled_from("abc"), st.sampled_from(SPLITS)), min_size=1, max_size=200))
def test_the_first_objects_shown_are_of_every_category_and_split_by_its_share(objects: list[tuple[str, str]]) -> None:
    order = showing_order(objects)
    assert sorted(order) == list(range(len(objects)))
    for stratum in set(objects):
        share = objects.count(stratum) / len(objects)
        for count in (len(objects) // 3, len(objects) // 2):
            shown = sum(objects[n] == stratum for n in order[:count])
            assert abs(shown - share * count) <= 5  # one for each of the nine strata, at worst half of them
