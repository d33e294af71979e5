"""Shapes that a URDF gives in numbers have the sizes and volumes that they say."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from artsim.common import products
from artsim.loading.primitives import capsule, cylinder, sphere
from artsim.loading.xml_values import rotation_of
from artsim.model.kinematics import Array


def volume(vertices: Array, faces: NDArray[np.int32]) -> float:
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c))) / 6.0


def test_shapes_given_in_numbers_are_what_they_say() -> None:
    ball = sphere(0.3)
    np.testing.assert_allclose(products.norm(ball[0]), 0.3, atol=1e-15)
    assert volume(*ball) == pytest.approx(4 / 3 * np.pi * 0.3**3, rel=5e-3)
    polygon = 32 * np.sin(2 * np.pi / 64) * 0.2**2
    assert volume(*cylinder(0.2, 0.7)) == pytest.approx(polygon * 0.7, rel=1e-12)
    ends = volume(*capsule(0.2, 0.7)) - polygon * 0.7
    assert ends == pytest.approx(4 / 3 * np.pi * 0.2**3, rel=1e-2)
    assert np.abs(capsule(0.2, 0.7)[0]).max(axis=0) == pytest.approx([0.2, 0.2, 0.55])
    quarters = rotation_of(np.array([0.5 * np.pi, 0.0, 0.5 * np.pi]))
    np.testing.assert_allclose(quarters, [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-15)
