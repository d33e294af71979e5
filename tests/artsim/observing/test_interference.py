"""What comes between a camera and a whole, clean cloud."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import artsim
from artsim.datasets.plan import SampleOptions, draw_sample
from artsim.errors import ConfigError
from artsim.model.camera import Camera
from artsim.observing.interference import FOREIGN, interfere
from artsim.observing.sample import Sample
from artsim.renderers import make_renderer


def _view(category: str = "laptop", seed: int = 0) -> Sample:
    return draw_sample(artsim.make(category, seed), SampleOptions(num_points=3000), 1, seed, make_renderer("raycast"))


@pytest.fixture(scope="module")
def view() -> Sample:
    return _view()


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.floats(0.0, 1.0), st.floats(0.0, 0.9), st.booleans(), st.integers(0, 1000))
def test_shares_are_what_is_asked_for(view: Sample, hidden: float, outlier_share: float, spot: bool, seed: int) -> None:
    changed = interfere(view, np.random.default_rng(seed), hidden, outlier_share, spot)
    other = changed.part == FOREIGN
    own = max(3, 3000 - round(3000 * hidden))
    assert abs((~other).sum() - own) <= 1
    assert other.sum() == round(own * outlier_share / (1.0 - outlier_share)) or abs(other.mean() - outlier_share) < 1e-3
    assert np.isfinite(changed.points).all()
    assert np.isnan(changed.npcs[other]).all()
    again = interfere(view, np.random.default_rng(seed), hidden, outlier_share, spot)
    np.testing.assert_array_equal(changed.points, again.points)


def test_what_stays_of_the_object_is_as_it_was(view: Sample) -> None:
    known = {tuple(p): (k, tuple(c)) for p, k, c in zip(view.points, view.part, view.npcs, strict=True)}
    changed = interfere(view, np.random.default_rng(0), 0.3, 0.2)
    own = changed.part != FOREIGN
    for point, part, npcs in zip(changed.points[own], changed.part[own], changed.npcs[own], strict=True):
        assert known[tuple(point)] == (part, tuple(npcs))
    assert np.isnan(changed.rest_points[~own]).all()
    assert np.isfinite(changed.rest_points[own]).all()


def test_a_cut_is_a_straight_edge_in_the_image(view: Sample) -> None:
    """A line parts the points that are hidden from those that are not; a spot has no such line."""
    image = view.points[:, :2] / view.points[:, 2:]
    place = {tuple(p): n for n, p in enumerate(view.points)}
    angles = np.linspace(0.0, 2.0 * np.pi, 2000)
    along = image @ np.stack([np.cos(angles), np.sin(angles)])
    for spot, parted in ((False, True), (True, False)):
        kept = np.zeros(len(image), dtype=bool)
        kept[[place[tuple(p)] for p in interfere(view, np.random.default_rng(3), 0.2, spot=spot).points]] = True
        gap = along[kept].min(axis=0) - along[~kept].max(axis=0)
        assert (gap.max() > -1e-3) == parted


@pytest.mark.parametrize("category", ["laptop", "scissors", "drawer", "faucet"])
def test_other_things_lie_on_rays_that_miss_the_object(category: str) -> None:
    """The exact renderer meets nothing of the object along them."""
    obj = artsim.make(category, 2)
    view = _view(category, 2)
    camera = Camera(view.K, view.width, view.height, view.T_world_camera)
    T_world_object = view.T_world_camera @ view.T_camera_part[0]
    mask = make_renderer("raycast").render(obj, view.joint_state, camera, T_world_object).part_ids
    changed = interfere(view, np.random.default_rng(5), 0.0, 0.2)
    points = changed.points[changed.part == FOREIGN]
    pixel = np.floor(points @ view.K.T / points[:, 2:])[:, :2].astype(int)
    inside = (pixel >= 0).all(axis=1) & (pixel[:, 0] < view.width) & (pixel[:, 1] < view.height)
    assert inside.mean() > 0.5
    met = mask[pixel[inside, 1], pixel[inside, 0]] != FOREIGN
    assert met.mean() < 0.05
    assert (np.linalg.norm(points - view.points.mean(axis=0), axis=1) < 3.0 * view.diagonal).all()


@pytest.mark.parametrize(
    ("hidden", "outlier_share"), [(-0.1, 0.0), (1.1, 0.0), (0.0, 1.0), (0.0, -1.0), (float("nan"), 0.0)]
)
def test_impossible_shares_are_refused(view: Sample, hidden: float, outlier_share: float) -> None:
    with pytest.raises(ConfigError, match="share"):
        interfere(view, np.random.default_rng(0), hidden, outlier_share)
