"""Following a moving object against estimating each frame anew: ``python -m benchmarks.tracking``.

An unseen object turns, comes nearer and moves its joints, smoothly, before a camera. Rates are by processor time of one
thread. The last line is one JSON object.
"""

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import tyro

import artsim
from artperl.data.categories import objects_of
from artperl.evaluation.metrics import rotation_error, true_poses
from artperl.evaluation.samples import TEST_SEEDS
from artperl.methods.estimator_files import load_estimator
from artsim.model.camera import Camera
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.renderers import shared_renderer

THIRDS = 3
"""Parts of a sequence whose errors are compared: drift makes the last one worse than the first."""


@dataclass(frozen=True)
class Options:
    """How fast and how well a moving object is followed."""

    categories: tuple[str, ...] = ("laptop", "eyeglasses", "dishwasher", "scissors", "drawer")
    frames: int = 60
    """Of a sequence."""
    objects: int = 2
    """Sequences of each category, each of another object."""
    degrees: float = 40.0
    """That the object turns about its vertical in a sequence, there and back."""
    num_points: int = 8192
    noise: str = "none"
    """Depth sensor."""


def sequence(obj: ArticulatedObject, options: Options, seed: int) -> Iterator[Sample]:
    """Frames of an object that moves smoothly."""
    rng, renderer = np.random.default_rng(seed), shared_renderer("raycast")
    low, high = obj.tree.limits[:, 0].copy(), obj.tree.limits[:, 1].copy()
    low, high = (np.where(np.isfinite(values), values, other) for values, other in ((low, -1.0), (high, 1.0)))
    phase, side = rng.uniform(0.0, 2.0 * np.pi, len(obj)), rng.uniform(-30.0, 30.0)
    for n in range(options.frames):
        t = n / options.frames
        azimuth = np.deg2rad(side + 0.5 * options.degrees * np.sin(2.0 * np.pi * t))
        away = obj.diagonal * (2.2 + 0.3 * np.sin(2.0 * np.pi * t))
        up = np.deg2rad(35.0 + 8.0 * np.sin(4.0 * np.pi * t))
        eye = away * np.array([-np.cos(azimuth) * np.cos(up), -np.sin(azimuth) * np.cos(up), np.sin(up)])
        q = low + (high - low) * (0.5 + 0.4 * np.sin(2.0 * np.pi * t + phase))
        camera = Camera.look_at(eye, np.zeros(3))
        yield artsim.observe(
            obj, q, camera, num_points=options.num_points, noise=options.noise, renderer=renderer,
            rng=np.random.default_rng([seed, n]),
        )  # fmt: skip


def main(options: Options) -> None:
    """Measure and print."""
    result = {}
    print(f"{'':12s}{'frames/s':>10s}{'anew':>8s}  mean rotation, deg: tracked (by thirds)      anew  searches")
    for category in options.categories:
        estimator = load_estimator(category)
        tracked, anew, searches, seconds = [], [], 0, [0.0, 0.0]
        for number, obj in enumerate(objects_of([category], options.objects, TEST_SEEDS)):
            samples = list(sequence(obj, options, number))
            estimator(samples[0].points)  # what is compiled, is compiled now
            begun, errors = time.process_time(), []
            estimates = []
            for estimate in estimator.track(sample.points for sample in samples):
                estimates.append(estimate)
            seconds[0] += time.process_time() - begun
            searches += sum("tracking" not in estimate.milliseconds for estimate in estimates)
            for sample, estimate in zip(samples, estimates, strict=True):
                errors.append(rotation_error(estimate.rotation, true_poses(sample)[0]).mean())
            tracked.append(errors)
            begun = time.process_time()
            alone = [estimator(sample.points) for sample in samples[:: options.frames // 20 or 1]]
            seconds[1] += (time.process_time() - begun) * len(samples) / len(alone)
            anew.append([
                rotation_error(estimate.rotation, true_poses(sample)[0]).mean()
                for sample, estimate in zip(samples[:: options.frames // 20 or 1], alone, strict=True)
            ])  # fmt: skip
        frames = options.frames * options.objects
        thirds = [float(own.mean()) for own in np.array_split(np.array(tracked), THIRDS, axis=1)]
        result[category] = {
            "frames_per_second": frames / seconds[0], "anew_per_second": frames / seconds[1], "thirds_deg": thirds,
            "tracked_deg": float(np.mean(tracked)), "anew_deg": float(np.mean(anew)), "searches": searches,
        }  # fmt: skip
        told = " ".join(f"{third:.2f}" for third in thirds)
        print(
            f"{category:12s}{frames / seconds[0]:10.1f}{frames / seconds[1]:8.1f}  {np.mean(tracked):8.2f} ({told})"
            f"{np.mean(anew):12.2f}{searches:8d}"
        )
    print(json.dumps(result))


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
