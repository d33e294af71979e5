"""Parts are numbered by where they are seen; what is known of each goes with it."""

from __future__ import annotations

from dataclasses import fields

import numpy as np
import pytest

import artsim
from artperl.core.part_order import reorder_parts, reorder_sample, sort_parts, visible_order
from artperl.data.categories import objects_of
from artperl.data.sources import Samples
from artsim.datasets.plan import SampleOptions
from artsim.model.draws import ViewOptions, sample_view
from artsim.model.objects import ArticulatedObject

_DRAWN = ("points", "part", "npcs", "visible_fraction")
"""Which pixels are drawn depends on the order of the parts."""


def _cabinets() -> list[ArticulatedObject]:
    return [artsim.make("storage_furniture", seed) for seed in range(4)]


@pytest.mark.parametrize("category", ["storage_furniture", "robot_arm", "drawer", "pliers"])
def test_another_order_is_the_same_object(category: str) -> None:
    for seed in range(4):
        obj = artsim.make(category, seed)
        order = visible_order(obj.tree.parents, obj.box_center, obj.box_size)
        other = reorder_parts(obj, order)
        q = artsim.sample_state(obj, artsim.StateOptions(), np.random.default_rng(seed))
        np.testing.assert_allclose(
            other.tree.forward_kinematics(q[order]), obj.tree.forward_kinematics(q)[order], atol=1e-12
        )
        assert [part.name for part in other.parts] == [obj.parts[k].name for k in order]
        assert all(parent < k for k, parent in enumerate(other.tree.parents))
        assert other.source_state(q[order]) == pytest.approx(obj.source_state(q))
        assert [part.name for part in sort_parts(other).parts] == [part.name for part in other.parts]


def test_siblings_are_read_row_by_row() -> None:
    for obj in map(sort_parts, _cabinets()):
        y, z = obj.box_center[1:, 1], obj.box_center[1:, 2]
        assert ((np.diff(z) < 0) | (np.diff(y) > 0)).all()
        assert z[0] >= z.max() - 0.5 * obj.box_size[1:, 2].max()


def test_a_sample_in_another_order_is_one_of_the_object_in_that_order() -> None:
    for obj in _cabinets():
        order = visible_order(obj.tree.parents, obj.box_center, obj.box_size)
        rng = np.random.default_rng(0)
        q = artsim.sample_state(obj, artsim.StateOptions(), rng)
        camera = sample_view(obj, q, ViewOptions(), rng)
        own = artsim.observe(obj, q, camera, images=("part_mask",), rng=np.random.default_rng(1), details=True)
        other = artsim.observe(
            sort_parts(obj), q[order], camera, images=("part_mask",), rng=np.random.default_rng(1), details=True
        )
        turned = reorder_sample(own, order)
        for field in fields(own):
            if field.name == "details":
                assert [d.to_dict() for d in turned.details] == [d.to_dict() for d in other.details]
            elif field.name not in _DRAWN:
                assert np.array_equal(getattr(turned, field.name), getattr(other, field.name)), field.name
        names, again = np.array(own.part_names), np.array(turned.part_names)
        assert (names[own.part] == again[turned.part]).all()


def test_estimators_for_any_parts_learn_them_in_that_order() -> None:
    samples = Samples(["storage_furniture"], SampleOptions(num_points=64), 0, 2, 10, "any")
    for i in (0, 2, 5):
        sample, obj = samples[i], sort_parts(samples.object(i))
        np.testing.assert_allclose(sample.box_center / sample.diagonal, obj.box_center / obj.diagonal, atol=1e-9)
    for obj in objects_of(["storage_furniture"], 3, 7, "any", 10):
        assert [part.name for part in sort_parts(obj).parts] == [part.name for part in obj.parts]
