"""What the benchmark ReArtMix found in each image, kept while it runs: a stopped run goes on from it."""

from __future__ import annotations

import hashlib
import json
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from artperl.evaluation.average_precision import PosedObject
from artperl.inputs.detections import Detections
from artperl.methods.estimator_files import folder_of, weights_sha256
from artperl.scene.estimator import SceneEstimate, SceneEstimator
from artsim.errors import ConfigError
from artsim.runs.kept import read_kept, write_kept

_SECONDS = 10.0
"""Between two writes: all images are written each time."""


@dataclass(frozen=True)
class ImageRecord:
    """What was found in an image.

    Attributes
    ----------
    detected : int
        Objects.
    seconds : dict
        By stage.
    failures : list of str
        Categories of detections without an estimate.
    found : list of PosedObject
    """

    detected: int
    seconds: dict[str, float]
    failures: list[str]
    found: list[PosedObject]

    @staticmethod
    def of(image: int | str, result: SceneEstimate) -> ImageRecord:
        """Of the estimates of an image."""
        seconds = {stage: own / 1e3 for stage, own in result.milliseconds.items()}
        return ImageRecord(
            len(result.objects),
            {**seconds, "all": sum(seconds.values())},
            [obj.detection.category for obj in result.objects if obj.estimate is None],
            [
                PosedObject(
                    str(image), obj.detection.category, obj.estimate.rotation, obj.estimate.translation,
                    obj.estimate.size, obj.score,
                )
                for obj in result.objects
                if obj.estimate is not None
            ],
        )  # fmt: skip

    def to_json(self) -> dict[str, Any]:
        """In JSON's terms."""
        found = [
            [obj.category, obj.rotation.tolist(), obj.center.tolist(), obj.size.tolist(), obj.score]
            for obj in self.found
        ]
        return {"detected": self.detected, "seconds": self.seconds, "failures": self.failures, "found": found}

    @staticmethod
    def from_json(image: str, record: dict[str, Any]) -> ImageRecord:
        """Inverse of :meth:`to_json`."""
        found = [
            PosedObject(image, category, np.array(rotation), np.array(center), np.array(size), score)
            for category, rotation, center, size, score in record["found"]
        ]
        return ImageRecord(record["detected"], record["seconds"], record["failures"], found)


def setup_of(images: list[str], detections: Detections | None, estimator: SceneEstimator) -> str:
    """Digest of all that the records of a run depend on."""
    told = {
        "images": images,
        "estimators": {name: weights_sha256(folder_of(own)) for name, own in sorted(estimator.estimators.items())},
        "options": sorted((name, str(value)) for name, value in estimator.changes.items()),
        "apart": estimator.apart,
        "detections": estimator.detector.sha256 if detections is None else [
            [str(d.image), d.category, d.score, list(d.box), d.segmentation] for d in detections.all
        ],
    }  # fmt: skip
    return hashlib.sha256(json.dumps(told, sort_keys=True, default=str).encode()).hexdigest()


class Kept:
    """Records by image, in the file that the figures will be in.

    Parameters
    ----------
    path : Path or None
        None keeps nothing.
    setup : str
        Records of another setup are left alone: the run begins anew.

    Raises
    ------
    ConfigError
        When the file is damaged.
    """

    def __init__(self, path: Path | None, setup: str):
        self.path, self.setup, self.records = path, setup, dict[str, ImageRecord]()
        self._written = time.monotonic()
        unfinished = read_kept(path).get("unfinished")
        if unfinished is None or unfinished.get("setup") != setup:
            return
        try:
            self.records = {key: ImageRecord.from_json(key, own) for key, own in unfinished["images"].items()}
        except (KeyError, TypeError, ValueError, AttributeError) as error:
            raise ConfigError(f"its records are damaged ({error})", path, "remove it to start again") from error

    def add(self, image: str, record: ImageRecord) -> None:
        """Keep the record of an image, and write at intervals."""
        self.records[image] = record
        if time.monotonic() - self._written > _SECONDS:
            self.write()

    def write(self) -> None:
        """Write what there is."""
        images = {key: record.to_json() for key, record in self.records.items()}
        write_kept(self.path, {"unfinished": {"setup": self.setup, "images": images}})
        self._written = time.monotonic()
