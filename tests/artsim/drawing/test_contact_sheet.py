"""Pictures show what the ground truth says."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial import ConvexHull, Delaunay

import artsim
from artsim import StateOptions, ViewOptions, observe, sample_state, sample_view
from artsim.datasets.plan import SampleOptions
from artsim.drawing.contact_sheet import contact_sheet, show_sample, show_states, spread, write_contact_sheet
from artsim.errors import ArtsimError
from artsim.loading.sources import find_sources
from artsim.observing.annotation import PALETTE, axis_segment, box_corners, shade_parts
from tests.conftest import ASSETS


def test_points_project_into_the_outline_of_their_box() -> None:
    obj, rng = artsim.load(ASSETS / "eyeglasses"), np.random.default_rng(2)
    q = sample_state(obj, StateOptions(), rng)
    camera = sample_view(obj, q, ViewOptions(), rng)
    sample = observe(obj, q, camera)
    for k in np.unique(sample.part):
        outline = camera.project(box_corners(sample, int(k)))
        hull = Delaunay(outline[ConvexHull(outline).vertices] + 1e-6 * rng.normal(size=(1, 2)))
        inside = hull.find_simplex(camera.project(sample.points[sample.part == k])) >= 0
        assert inside.mean() > 0.995


@pytest.mark.parametrize("name", ["laptop", "cabinet", "quirks/screw_helper", "quirks/primitives"])
def test_axis_arrows_lie_on_the_joint_axes(name: str) -> None:
    obj, rng = artsim.load(ASSETS / name), np.random.default_rng(0)
    q = sample_state(obj, StateOptions(), rng)
    sample = observe(obj, q, sample_view(obj, q, ViewOptions(), rng))
    for k in range(1, len(obj)):
        start, end = axis_segment(sample, k)
        assert np.allclose(np.cross(end - start, sample.joint_axis_camera[k]), 0, atol=1e-9)
        assert (end - start) @ sample.joint_axis_camera[k] > 0
        if sample.joint_type[k] != "prismatic":
            offset = start - sample.joint_origin_camera[k]
            assert np.allclose(np.cross(offset, sample.joint_axis_camera[k]), 0, atol=1e-9)


def test_parts_are_drawn_in_their_own_colours() -> None:
    obj = artsim.load(ASSETS / "cabinet")
    shown = next(iter(show_states(obj, 1)))
    image = shade_parts(shown.frame, shown.camera)
    for k in range(len(obj)):
        mean = image[shown.frame.part_ids == k].mean(axis=0)
        assert np.argmin([np.linalg.norm(mean / mean.sum() - c / c.sum()) for c in PALETTE[:4]]) == k


@pytest.mark.slow
def test_a_sheet_shows_as_many_samples_as_there_are(tmp_path: Path) -> None:
    sources = find_sources([ASSETS / "laptop", ASSETS / "quirks" / "merged"])
    options = SampleOptions(num_points=64, images=("depth", "part_mask"))
    artsim.generate(sources, tmp_path / "out", 5, sample=options, progress=False, splits=(1, 0, 0))
    written = write_contact_sheet(tmp_path / "out", samples=40, rerun=tmp_path / "deep" / "out.rrd")
    assert [path.name for path in written] == ["contact_sheet.png", "out.rrd"]
    image = Image.open(written[0])
    assert image.size[0] == 1920
    with pytest.raises(ArtsimError, match="no sample to draw"):
        write_contact_sheet(tmp_path / "out", split="val")


def test_stored_images_and_rendered_ones_look_the_same(tmp_path: Path) -> None:
    obj, rng = artsim.load(ASSETS / "scissors"), np.random.default_rng(0)
    q = sample_state(obj, StateOptions(), rng)
    camera = sample_view(obj, q, ViewOptions(), rng)
    stored = observe(obj, q, camera, images=("depth", "part_mask"))
    bare = observe(obj, q, camera)
    frames = [show_sample(sample, obj).frame for sample in (stored, bare)]
    assert (frames[0].part_ids == frames[1].part_ids).mean() > 0.9999
    assert Image.open(io.BytesIO(contact_sheet([show_sample(bare, obj)]))).size == (960, 275)


def test_samples_are_spread_without_repeats() -> None:
    assert spread(0, 5) == []
    assert spread(3, 9) == [0, 1, 2]
    chosen = spread(1000, 12)
    assert len(set(chosen)) == 12
    assert chosen == spread(1000, 12)
