"""A stream of new objects never ends and repeats itself exactly."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from artsim.datasets.family_stream import FamilyStream
from artsim.families import FAMILIES
from tests.conftest import in_another_process


@pytest.mark.slow
def test_a_stream_never_ends_and_repeats_itself_exactly() -> None:
    stream = FamilyStream(["laptop", "drawer"], views_per_object=2)
    first = list(itertools.islice(stream, 8))
    assert [s.category for s in first] == ["laptop"] * 2 + ["drawer"] * 2 + ["laptop"] * 2 + ["drawer"] * 2
    assert len({s.object_sha256 for s in first}) == 4
    np.testing.assert_array_equal(in_another_process(stream, 5).points, first[5].points)
    odd = list(itertools.islice(FamilyStream(["laptop", "drawer"], views_per_object=2, start=1, step=2), 4))
    assert [s.index for s in odd] == [2, 3, 6, 7]
    np.testing.assert_array_equal(odd[0].points, first[2].points)
    twice = FamilyStream(["laptop", "drawer", "drawer"], views_per_object=1)
    assert [twice.object(n).category for n in range(6)] == ["laptop", "drawer", "drawer"] * 2


@pytest.mark.slow
def test_the_plan_of_an_object_has_the_joints_that_the_object_has() -> None:
    stream = FamilyStream(sorted(FAMILIES))
    for n in range(len(FAMILIES)):
        planned, tree = stream.assembly(n), stream.object(n).tree
        assert planned.joint_types == tree.types
        np.testing.assert_array_equal(planned.joint_axes[1:], tree.axes[1:])
