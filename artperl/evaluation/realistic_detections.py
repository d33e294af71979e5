"""Detections as a detector of today makes them, from the ground truth of scenes: an estimator can be judged alone.

Masks have wrong borders, lack pieces and leak; some objects are missed, some found twice, some are nothing at all.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, gaussian_filter

from artsim.common.progress import track
from artsim.errors import ConfigError
from artsim.formats.coco import mask_record
from artsim.scenes import SceneDataset, SceneRecord

Mask = NDArray[np.bool_]
_SMOOTH = 6.0
"""Pixels over which a border's error changes: networks predict masks at a quarter of the resolution or less."""
_LEAST = 64
"""Pixels of the smallest mask that is reported."""
LEAST_VISIBLE = 0.1
"""Share of an object that must be seen for it to be found, and to count: BOP does not ask for others."""


@dataclass(frozen=True)
class Flaws:
    """How detections differ from the truth. All are chosen, none is measured on a detector."""

    border: float = 2.0
    """Standard deviation in pixels by which a mask's border lies too far out or in."""
    cut: float = 0.1
    """Share of masks that lack a piece, 10 to 30 % on one side."""
    leak: float = 0.15
    """Share of masks that take in a patch of what is beside them, up to 10 % of their area."""
    missed: float = 0.04
    """Share of fully visible objects that are not found; up to half as many again of those that are mostly hidden."""
    confused: float = 0.02
    """Share of objects that get another category."""
    twice: float = 0.03
    """Share of objects that are found twice."""
    false: float = 0.3
    """False detections an image, on average."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not 0.0 <= value <= (1.0 if name not in ("border", "false") else 100.0):
                raise ConfigError(f"{value} is out of range", name, "use 0 to 1; of border and false 0 to 100")


def realistic_detections(
    scenes: SceneDataset, flaws: Flaws | None = None, seed: int = 0
) -> list[dict[str, Any]]:  # fmt: skip
    """COCO's list of results for all views of some scenes; the same seed gives the same list.

    Each entry has ``image_id`` (the view's place in the dataset), ``file_name`` (its key), ``category_id`` and
    ``category``, ``score``, ``segmentation`` and ``bbox``. Category ids count from 1 in alphabetical order.

    Parameters
    ----------
    scenes : SceneDataset
    flaws : Flaws, optional
    seed : int
    """
    found, names = list[dict[str, Any]](), scenes.categories
    number = {name: i for i, name in enumerate(names, start=1)}
    for image, record in enumerate(track("detections", scenes, total=len(scenes), unit="image", leave=False)):
        rng = np.random.default_rng([seed, record.entry.scene, record.entry.view])
        for category, score, mask in _of_view(record, names, flaws or Flaws(), rng):
            told = {"image_id": image, "file_name": record.entry.key, "category_id": number[category]}
            own = mask_record(mask)
            del own["area"]
            found.append({**told, "category": category, "score": round(score, 4), **own})
    return found


def _of_view(
    record: SceneRecord, names: Sequence[str], flaws: Flaws, rng: np.random.Generator
) -> list[tuple[str, float, Mask]]:
    found: list[tuple[str, float, Mask]] = []
    ids = record.instance_ids
    for i, obj in enumerate(record.entry.objects):
        truth = ids == i
        hidden = 1.0 - obj.visible_fraction
        missed = rng.random() < flaws.missed + 0.5 * hidden * hidden
        if obj.visible_fraction < LEAST_VISIBLE or missed:
            continue
        for again in range(1 + (rng.random() < flaws.twice)):
            mask = imperfect(truth, flaws, rng)
            if mask.sum() < _LEAST:
                continue
            category = obj.category
            if len(names) > 1 and rng.random() < flaws.confused:
                category = str(rng.choice([name for name in names if name != category]))
            overlap = (mask & truth).sum() / (mask | truth).sum()
            # Scores of detectors rise with the quality of the mask, loosely.
            score = 0.35 + 0.6 * overlap - 0.25 * again - 0.2 * hidden + 0.08 * rng.standard_normal()
            found.append((category, float(np.clip(score, 0.05, 0.999)), mask))
    for _ in range(rng.poisson(flaws.false)):
        mask = _nothing(record, rng)
        if mask.sum() >= _LEAST:
            found.append((str(rng.choice(list(names))), float(rng.uniform(0.05, 0.6)), mask))
    return found


def imperfect(truth: Mask, flaws: Flaws, rng: np.random.Generator) -> Mask:
    """A mask (H, W) as a network might predict it: its border moved, perhaps a piece cut away or taken in."""
    rows, columns = np.flatnonzero(truth.any(axis=1)), np.flatnonzero(truth.any(axis=0))
    margin = round(4 * flaws.border + 0.5 * np.sqrt(truth.sum())) + 4
    window = np.s_[
        max(rows[0] - margin, 0) : rows[-1] + margin + 1, max(columns[0] - margin, 0) : columns[-1] + margin + 1
    ]
    inside = truth[window]
    # Pixels from the border, positive inside: the pixels on both sides of it are half a pixel away.
    away = np.where(inside, distance_transform_edt(inside) - 0.5, 0.5 - distance_transform_edt(~inside))
    wave = gaussian_filter(rng.standard_normal(inside.shape), _SMOOTH, mode="reflect")
    moved = away + flaws.border * (wave / max(float(wave.std()), 1e-12) + 0.5 * rng.standard_normal()) > 0
    place = np.indices(inside.shape).reshape(2, -1).T
    if rng.random() < flaws.cut and moved.any():
        angle = rng.uniform(0, 2 * np.pi)
        along = (place @ (np.sin(angle), np.cos(angle))).reshape(inside.shape)
        moved &= along <= np.quantile(along[moved], 1.0 - rng.uniform(0.1, 0.3))
    if rng.random() < flaws.leak:
        border = np.flatnonzero(np.abs(away.ravel()) < 2.0)
        if len(border):
            center = place[rng.choice(border)]
            radius = np.sqrt(rng.uniform(0.02, 0.1) * inside.sum() / np.pi) * np.sqrt(2.0)  # half of it is inside
            moved |= (np.linalg.norm(place - center, axis=1) < radius).reshape(inside.shape)
    mask = np.zeros_like(truth)
    mask[window] = moved
    return mask


def _nothing(record: SceneRecord, rng: np.random.Generator) -> Mask:
    """A mask of something else: an everyday thing, or a patch of the table."""
    ids = record.instance_ids
    others = [i for i in np.unique(ids) if i >= len(record.entry.objects) and 500 < (ids == i).sum() < 0.1 * ids.size]
    if others:
        return np.asarray(ids == rng.choice(others))
    height, width = ids.shape
    row, column = rng.uniform(0, height), rng.uniform(0, width)
    tall, wide = rng.uniform(0.03, 0.12, 2) * height
    y, x = np.ogrid[:height, :width]
    patch: Mask = ((y - row) / tall) ** 2 + ((x - column) / wide) ** 2 < 1.0
    return patch & (ids >= len(record.entry.objects))
