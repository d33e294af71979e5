"""Streams of batches."""

from __future__ import annotations

import pytest
import torch

from artperl.data.batches import batches
from artperl.data.sources import DataOptions


def test_batch_n_is_always_the_same() -> None:
    stream = batches(DataOptions(["laptop"]), 2, 32, 4, workers=0)
    batch_list = [next(stream) for _ in range(3)]
    later = next(batches(DataOptions(["laptop"]), 2, 32, 4, first_batch=2, workers=0))
    worked = batches(DataOptions(["laptop"]), 2, 32, 4, workers=2)
    parallel = [next(worked) for _ in range(3)]
    for i in range(3):
        assert torch.equal(batch_list[i][0].points, parallel[i][0].points)
    assert torch.equal(batch_list[2][1].canonical, later[1].canonical)
    assert not torch.equal(batch_list[0][0].points, batch_list[1][0].points)


def test_clouds_are_seen_in_several_batches_and_then_never_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("artperl.data.batches._WINDOW", 3)
    stream = batches(DataOptions(["laptop"]), 2, 32, 8, workers=0)
    centers = [set(next(stream)[0].center[:, 0].round(decimals=5).tolist()) for _ in range(12)]
    fresh = [now.difference(*centers[:n]) for n, now in enumerate(centers)]
    assert [len(views) for views in fresh] == [2] * 12
    for n, views in enumerate(fresh):
        assert not views & set().union(*centers[n + 3 :])
    assert any(views & centers[n + 2] for n, views in enumerate(fresh[:-2]))


@pytest.mark.slow
def test_some_clouds_are_as_a_sensor_sees_them() -> None:
    """The same views, of which a share is rough: points lie off the surfaces that they would lie on."""
    clean, noisy = (next(batches(DataOptions(["drawer"], noisy=share), 4, 256, 32, workers=0)) for share in (0.0, 0.5))
    again = next(batches(DataOptions(["drawer"], noisy=0.5), 4, 256, 32, workers=2))
    assert again[0].points.equal(noisy[0].points)
    same = [bool((a == b).all()) for a, b in zip(clean[0].points, noisy[0].points, strict=True)]
    assert 4 < sum(same) < 28
    assert clean[1].box_size.equal(noisy[1].box_size)
