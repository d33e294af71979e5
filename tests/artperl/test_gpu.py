"""A GPU says what the processor does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import artperl
import artsim
from artperl.training.options import PRESETS, changed
from artperl.training.run import Training
from artsim.datasets.sample_options import SampleOptions, draw_sample
from artsim.renderers import make_renderer
from tests.conftest import installed

pytestmark = [pytest.mark.gpu, pytest.mark.slow]


@pytest.fixture(autouse=True)
def _gpu() -> None:
    if not installed("torch").cuda.is_available():
        pytest.skip("torch finds no GPU here")  # in CI, too: it has none


def test_estimates_are_the_same() -> None:
    """Up to what single precision leaves of a search: within 0.1 degrees and 0.1 % of the diagonal in most views."""
    laptop, renderer = artsim.make("laptop", 2_000_001), make_renderer("raycast")
    samples = [draw_sample(laptop, SampleOptions(), 0, i, renderer) for i in range(8)]
    cpu, gpu = (artperl.load_estimator("laptop", device=device) for device in ("cpu", "cuda"))
    off = []
    for sample in samples:
        one, two = cpu(sample.points), gpu(sample.points)
        off.append(np.abs(one.T_camera_part - two.T_camera_part).max())
    assert np.median(off) < 2e-3


def test_a_run_learns_there_and_goes_on_on_the_processor(tmp_path: Path) -> None:
    tiny = {
        "base_objects": 3, "reference_points": 48, "width": 16, "perception_steps": 3, "dense_steps": 0,
        "batch_size": 4, "num_points": 96, "box_views": 0, "validate_every": 3, "test_objects": 2,
        "foreign_categories": 1, "validation_views": 1, "test_views": 1,
    }  # fmt: skip
    options = changed(PRESETS["long"], tiny)

    def stop(group: str, figures: dict[str, float], step: int) -> None:
        begun.context.stop.asked = step == 1

    begun = Training(options, tmp_path, 0, progress=False, report=stop, device="cuda")
    with pytest.raises(KeyboardInterrupt):
        begun.run()
    assert begun.context.state.done["perception"] == 2
    figures = Training(options, tmp_path, 0, progress=False).run()
    assert figures["laptop"]["instances"] == 2


def test_warp_draws_what_rays_see() -> None:
    installed("warp")
    warp, rays = make_renderer("warp"), make_renderer("raycast")
    drawer, rng = artsim.make("drawer", 0), np.random.default_rng(0)
    q = artsim.sample_state(drawer, artsim.StateOptions(), rng)
    camera = artsim.sample_view(drawer, q, artsim.ViewOptions(), rng)
    one, two = (renderer.render(drawer, q, camera) for renderer in (warp, rays))
    assert (one.part_ids == two.part_ids).mean() > 0.999
    assert np.median(np.abs(one.depth - two.depth)) < 1e-5
