"""A trained detector: an image with depth in, detections out."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from artsim.common.extras import require_extra

with require_extra("the detector"):
    import torch
    from torch import Tensor
    from torch.nn import functional

from artperl.core.tensor_files import read_tensors, write_tensors
from artperl.core.threads import single_precision
from artperl.detection import SHIPPED
from artperl.detection.grouping import assign, find_middles
from artperl.detection.images import Look, cell_pixels, fill, look_at
from artperl.detection.network import OFFSET, DetectorNetwork, DetectorSize
from artperl.inputs.detections import Detection
from artsim.common.files import read_json, write_atomic
from artsim.common.json_records import from_json_values
from artsim.errors import DatasetError
from artsim.formats.coco import mask_record
from artsim.model.camera import Camera

WEIGHTS = Path(__file__).parents[1] / "weights"
"""Folder of what comes with the package."""
_SETTINGS, _TENSORS, _FORMAT = "detector.json", "weights.safetensors", 1
_AGAIN = "train it again: artperl train-detector"
_LEAST_SHARE = 2e-4
"""Of the image's pixels that the smallest object has: fewer are borders of others."""


class Detector:
    """Finds objects in an image with depth.

    Parameters
    ----------
    network : DetectorNetwork
    about : mapping, optional
        How it was trained, in JSON's terms.
    sha256 : str
        Digest of its file of weights, where it comes from one.
    """

    def __init__(self, network: DetectorNetwork, about: Mapping[str, Any] | None = None, sha256: str = ""):
        self.network, self.about, self.sha256 = network.eval(), dict(about or {}), sha256

    @property
    def categories(self) -> tuple[str, ...]:
        """Categories that it finds."""
        return self.network.size.categories

    def __repr__(self) -> str:
        return f"<Detector of {', '.join(self.categories)}>"

    @torch.no_grad()
    @single_precision()
    def __call__(
        self, rgb: NDArray[np.uint8] | None, depth: ArrayLike, K: ArrayLike, image: int | str = 0
    ) -> list[Detection]:
        """Objects of an image, the surest first, with masks that do not overlap; none where nothing was measured.

        Parameters
        ----------
        rgb : (H, W, 3) uint8 or None
        depth : (H, W) float
            Metres along the camera's axis; 0, or not finite, where nothing was measured.
        K : (3, 3) float
            Intrinsic matrix in pixels; the centre of the first pixel is at (0.5, 0.5).
        image : int or str
            Identity that the detections get.
        """
        depth, K = np.asarray(depth, dtype=np.float32), np.asarray(K, dtype=np.float64)
        if not (np.isfinite(depth) & (depth > 0)).any():
            return []
        look = look_at(rgb, depth, K)
        logits, told = self.network(torch.from_numpy(look.channels)[None])
        shares = logits.softmax(1)
        cells = _Answer.of(shares[0], told[0], look.points[_cells(look)] / look.unit)
        middles = find_middles(cells.votes, cells.sizes, cells.shares[1:].sum(axis=0))
        if len(middles) == 0:
            return []
        # The same at the full resolution: edges of depth make edges of masks.
        full = [functional.interpolate(x, size=depth.shape, mode="bilinear", align_corners=False)[0]
                for x in (shares, told)]  # fmt: skip
        pixels = _Answer.of(full[0], full[1], _points(depth, K) / look.unit)
        owner = assign(pixels.votes, pixels.sizes, middles)
        found = [self._detection(pixels, owner == n, image) for n in range(len(middles))
                 if (owner == n).sum() >= _LEAST_SHARE * depth.size]  # fmt: skip
        return sorted(found, key=lambda d: -d.score)

    def _detection(self, pixels: _Answer, own: NDArray[np.bool_], image: int | str) -> Detection:
        """The object that some of the pixels with an object show: its category is what they say in the mean."""
        mean = pixels.shares[:, own].mean(axis=1)
        category = int(mean[1:].argmax())
        mask = np.zeros_like(pixels.there)
        mask[pixels.there] = own
        record, size = mask_record(mask), (mask.shape[1], mask.shape[0])
        left, top, wide, high = (float(v) for v in record["bbox"])
        score = float(np.clip(mean[1 + category], 0.0, 1.0))
        place = record["segmentation"], (left, top, wide, high), size
        return Detection(image, self.categories[category], score, *place)


@dataclass(frozen=True, eq=False)
class _Answer:
    """What the network says of those n cells or pixels of an image that it takes for objects."""

    there: NDArray[np.bool_]
    """(H, W) bool. Which those are."""
    shares: NDArray[np.float32]
    """(1 + C, n) float32. Probability of each category, none first."""
    votes: NDArray[np.float32]
    """(n, 3) float32. For the middle of the object, in the unit of the look."""
    sizes: NDArray[np.float32]
    """(n,) float32. Diagonal of the object."""

    @staticmethod
    def of(shares: Tensor, told: Tensor, points: NDArray[np.float32]) -> _Answer:
        """Of probabilities (1 + C, H, W), votes (4, H, W), and the points (H, W, 3) that cast them."""
        there = (shares.argmax(0) > 0).numpy()
        own = told.numpy()[:, there]
        return _Answer(there, shares.numpy()[:, there], points[there] + OFFSET * own[:3].T, np.exp(own[3]))


def _cells(look: Look) -> tuple[NDArray[np.int64], ...]:
    """Index of the pixels in the middles of the cells."""
    return np.ix_(*(cell_pixels(n) for n in look.points.shape[:2]))


def _points(depth: NDArray[np.float32], K: NDArray[np.float64]) -> NDArray[np.float32]:
    """(H, W, 3) of all pixels, those without depth as far away as the nearest that has one."""
    filled = fill(depth, np.isfinite(depth) & (depth > 0))
    camera = Camera(K, depth.shape[1], depth.shape[0], np.eye(4))
    return camera.unproject(np.arange(depth.size), filled.ravel()).reshape(*depth.shape, 3).astype(np.float32)


def save_detector(detector: Detector, folder: Path, about: Mapping[str, Any]) -> None:
    """Write a detector: weights in half precision, sizes and how it was made in JSON."""
    folder.mkdir(parents=True, exist_ok=True)
    state = detector.network.state_dict()
    # Counters of batches are whole numbers, and not needed.
    write_tensors({name: t.half() for name, t in state.items() if t.is_floating_point()}, folder / _TENSORS)
    told = {"format": _FORMAT, "size": asdict(detector.network.size), "about": dict(about)}
    write_atomic(folder / _SETTINGS, (json.dumps(told, indent=1) + "\n").encode())


@single_precision()
def load_detector(name: str | Path = SHIPPED) -> Detector:
    """A detector by its folder, or the one that comes with the package by its name.

    Raises
    ------
    DatasetError
        When there is none, or its files are damaged.
    ConfigError
        When transformers is not installed.
    """
    folder = WEIGHTS / name if str(name) == SHIPPED else Path(name)
    folder = folder / "best" if not (folder / _SETTINGS).exists() and (folder / "best").is_dir() else folder
    if not (folder / _SETTINGS).exists():
        raise DatasetError(
            "there is no detector here", folder, f"use {SHIPPED}, or a folder that artperl train-detector wrote"
        )
    settings = read_json(folder / _SETTINGS, "the detector's settings", DatasetError)
    try:
        if settings.get("format") != _FORMAT:
            raise ValueError(f"format {settings.get('format')!r:.20} is not {_FORMAT}")
        size = from_json_values(DetectorSize, settings["size"])
        if not (1 <= len(size.categories) <= 1000 and 1 <= size.width <= 512 and 1 <= size.blocks <= 16):
            raise ValueError(f"its size {size} is out of range")
    except (ValueError, KeyError, AttributeError, TypeError) as error:
        raise DatasetError(f"{_SETTINGS} is damaged: {error}", folder, _AGAIN) from error
    tensors, sha256 = read_tensors(folder / _TENSORS, "the file of weights", _AGAIN)
    with torch.device("meta"):  # a forged size takes no memory before it is that of the weights
        shapes = {k: t.shape for k, t in DetectorNetwork(size).state_dict().items() if t.is_floating_point()}
    if shapes != {k: t.shape for k, t in tensors.items()}:
        raise DatasetError("the weights are not of a detector of this size", folder, _AGAIN)
    network = DetectorNetwork(size)
    network.load_state_dict(tensors, strict=False)
    return Detector(network, settings.get("about"), sha256)
