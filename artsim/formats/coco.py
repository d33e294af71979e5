"""COCO: instance masks and boxes of parts, as run lengths, in one JSON file for each split."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import orjson
from numpy.typing import NDArray

from artsim.datasets.dataset import Dataset
from artsim.datasets.sample_options import SampleOptions
from artsim.datasets.shards import sample_key
from artsim.formats.base import Format, Piece, require_images
from artsim.formats.images import grey_depth, mask_box, png_bytes
from artsim.observing.sample import Sample
from artsim.runs.tasks import Output


class CocoFormat(Format):
    """``annotations/instances_<split>.json`` and ``images/<split>/<index>.png``."""

    def check(self, options: SampleOptions, folder: Path) -> None:
        """There must be masks, and colour or depth."""
        require_images(options, folder, "coco", ("part_mask",) if "rgb" in options.images else ("depth", "part_mask"))

    def write_samples(self, dataset: Dataset, piece: Piece, samples: Iterable[Sample], output: Output) -> Any:
        """Write the images; the answer has an entry for each."""
        entries = []
        for sample in samples:
            name = f"{sample_key(sample.index)}.png"
            output.write(f"images/{piece.split}/{name}", png_bytes(_picture(sample)))
            image = {"id": sample.index, "file_name": name, "width": sample.width, "height": sample.height}
            entries.append({"image": image, "objects": _parts(sample)})
        return entries

    def finish(self, dataset: Dataset, answers: Sequence[tuple[Piece, Any]], output: Output) -> None:
        """Number categories and annotations, and write the JSON of each split."""
        entries = [(piece.split, entry) for piece, answer in answers for entry in answer]
        named: list[tuple[str, ...]] = sorted(
            {tuple(part["name"]) for _, entry in entries for part in entry["objects"]}
        )
        categories = {name: {"name": "/".join(name), "supercategory": name[0]} for name in named}
        for split, group in groupby(entries, key=lambda pair: pair[0]):
            info = {"description": f"artsim, split {split}", "version": dataset.description["artsim_version"]}
            document = coco_document(info, categories, [entry for _, entry in group])
            output.write(f"annotations/instances_{split}.json", orjson.dumps(document))


def coco_document(
    info: dict[str, Any], categories: Mapping[tuple[str, ...], dict[str, Any]], entries: Iterable[dict[str, Any]]
) -> dict[str, Any]:
    """Images and what is in them, with numbers for categories and annotations.

    Parameters
    ----------
    info : dict
    categories : mapping
        What is said of each category, by its name.
    entries : iterable of dict
        ``image``, and ``objects``, each with the ``name`` of its category.
    """
    number = {name: i for i, name in enumerate(categories, start=1)}
    images, annotations = list[Any](), list[Any]()
    for entry in entries:
        images.append(entry["image"])
        for obj in entry["objects"]:
            own = {key: value for key, value in obj.items() if key != "name"}
            identity = {"id": len(annotations) + 1, "image_id": entry["image"]["id"]}
            annotations.append({**identity, "category_id": number[tuple(obj["name"])], **own})
    listed = [{"id": number[name], **about} for name, about in categories.items()]
    return {"info": info, "licenses": [], "images": images, "annotations": annotations, "categories": listed}


def _picture(sample: Sample) -> NDArray[np.uint8]:
    """(H, W, 3) colour, or (H, W) depth as grey where there is none: near is bright, no return is black."""
    if sample.rgb is not None:
        return sample.rgb
    assert sample.depth is not None
    return grey_depth(sample.depth)


def _parts(sample: Sample) -> list[dict[str, Any]]:
    """What COCO says of each part that is seen, and its name."""
    assert sample.part_mask is not None
    found = []
    for k, name in enumerate(sample.part_names):
        mask = sample.part_mask == k
        if mask.any():
            found.append({**mask_record(mask), "iscrowd": 0, "name": (sample.category, name), "part": k})
    return found


def mask_record(mask: NDArray[np.bool_]) -> dict[str, Any]:
    """What COCO says of a mask (H, W) that is not empty: ``segmentation`` as run lengths, ``area``, ``bbox``."""
    left, top, right, bottom = mask_box(mask) or (0, 0, 0, 0)
    segmentation = {"size": list(mask.shape), "counts": run_lengths(mask)}
    return {"segmentation": segmentation, "area": int(mask.sum()), "bbox": [left, top, right - left, bottom - top]}


def run_lengths(mask: NDArray[np.bool_]) -> str:
    """A mask as COCO's compressed run lengths.

    Runs go down the columns and begin with one outside. From the fourth on, each is written as its difference from the
    run two before. A number is written five bits at a time, lowest first; 32 says that more follow, 48 makes it a
    letter.

    Parameters
    ----------
    mask : (H, W) bool
    """
    flat = mask.ravel(order="F")
    changes = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    ends = np.concatenate([[0], changes, [flat.size]])
    runs = np.diff(ends).tolist()
    if flat[0]:
        runs = [0, *runs]
    letters = bytearray()
    for i, run in enumerate(runs):
        value = run - runs[i - 2] if i > 2 else run
        more = True
        while more:
            bits, value = value & 31, value >> 5
            more = value != (-1 if bits & 16 else 0)  # the highest bit written is the sign
            letters.append(48 + bits + 32 * more)
    return letters.decode()
