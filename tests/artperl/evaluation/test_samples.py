"""Test samples are frozen."""

from __future__ import annotations

import numpy as np

from artperl.evaluation.samples import frozen_samples


def test_frozen_samples_are_always_the_same() -> None:
    one, other = (frozen_samples(["laptop"], 2, 2) for _ in range(2))
    assert all(np.array_equal(a.points, b.points) for a, b in zip(one, other, strict=True))
    assert len({s.object_id for s in one}) == 2
    assert len(one) == 4
