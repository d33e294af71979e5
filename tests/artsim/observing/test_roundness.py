"""Round parts: the axes about which nobody can tell how far they are turned."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from artsim.loading.sources import FamilySource
from artsim.making.assembly import Assembly, revolute
from artsim.making.solids import Solid, box, cylinder, prism
from artsim.observing.roundness import round_axes

_LEANING = np.array([0.6, 0.0, 0.8])


def axes_of(solid: Solid, joint_axis: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> np.ndarray:
    """Of a part that turns on a block."""
    assembly = Assembly()
    assembly.add("block", box((-0.3, -0.2, -0.1), (0.3, 0.2, 0.0)), density=500.0)
    assembly.add("part", solid, revolute("block", joint_axis, (0.0, 0.0, 0.0), 0.0, 1.0), density=500.0)
    block, part = round_axes(assembly.build("thing", "0"))
    assert len(block) == 0
    return part


@pytest.mark.parametrize("end_radius", [0.05, 0.02])
def test_a_cylinder_and_a_cone_are_round_about_their_axis_alone(end_radius: float) -> None:
    np.testing.assert_allclose(axes_of(cylinder((0, 0, 0.0), (0, 0, 0.2), 0.05, end_radius)), [[0.0, 0.0, 1.0]])
    np.testing.assert_allclose(axes_of(cylinder((0, 0.1, 0), (0, 0.4, 0), 0.05, end_radius)), [[0.0, 1.0, 0.0]])


def test_a_cylinder_that_leans_is_round_about_the_axis_of_its_joint() -> None:
    leaning = cylinder((0, 0, 0), tuple(0.2 * _LEANING), 0.05)
    np.testing.assert_allclose(axes_of(leaning, tuple(_LEANING)), [_LEANING])
    assert len(axes_of(leaning)) == 0  # about an axis that is none of its own


@pytest.mark.parametrize("height", [0.005, 0.1, 0.4])
def test_prisms_of_many_sides_are_round_and_those_of_few_are_not(height: float) -> None:
    for sides in (3, 4, 5, 8, 9, 12):
        angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
        outline = 0.1 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        assert len(axes_of(prism(outline, 0.0, height))) == (sides >= 8), sides


def test_a_cube_and_a_plate_are_not_round() -> None:
    assert len(axes_of(box((0, 0, 0), (0.1, 0.1, 0.1)))) == 0
    assert len(axes_of(box((0, 0, 0), (0.2, 0.1, 0.01)))) == 0


def test_a_globe_is_a_ball() -> None:
    globe = FamilySource("globe", 3).load()
    balls = [part.name for part, axes in zip(globe.parts, round_axes(globe), strict=True) if len(axes) > 1]
    assert balls == ["globe"]


@pytest.mark.parametrize("family", ["bottle", "cart", "kettle", "kitchen_pot", "chair", "fan"])
def test_what_is_round_has_equal_moments_of_inertia_across_its_axis(family: str) -> None:
    """Moments of points that trimesh spreads over its surface. All other parts may have equal ones, too."""
    count = 0
    for seed in range(6):
        obj = FamilySource(family, seed).load()
        for part, axes in zip(obj.parts, round_axes(obj), strict=True):
            if len(axes) != 1:
                continue
            mesh = trimesh.Trimesh(part.vertices, part.faces, process=False)
            points, _ = trimesh.sample.sample_surface(mesh, 20_000, seed=0)
            spread = np.cov(points.T)
            across = np.linalg.svd(np.eye(3) - np.outer(axes[0], axes[0]))[0][:, :2]
            first, second = np.linalg.eigvalsh(across.T @ spread @ across)
            assert second < 1.15 * first
            count += 1
    assert count > 0
