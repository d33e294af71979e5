"""From an image with depth to the parts of every object: its detections, their clouds, their categories' estimators."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artperl.core.estimate import Estimate
from artperl.detection import SHIPPED
from artperl.inputs.depth_images import points_of_depth
from artperl.inputs.detections import Detection
from artperl.inputs.masks import cut_warnings
from artperl.methods.estimator_files import load_estimator, stored_method
from artperl.methods.estimator_folders import WEIGHTS
from artperl.methods.protocol import Method
from artperl.scene.denoise import denoise
from artsim.errors import ArtsimError, ConfigError

if TYPE_CHECKING:
    from artperl.detection.detector import Detector

_MOST_POINTS = 8192
"""Of an object's cloud: what estimators are tested with. More cost time and bring nothing."""
_FAR, _NEAR = 30.0, 0.05
"""Metres. No indoor image has its median depth beyond: then the unit is another one."""


@dataclass(frozen=True, eq=False)
class SceneObject:
    """An object of an image."""

    detection: Detection
    estimate: Estimate | None
    problem: str = ""
    """Why there is no estimate."""
    milliseconds: float = 0.0

    @property
    def score(self) -> float:
        """How sure it is that the object is there as estimated: the detector's score times the confidence."""
        return 0.0 if self.estimate is None else self.detection.score * self.estimate.confidence


@dataclass(frozen=True, eq=False)
class SceneEstimate:
    """All objects of an image, in the order of their detections. Camera frame, metres, radians."""

    objects: tuple[SceneObject, ...]
    milliseconds: dict[str, float] = field(default_factory=dict)
    """By stage."""

    def __str__(self) -> str:
        lines = []
        for number, obj in enumerate(self.objects):
            head = f"{number} {obj.detection.category}, detected {100 * obj.detection.score:.0f} %"
            lines.append(f"{head}: {obj.problem}" if obj.estimate is None else f"{head}\n{obj.estimate}")
        return "\n\n".join(lines) or "no object is detected"

    def __repr__(self) -> str:
        return f"<SceneEstimate: {sum(o.estimate is not None for o in self.objects)} of {len(self.objects)} objects>"


class SceneEstimator:
    """Estimates all objects of an image: ``load_scene_estimator()(rgb, depth, K)``.

    Estimators are loaded when their category is first seen.

    Parameters
    ----------
    estimators : mapping, optional
        Name or folder of the estimator of each category, of any method that is trained; by default those that come with
        the package, by their names.
    detector : str or Path
        Name or folder of the detector, loaded when an image comes without detections.
    **changes
        Of the estimators' options, such as ``seen_from=(-75.0, 75.0)``.
    """

    def __init__(
        self, estimators: Mapping[str, str | Path] | None = None, detector: str | Path = SHIPPED, **changes: Any
    ):  # fmt: skip
        shipped = {path.parent.name: path.parent.name for path in WEIGHTS.glob("*/estimator.json")}
        shipped.pop("generic", None)  # of no category
        self.estimators: dict[str, str | Path] = {**shipped, **(estimators or {})}
        self.changes, self._loaded = changes, dict[str, Method]()
        self._detector_name = detector
        self._detector: Detector | None = None

    @property
    def categories(self) -> tuple[str, ...]:
        """Categories that there is an estimator for."""
        return tuple(sorted(self.estimators))

    @property
    def detector(self) -> Detector:
        """What finds the objects."""
        from artperl.detection.detector import load_detector  # transformers takes seconds to import

        if self._detector is None:
            self._detector = load_detector(self._detector_name)
        return self._detector

    def __call__(
        self, rgb: ArrayLike | None, depth: ArrayLike, K: ArrayLike, detections: Sequence[Detection] | None = None
    ) -> SceneEstimate:
        """Estimate all objects of an image.

        Parameters
        ----------
        rgb : (H, W, 3) uint8 or None
            Of the depth image's size. The detector uses it where it is there; the estimators do not.
        depth : (H, W) float
            Metres along the camera's axis; 0, or not finite, where nothing was measured.
        K : (3, 3) float
            Intrinsic matrix in pixels; the centre of the first pixel is at (0.5, 0.5).
        detections : sequence of Detection, optional
            By default what the detector finds.

        Raises
        ------
        ConfigError
            When images are not of one size, or the depth is in another unit. What is wrong with one object is said in
            its ``problem``: no estimator, no depth, a cloud that cannot be fitted.
        """
        depth = np.asarray(depth, dtype=np.float64)
        check_images(rgb, depth)
        K, begun, times = np.asarray(K, dtype=np.float64), time.perf_counter(), dict[str, float]()
        if detections is None:
            picture = None if rgb is None else np.asarray(rgb, dtype=np.uint8)
            find, begun = self.detector, time.perf_counter()
            detections = find(picture, depth, K)
            times["detector"] = 1e3 * (time.perf_counter() - begun)
            begun = time.perf_counter()
        objects = tuple(self._object(depth, K, detection) for detection in detections)
        whole = 1e3 * (time.perf_counter() - begun)
        estimating = sum(obj.milliseconds for obj in objects)
        return SceneEstimate(objects, {**times, "clouds": whole - estimating, "estimates": estimating})

    def _object(self, depth: NDArray[np.float64], K: NDArray[np.float64], detection: Detection) -> SceneObject:
        category = detection.category
        if category not in self.estimators:
            return SceneObject(
                detection, None,
                f"there is no estimator for {category!r}. Fix: name one with --estimators {category}=FOLDER, trained by"
                f" artperl train --category {category}",
            )  # fmt: skip
        estimator = self._estimator(category)
        try:
            mask = detection.mask
            points = points_of_depth(denoise(depth, mask), K, mask)
            if len(points) > _MOST_POINTS:
                points = points[np.sort(np.random.default_rng(0).permutation(len(points))[:_MOST_POINTS])]
            begun = time.perf_counter()
            estimate = estimator(points)
        except ArtsimError as error:
            return SceneObject(detection, None, str(error))
        milliseconds = 1e3 * (time.perf_counter() - begun)
        estimate = replace(estimate, warnings=(*estimate.warnings, *cut_warnings(mask)))
        return SceneObject(detection, estimate, "", milliseconds)

    def _estimator(self, category: str) -> Method:
        if category not in self._loaded:
            name = self.estimators[category]
            method = stored_method(name)
            # The other methods have no options.
            self._loaded[category] = load_estimator(name, method=method, **(self.changes if method == "full" else {}))
        return self._loaded[category]


load_scene_estimator = SceneEstimator
"""The public name."""


def check_images(rgb: ArrayLike | None, depth: NDArray[np.float64]) -> None:
    """Refuse images of two sizes, and depth in another unit than metres.

    Raises
    ------
    ConfigError
    """
    if depth.ndim != 2:
        raise ConfigError(f"an array of shape {depth.shape} is no depth image", "depth", "pass (H, W) metres")
    if rgb is not None and np.shape(rgb)[:2] != depth.shape:
        rows, columns = np.shape(rgb)[:2]
        raise ConfigError(
            f"the colour image has {columns} x {rows} pixels, and the depth image {depth.shape[1]} x {depth.shape[0]}",
            "rgb", "give depth that is aligned to the colour image, of its size",
        )  # fmt: skip
    seen = depth[np.isfinite(depth) & (depth > 0)]
    if len(seen) == 0:
        raise ConfigError("the depth image holds no depth", "depth", "check the file and its unit")
    middle = float(np.median(seen))
    if not _NEAR <= middle <= _FAR:
        unit = "millimetres that are taken for metres" if middle > _FAR else "metres that are taken for millimetres"
        fix = "--unit mm, or divide by 1000" if middle > _FAR else "--unit m, or multiply by 1000"
        raise ConfigError(f"the median depth is {middle:.3g} m: these look like {unit}", "depth", f"use {fix}")
