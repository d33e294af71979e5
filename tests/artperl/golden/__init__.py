"""Stored clouds with what the shipped estimators say of them: whatever changes an estimate shows here first.

``python -m tests.artperl.golden`` estimates the clouds anew and writes ``estimates.json``; ``--clouds`` draws them
anew, too. Both change what later versions are compared with: say why in the commit.

Clouds of procedural objects are stored. Those of real ones may not be, and are drawn from the files of
``ARTSIM_PARTNET_DIR`` at each run.
"""

from __future__ import annotations

import io
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from artperl.core.estimate import Estimate
from artperl.data.categories import ARTIMAGE
from artperl.evaluation.artimage import real_objects
from artperl.evaluation.samples import frozen_samples, samples_of
from artsim.common.files import write_atomic
from artsim.datasets.plan import SampleOptions
from artsim.model.draws import ViewOptions

CLOUDS, ESTIMATES = (Path(__file__).with_name(name) for name in ("clouds.npz", "estimates.json"))
NUM_POINTS = 2048
_SEED = 1_300_000
"""Objects that neither training nor any figure of the docs uses."""
VIEWS = {
    "front": SampleOptions(NUM_POINTS),
    "round": SampleOptions(NUM_POINTS, views=ViewOptions(preset="sphere")),
    "d435": SampleOptions(NUM_POINTS, noise="d435"),
}


@dataclass(frozen=True)
class Golden:
    """One cloud (N, 3), camera frame, metres, and the estimator that is asked."""

    name: str
    estimator: str
    points: np.ndarray


def drawn() -> dict[str, np.ndarray]:
    """Clouds of procedural objects by name, such as ``laptop-front``."""
    clouds = {
        f"{category}-{view}": frozen_samples([category], 1, 1, options, first_seed=_SEED)[0].points
        for category in ARTIMAGE
        for view, options in VIEWS.items()
    }
    furniture = frozen_samples(["storage_furniture"], 1, 1, VIEWS["front"], first_seed=_SEED, parts="any")
    return {**clouds, "any-front": furniture[0].points}


def stored() -> list[Golden]:
    """Clouds of procedural objects."""
    with np.load(CLOUDS, allow_pickle=False) as clouds:
        return [Golden(name, name.split("-")[0], clouds[name]) for name in sorted(clouds.files)]


def real(partnet: Path) -> list[Golden]:
    """A cloud of one real object of each category that has any, from the front."""
    samples = {
        category: samples_of(real_objects(category, "test", partnet)[:1], 1, VIEWS["front"], _SEED)
        for category in ARTIMAGE
        if category != "scissors"
    }
    return [Golden(f"{category}-real", category, found[0].points) for category, found in samples.items()]


def summary(estimate: Estimate) -> dict[str, Any]:
    """What is compared, in JSON's terms."""
    return {
        "T_camera_part": estimate.T_camera_part.round(6).tolist(),
        "translation": estimate.translation.round(6).tolist(),
        "size": estimate.size.round(6).tolist(),
        "state": estimate.state.round(6).tolist(),
        "confidence": round(estimate.confidence, 4),
        "points_of_part": np.bincount(estimate.part + 1).tolist(),
    }


def write(estimates: dict[str, Any]) -> None:
    """Store estimates by name."""
    text = ",\n".join(f"{json.dumps(name)}: {json.dumps(estimates[name])}" for name in sorted(estimates))
    write_atomic(ESTIMATES, f"{{\n{text}\n}}\n".encode())


def write_clouds() -> None:
    """Draw and store the clouds of procedural objects."""
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, **drawn())
    write_atomic(CLOUDS, buffer.getvalue())
