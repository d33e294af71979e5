"""The compiled loops give the bytes of the same loops in Python."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import artsim
from artsim import Camera, SampleOptions, ViewOptions
from artsim.common.compiled import Compiled
from artsim.datasets.sample_options import draw_sample
from artsim.datasets.shards import sample_members
from artsim.model.objects import ArticulatedObject
from artsim.renderers import make_renderer, outlines, ray_kernels
from artsim.renderers.raycast import PosedObject, cast_counted, pose, render_posed, visibility
from tests.conftest import ASSETS

SMALL = ViewOptions(width=80, height=60)
LOOKS = {
    "clouds": SampleOptions(num_points=300, views=SMALL),
    "more points than pixels": SampleOptions(num_points=500, views=ViewOptions(width=24, height=18)),
    "noise": SampleOptions(num_points=200, noise="kinect_v1", views=SMALL),
    "images": SampleOptions(num_points=100, images=("depth", "part_mask"), views=SMALL),
    "far too near": SampleOptions(num_points=200, views=ViewOptions(width=80, height=60, fill=(3.0, 4.0))),
    "other size": SampleOptions(num_points=200, scale=(0.3, 1.2), views=SMALL),
}


def objects() -> list[ArticulatedObject]:
    return [artsim.load(ASSETS / "cabinet"), artsim.make("keyboard", 1), artsim.make("robot_arm", 2)]


def both_ways(work: Callable[[], Any], monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Any]:
    faster = work()
    with monkeypatch.context() as patch:
        for module in (ray_kernels, outlines):
            for name, loop in list(vars(module).items()):
                if isinstance(loop, Compiled):
                    patch.setattr(module, name, loop.python)
        return work(), faster


@pytest.mark.slow
@pytest.mark.parametrize("look", LOOKS)
def test_samples_are_the_same_bytes(look: str, monkeypatch: pytest.MonkeyPatch) -> None:
    renderer, shown = make_renderer("raycast"), objects()

    def samples() -> list[dict[str, bytes]]:
        return [
            sample_members(draw_sample(obj, LOOKS[look], 0, 10 * i + view, renderer))
            for i, obj in enumerate(shown)
            for view in range(3)
        ]

    reference, faster = both_ways(samples, monkeypatch)
    assert reference == faster


def test_outlines_rays_and_counts_are_the_same_wherever_the_camera_stands(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
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
        reference, faster = both_ways(
            lambda camera=camera: looked_at(pose(obj, obj.tree.rest, camera), row, column), monkeypatch
        )
        for one, other in zip(reference, faster, strict=True):
            assert one.dtype == other.dtype
            np.testing.assert_array_equal(one, other)
        met += int(reference[-2].sum())
    assert met > 1000


def looked_at(posed: PosedObject, row: Any, column: Any) -> list[Any]:
    return [
        posed.spans, posed.row_ranges, *posed.candidates(), posed.rotations, posed.origins,
        *cast_counted(posed, row, column), visibility(posed, range(len(posed.obj)), 50),
        render_posed(posed).depth,
    ]  # fmt: skip
