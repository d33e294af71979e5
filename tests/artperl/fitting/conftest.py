"""Laptops and drawers, a cloud of each, and the true states."""

from __future__ import annotations

import pytest

from artperl.core.pose import Theta
from artperl.core.shapes import Observed, Shapes
from tests.artperl.fitting.problems import observe, true_theta, views


@pytest.fixture(scope="module")
def laptops() -> tuple[Shapes, Observed, Theta]:
    objects, samples = views("laptop", 12)
    shapes = Shapes.from_objects(objects)
    return shapes, observe(samples), true_theta(shapes, samples)


@pytest.fixture(scope="module")
def drawers() -> tuple[Shapes, Observed, Theta]:
    objects, samples = views("drawer", 6)
    shapes = Shapes.from_objects(objects)
    return shapes, observe(samples), true_theta(shapes, samples)
