"""One laptop, seen once, and an estimator that knows each of its points."""

from __future__ import annotations

from functools import partialmethod

import pytest

import artsim
from artperl.evaluation.samples import frozen_samples
from artperl.methods.full import Estimator
from artperl.methods.omad import OMADOptions
from artperl.retrieval.box_embedding import by_boxes
from artperl.retrieval.shape_base import ShapeBase
from artsim.observing.sample import Sample
from tests.artperl.worlds import Oracle


@pytest.fixture(scope="module")
def sample() -> Sample:
    (one,) = frozen_samples(["laptop"], 1, 1)
    return one


@pytest.fixture(scope="module")
def base() -> ShapeBase:
    return by_boxes(ShapeBase.of([artsim.make("laptop", seed) for seed in range(8)], 128))


@pytest.fixture(scope="module")
def estimator(base: ShapeBase, sample: Sample) -> Estimator:
    return Estimator(Oracle(sample, 2), base)


@pytest.fixture
def brief_fits(monkeypatch: pytest.MonkeyPatch) -> None:
    """OMAD's fits end after few steps, for tests that do not ask where they end."""
    monkeypatch.setattr(OMADOptions, "__init__", partialmethod(OMADOptions.__init__, iterations=5))
