"""The compiled loops give the bytes of NumPy's, which are the reference; and few clouds do not load them."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import artsim
from artsim import Camera, SampleOptions, ViewOptions
from artsim.datasets.sample_options import draw_sample
from artsim.datasets.shards import sample_members
from artsim.model.objects import ArticulatedObject
from artsim.renderers import compiled, make_renderer
from artsim.renderers.raycast import PosedObject, cast_counted, pose, visibility
from tests.conftest import ASSETS, installed

installed("numba")

LOOKS = {
    "clouds": SampleOptions(num_points=300),
    "more points than pixels": SampleOptions(num_points=500, views=ViewOptions(width=24, height=18)),
    "noise": SampleOptions(num_points=200, noise="kinect_v1"),
    "images": SampleOptions(num_points=100, images=("depth", "part_mask"), views=ViewOptions(width=80, height=60)),
    "far too near": SampleOptions(num_points=200, views=ViewOptions(fill=(3.0, 4.0))),
    "other size": SampleOptions(num_points=200, scale=(0.3, 1.2)),
}


def objects() -> list[ArticulatedObject]:
    return [artsim.load(ASSETS / "cabinet"), artsim.make("keyboard", 1), artsim.make("robot_arm", 2)]


def both_ways(work: Callable[[], Any]) -> tuple[Any, Any]:
    with compiled.use(False):
        reference = work()
    with compiled.use(True) as used:
        assert used
        return reference, work()


@pytest.mark.slow
@pytest.mark.parametrize("look", LOOKS)
def test_samples_are_the_same_bytes(look: str) -> None:
    renderer, shown = make_renderer("raycast"), objects()

    def samples() -> list[dict[str, bytes]]:
        return [
            sample_members(draw_sample(obj, LOOKS[look], 0, 10 * i + view, renderer))
            for i, obj in enumerate(shown)
            for view in range(3)
        ]

    reference, faster = both_ways(samples)
    assert reference == faster


def test_outlines_rays_and_counts_are_the_same_wherever_the_camera_stands() -> None:
    """Before the object, inside it and turned away from it; skewed pixels; an intrinsic matrix of another layout."""
    obj = artsim.load(ASSETS / "cabinet")
    rng = np.random.default_rng(0)
    K = np.asfortranarray([[90.0, 3.0, 41.0], [0.0, 80.0, 29.0], [0.0, 0.0, 1.0]])
    K.setflags(write=False)
    cameras = [Camera(K, 80, 60, Camera.look_at(rng.uniform(-2, 2, 3), rng.uniform(-1, 1, 3)).T_world_camera)]
    cameras += [Camera.look_at(rng.uniform(-s, s, 3), rng.uniform(-1, 1, 3), 80, 60) for s in (0.1, 0.5, 1, 2, 9) * 4]
    row, column = (np.ascontiguousarray(a) for a in np.divmod(np.arange(0, 4800, 7), 80))
    met = 0
    for camera in cameras:
        reference, faster = both_ways(lambda camera=camera: looked_at(pose(obj, obj.tree.rest, camera), row, column))
        for one, other in zip(reference, faster, strict=True):
            assert one.dtype == other.dtype
            np.testing.assert_array_equal(one, other)
        met += int(reference[-1].sum())
    assert met > 1000


def looked_at(posed: PosedObject, row: Any, column: Any) -> list[Any]:
    return [
        posed.spans, posed.row_ranges, *posed.candidates(), posed.rotations, posed.origins,
        *cast_counted(posed, row, column), visibility(posed, range(len(posed.obj)), 50),
    ]  # fmt: skip


def test_a_few_clouds_do_not_import_numba() -> None:
    few = (
        "import artsim, sys; o = artsim.make('laptop');"
        "artsim.observe(o, o.tree.rest, artsim.Camera.look_at((-2, 0, 1), (0, 0, 0)))"
    )
    assert subprocess.run([sys.executable, "-c", f"{few}; assert 'numba' not in sys.modules"]).returncode == 0


def test_without_numba_there_are_no_kernels() -> None:
    code = (
        "import sys; sys.modules['numba'] = None\n"
        "from artsim.renderers import compiled\n"
        "assert not compiled.compile_now()\n"
        "assert compiled.kernels() is None"
    )
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0
