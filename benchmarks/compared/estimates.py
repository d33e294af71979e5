"""Estimates of poses, with their errors: faster ones have to be as good."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from . import Work


def estimates(folder: Path, category: str, num_points: int) -> Callable[[], Work]:
    """One cloud after another of unseen procedural objects, with the weights of their category."""
    from artperl.evaluation.artimage import row_objects, row_samples
    from artperl.evaluation.benchmark import find_estimator

    samples = row_samples("procedural", row_objects("procedural", category, objects=10), 10, num_points)[:10]
    return _each(find_estimator(None, category), samples)


def any_of_parts(folder: Path, parts: int) -> Callable[[], Work]:
    """Robot arms and random trees of so many parts by the estimator of all categories."""
    import artsim
    from artperl import load_estimator
    from artsim.datasets.sample_options import SampleOptions, draw_sample
    from artsim.renderers import make_renderer

    objects: list[Any] = []
    renderer, seed = make_renderer("raycast"), 1000
    while len(objects) < 4:
        obj = artsim.make("robot_arm", seed)
        objects += [obj] if len(obj) == parts else []
        seed += 1
    options = SampleOptions(num_points=1024)
    samples = [draw_sample(obj, options, 0, i, renderer) for i, obj in enumerate(objects)]
    return _each(load_estimator("any"), samples)


def _each(estimator: Any, samples: Sequence[Any]) -> Callable[[], Work]:
    import numpy as np
    import torch

    from artperl.evaluation.metrics import rotation_error

    torch.set_num_threads(1)

    def work() -> Work:
        found = [estimator(sample.points) for sample in samples]
        errors = [
            rotation_error(estimate.T_camera_part[:, :3, :3], sample.T_camera_part[:, :3, :3]).mean()
            for estimate, sample in zip(found, samples, strict=True)
            if len(estimate.T_camera_part) == len(sample.T_camera_part)
        ]
        return Work(len(found), facts={"mean_rotation_deg": float(np.mean(errors)) if errors else float("nan")})

    return work
