"""Views per second of what draws different scenes at once: Warp, and ManiSkill's batched camera on a GPU."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from artsim.commands.doctor import examine
from artsim.errors import RenderError
from artsim.model.objects import ArticulatedObject
from artsim.renderers.view_batch import draw_views
from artsim.renderers.warp import WarpRenderer, import_warp

SIZE = 128
NUM_POINTS = 1024
_BATCH = {"cuda": 4096, "cpu": 64}
_SUB_SCENES = 1024  # as ManiSkill's own benchmarks have them
_SECONDS = 3.0
_GOAL = 50_000  # views/s
_MANISKILL = ("MS-CartpoleBalance-v1", "ArtSimArticulated-v1")  # its fastest scene, and drawers of ours


def measure_batches(objects: Sequence[ArticulatedObject]) -> dict[str, Any]:
    """Measure and print.

    Parameters
    ----------
    objects : sequence of ArticulatedObject
        As many views of each.

    Returns
    -------
    dict
        Views and clouds per second of Warp; views per second of ManiSkill by scene, None where not measured.
    """
    renderer = WarpRenderer()
    gpu = renderer.device != "cpu"
    batch, device = _BATCH["cuda" if gpu else "cpu"], str(import_warp().get_device(renderer.device).name)
    views, clouds = _warp_rates(renderer, objects, batch)
    renderer.close()
    print(f"\n{batch} views of {len(objects)} objects at once, {SIZE}x{SIZE}, depth and part ids, on {device}")
    print(f"{'warp':32s}{views:10.0f} views/s; clouds of {NUM_POINTS} points, each of a new view, {clouds:.0f}/s")
    problem = examine("maniskill").problem if gpu else "no GPU here"
    rates = {name: None if problem else _maniskill_rate(name, _SUB_SCENES, "gpu") for name in _MANISKILL}
    for name, rate in rates.items():
        told = f"not measured: {problem}" if rate is None else f"{rate:.0f} views/s; warp makes {views / rate:.1f} x"
        print(f"maniskill {name:22s}{told}")
    print(f"asked of a GPU: {_GOAL} views/s and 3 x ManiSkill's{'' if gpu else ': not measured, no GPU here'}")
    return {
        "device": device,
        "warp_views": round(views),
        "warp_clouds": round(clouds),
        "maniskill_views": rates,
    }


def _warp_rates(renderer: WarpRenderer, objects: Sequence[ArticulatedObject], batch: int) -> tuple[float, float]:
    """Views per second, states and cameras being brought to the device each time; clouds per second of new ones."""
    loaded, rng = renderer.load(objects), np.random.default_rng(0)
    views, finish = draw_views(objects, batch, rng), import_warp().synchronize
    drawn = _rate(lambda: renderer.render_views(loaded, views), finish)
    return batch * drawn, batch * _rate(
        lambda: renderer.clouds(loaded, draw_views(objects, batch, rng), NUM_POINTS), finish
    )


def _maniskill_rate(env_id: str, batch: int, backend: str) -> float:
    """Views per second of the batched camera alone: nothing moves, depth and segmentation are fetched as tensors.

    Parameters
    ----------
    env_id : str
    batch : int
        Sub-scenes; more than one need a GPU.
    backend : str
        "gpu" or "cpu".
    """
    import gymnasium
    import mani_skill.envs  # noqa: F401 - registers ManiSkill's scenes
    import torch

    import artsim.envs  # noqa: F401 - registers ours

    env = gymnasium.make(
        env_id,
        num_envs=batch,
        obs_mode="depth+segmentation",
        sim_backend=backend,
        render_backend=backend,
        sensor_configs={"width": SIZE, "height": SIZE},
    )
    env.reset(seed=0)
    scene: Any = env.unwrapped.scene  # type: ignore[attr-defined]  # ManiSkill has no types
    (camera,) = scene.sensors.values()

    def draw() -> Any:
        scene.update_render(update_human_render_cameras=False)
        camera.capture()
        return camera.get_obs(rgb=False, depth=True, position=False, segmentation=True)

    if draw()["depth"].shape[:3] != (batch, SIZE, SIZE):
        raise RenderError(f"{env_id} draws pictures of another size", "maniskill")
    rate = _rate(draw, torch.cuda.synchronize if backend == "gpu" else lambda: None)
    env.close()
    return batch * rate


def _rate(draw: Callable[[], object], finish: Callable[[], object]) -> float:
    """Calls per second, after two that warm up."""
    for _ in range(2):
        draw()
    finish()
    count, start = 0, time.perf_counter()
    while time.perf_counter() - start < _SECONDS:
        draw()
        finish()
        count += 1
    return count / (time.perf_counter() - start)
