"""Detections of files: COCO's results, with masks, scores and categories. Nothing wrong is left out silently."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artperl.inputs.coco_masks import decode_segmentation
from artsim.common.files import read_json
from artsim.errors import ConfigError

ALIASES = {"scissor": "scissors"}
"""Names of categories in other people's files -> ours."""
_MAX_DETECTIONS = 200_000
_OUTSIDE = 2.0
"""Pixels that a box may reach outside the image: detectors round."""
_NAMED = 8
"""Problems that an error lists; the others are counted."""


@dataclass(frozen=True, eq=False)
class Detection:
    """An object that a detector has found in an image."""

    image: int | str
    """Identity of the image, as the file has it."""
    category: str
    score: float
    """0 to 1."""
    segmentation: Any
    """As the file has it; None where it has a box only."""
    box: tuple[float, float, float, float]
    """Left, top, width, height, pixels."""
    size: tuple[int, int]
    """(int, int). Width and height of the image."""

    @property
    def mask(self) -> NDArray[np.bool_]:
        """(H, W) pixels of the object; those of the box where the file has no mask."""
        width, height = self.size
        if self.segmentation is not None:
            return decode_segmentation(self.segmentation, width, height)
        mask = np.zeros((height, width), dtype=bool)
        left, top = max(round(self.box[0]), 0), max(round(self.box[1]), 0)
        mask[top : round(self.box[1] + self.box[3]), left : round(self.box[0] + self.box[2])] = True
        return mask


@dataclass(frozen=True)
class Detections:
    """Detections of a file."""

    all: tuple[Detection, ...]
    skipped: tuple[str, ...] = ()
    """What is wrong with each that was left out, where that was asked for."""
    notes: tuple[str, ...] = ()
    """What was assumed."""

    def of(self, image: int | str) -> tuple[Detection, ...]:
        """Those of one image."""
        return tuple(d for d in self.all if str(d.image) == str(image))


def read_detections(
    path: Path,
    images: Mapping[int | str, tuple[int, int]],
    categories: Mapping[int, str] | None = None,
    skip_bad: bool = False,
    only_image: str | None = None,
) -> Detections:
    """Detections of a file in COCO's format of results.

    The file is a list of ``{"image_id", "category_id", "score", "segmentation" and/or "bbox"}``, or such a list under
    ``annotations`` beside ``categories`` and ``images``. ``category`` may name the category itself.

    Parameters
    ----------
    path : Path
    images : mapping
        Width and height of the images that there are, by identity.
    categories : mapping, optional
        Names by ``category_id``, where the file does not say.
    skip_bad : bool
        Leave out detections that cannot be used, and say which, instead of refusing the file.
    only_image : str, optional
        Read those of this image alone: others of the file are of other images, and no mistake.

    Raises
    ------
    ConfigError
        When the file cannot be read; or, without ``skip_bad``, when a detection of it cannot be used.
    """
    document = read_json(path, "the file of detections", ConfigError)
    entries, names = _entries(document, path)
    names = {**(categories or {}), **names}
    sizes = {str(key): (key, size) for key, size in images.items()}
    found, problems, boxes = list[Detection](), list[str](), 0
    for number, entry in enumerate(entries):
        if only_image is not None and isinstance(entry, dict) and str(entry.get("image_id")) != only_image:
            continue
        try:
            found.append(_detection(entry, sizes, names))
            boxes += found[-1].segmentation is None
        except ValueError as error:
            problems.append(f"detection {number}{_whose(entry)}: {error}")
    if problems and not skip_bad:
        more = f"; and {len(problems) - _NAMED} more" if len(problems) > _NAMED else ""
        raise ConfigError(
            f"{len(problems)} of {len(entries)} detections cannot be used: {'; '.join(problems[:_NAMED])}{more}", path,
            "correct the file, or add --skip-bad to leave these out and list them",
        )  # fmt: skip
    notes = (f"{boxes} detections have no mask: the object is all that is in the box",) if boxes else ()
    return Detections(tuple(found), tuple(problems), notes)


def image_ids(path: Path) -> dict[str, str]:
    """Identities of the images in a file of detections, each with the name of its file where that is said.

    Raises
    ------
    ConfigError
        When the file cannot be read.
    """
    document = read_json(path, "the file of detections", ConfigError)
    entries, _ = _entries(document, path)
    found = {str(e["image_id"]): "" for e in entries if isinstance(e, dict) and "image_id" in e}
    listed = document.get("images") if isinstance(document, dict) else None
    for own in [*(listed if isinstance(listed, list) else []), *entries]:
        if isinstance(own, dict) and isinstance(own.get("file_name"), str):
            key = str(own.get("image_id", own.get("id")))
            found[key] = own["file_name"]
    return found


def _entries(document: object, path: Path) -> tuple[list[Any], dict[int, str]]:
    """The list of detections in a document, and names of categories by number."""
    names: dict[int, str] = {}
    entries = document
    if isinstance(document, dict):
        entries = document.get("annotations")
        listed = document.get("categories")
        for own in listed if isinstance(listed, list) else []:
            if isinstance(own, dict) and isinstance(own.get("name"), str) and type(own.get("id")) is int:
                names[own["id"]] = own["name"]
    if not isinstance(entries, list) or len(entries) > _MAX_DETECTIONS:
        raise ConfigError(
            "it holds no list of detections", path,
            'write COCO\'s results: [{"image_id": 0, "category": "laptop", "score": 0.9, "segmentation": ...}, ...]',
        )  # fmt: skip
    return entries, names


def _whose(entry: object) -> str:
    return f" (image {entry.get('image_id')!r:.40})" if isinstance(entry, dict) else ""


def _detection(
    entry: object, sizes: Mapping[str, tuple[int | str, tuple[int, int]]], names: Mapping[int, str]
) -> Detection:
    """One detection; a ValueError says what is wrong with it."""
    if not isinstance(entry, dict):
        raise ValueError("it is not a set of named values")
    image = sizes.get(str(entry.get("image_id")))
    if image is None:
        raise ValueError(f"there is no image {entry.get('image_id')!r:.40} (there are {_list(list(sizes))})")
    width, height = image[1]
    score = entry.get("score")
    if type(score) not in (int, float) or not 0.0 <= score <= 1.0:  # type: ignore[operator]
        raise ValueError(f"its score is {score!r:.40}, not 0 to 1")
    segmentation = entry.get("segmentation") or None
    box = None if entry.get("bbox") is None else _box(entry["bbox"], width, height)
    if segmentation is None and box is None:
        raise ValueError("it has neither a segmentation nor a bbox")
    if segmentation is not None:
        mask = decode_segmentation(segmentation, width, height)
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        if len(rows) == 0:
            raise ValueError("its mask is empty")
        own = (columns[0], rows[0], columns[-1] + 1 - columns[0], rows[-1] + 1 - rows[0])
        box = box or (float(own[0]), float(own[1]), float(own[2]), float(own[3]))
    assert box is not None
    return Detection(image[0], _category(entry, names), float(score), segmentation, box, (width, height))  # type: ignore[arg-type]


def _category(entry: Mapping[str, Any], names: Mapping[int, str]) -> str:
    name, number = entry.get("category", entry.get("category_name")), entry.get("category_id")
    name = name if name is not None else number if isinstance(number, str) else names.get(number)  # type: ignore[arg-type]
    if not isinstance(name, str):
        known = _list([f"{i} {text}" for i, text in names.items()]) if names else "no category is named"
        raise ValueError(
            f'category_id {number!r:.40} is unknown ({known}): add "category": "laptop" to it,'
            ' or "categories" to the file'
        )
    return ALIASES.get(name, name)


def _box(box: object, width: int, height: int) -> tuple[float, float, float, float]:
    if not isinstance(box, list) or len(box) != 4 or not all(type(v) in (int, float) and np.isfinite(v) for v in box):
        raise ValueError(f"its bbox is {box!r:.60}, not left, top, width, height")
    left, top, w, h = (float(v) for v in box)
    if w <= 0 or h <= 0:
        raise ValueError(f"its bbox {_numbers(box)} has no area: write left, top, width, height")
    if left < -_OUTSIDE or top < -_OUTSIDE or left + w > width + _OUTSIDE or top + h > height + _OUTSIDE:
        hint = ""
        if w > left and h > top and w <= width and h <= height:
            hint = ": is it left, top, right, bottom? write left, top, width, height"
        raise ValueError(f"its bbox {_numbers(box)} reaches outside the image of {width} x {height}{hint}")
    return left, top, w, h


def _numbers(values: list[Any]) -> str:
    return " ".join(f"{v:g}" for v in values)


def _list(values: list[str]) -> str:
    return ", ".join(values[:_NAMED]) + (", ..." if len(values) > _NAMED else "") if values else "none"
