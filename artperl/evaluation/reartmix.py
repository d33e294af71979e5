"""ReArtMix: several objects in each image, scored by average precision at 5 degrees, 5 cm and IoU 0.5.

Images come from scenes that ``artsim scene`` wrote, or from folders in ReArtMix's own layout.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import count, islice
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artperl.data.categories import JOINTS
from artperl.evaluation.average_precision import CRITERIA, PosedObject, ap_table
from artperl.evaluation.metrics import true_poses
from artperl.evaluation.realistic_detections import LEAST_VISIBLE, realistic_detections
from artperl.evaluation.reartmix_files import AnnotatedImage, ReArtMixFolder, is_reartmix
from artperl.inputs.detections import Detection, Detections
from artperl.scene.drawing import draw_scene, scene_gallery
from artperl.scene.estimator import SceneEstimate, SceneEstimator
from artsim.common.outputs import write_output
from artsim.common.progress import track
from artsim.families import FAMILIES, make
from artsim.formats.images import grey_depth
from artsim.model.draws import StateOptions
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample
from artsim.observing.symmetry import Symmetry, equivalent_sample, symmetries
from artsim.scenes import SceneCameraOptions, SceneDataset, SceneOptions, SceneRun
from artsim.scenes.dataset import ViewObject

Array = NDArray[np.float64]

PUBLISHED = {"5_degrees": 48.9, "5_cm": 77.4, "iou_50": 57.8}
"""Mean average precision of ArtPERL on the original images, per cent (its section 5.3); box has 82.3 at 5 degrees."""
SEEDS = 1_000_000
"""First scene: objects of far smaller seeds are learnt from."""
_STAGES = ("detector", "clouds", "estimates", "all")
_SHOWN = 12
"""Images of a gallery."""

OBJECTS = (("box", 1, 8), ("stapler", 1, 7), ("cutter", 1, 9), ("scissors", 1, 9), ("drawer", 1, 10), ("drawer", 3, 5))
"""Categories of ReArt-48, joints of their objects, and how many there are (Liu et al. 2022)."""


def reart_objects() -> tuple[ArticulatedObject, ...]:
    """48 procedural objects with the joints that those of ReArt-48 have; no run learns from them."""
    found = list[ArticulatedObject]()
    for category, joints, number in OBJECTS:
        made = (make(category, seed) for seed in count(SEEDS))
        found += islice((obj for obj in made if obj.tree.types[1:] == JOINTS[category][:1] * joints), number)
    return tuple(found)


def reartmix_scenes() -> SceneRun:
    """Regenerated ReArtMix: its categories, joints, sizes (diagonals of 0.18 to 0.38 m), image size, focal length."""
    objects = SceneOptions(
        (), obj=reart_objects(), count=(3, 6), diagonal=(0.18, 0.38), crowded=True, distractors=4,
        states=StateOptions(),
    )  # fmt: skip
    camera = SceneCameraOptions(fov=(43.0, 43.0))
    return SceneRun(objects, camera, renderer="raycast", noise="d435", misses=True, num_points=64)


class SceneImages:
    """Images of scenes that ``artsim scene`` wrote.

    Parameters
    ----------
    folder : Path
    """

    def __init__(self, folder: Path):
        self.scenes = SceneDataset(folder)
        self.categories = self.scenes.categories
        cameras = (self.scenes[i].camera for i in range(len(self.scenes)))
        self.sizes: dict[int | str, tuple[int, int]] = {i: (c.width, c.height) for i, c in enumerate(cameras)}

    def __iter__(self) -> Iterator[tuple[int, AnnotatedImage]]:
        for i, record in enumerate(self.scenes):
            objects = [
                replace(
                    posed(sample, str(i)),
                    counted=told.visible_fraction >= LEAST_VISIBLE,
                    equals=equals_of(told, sample, str(i)),
                )
                for told, sample in zip(record.entry.objects, record.samples, strict=True)
                if sample is not None
            ]
            yield i, AnnotatedImage(record.entry.key, record.depth, record.camera.K, tuple(objects), record.rgb)

    def __len__(self) -> int:
        return len(self.scenes)

    def names(self) -> dict[int, str]:
        """Categories by their numbers in COCO's files."""
        return dict(enumerate(self.categories, start=1))

    def own_detections(self, seed: int) -> Detections:
        """Realistic ones, made from the truth."""
        return Detections(
            tuple(
                Detection(d["image_id"], d["category"], d["score"], d["segmentation"], tuple(d["bbox"]),
                          self.sizes[d["image_id"]])
                for d in realistic_detections(self.scenes, None, seed)
            ),
            notes=(f"detections are realistic ones, made from the truth with seed {seed}",),
        )  # fmt: skip


def posed(sample: Sample, image: str) -> PosedObject:
    """The truth of a sample."""
    return PosedObject(image, sample.category, *true_poses(sample), sample.box_size)


def equals_of(told: ViewObject, sample: Sample, image: str) -> tuple[PosedObject, ...]:
    """The same object in the other ways in which it looks the same, where it is procedural and symmetric."""
    return tuple(posed(equivalent_sample(sample, own), image) for own in _symmetries(told, sample.object_sha256))


@lru_cache(maxsize=4096)
def _symmetries(told: ViewObject, digest: str) -> tuple[Symmetry, ...]:
    if told.category not in FAMILIES or not told.object_id.isdecimal():
        return ()
    obj = make(told.category, int(told.object_id))
    return symmetries(obj) if obj.sha256 == digest else ()


def open_images(root: Path) -> SceneImages | ReArtMixFolder:
    """Images of a folder, in either layout.

    Raises
    ------
    DatasetError
        When it has neither.
    """
    return ReArtMixFolder(root) if is_reartmix(root) else SceneImages(root)


def run_reartmix(
    images: SceneImages | ReArtMixFolder,
    detections: Detections | None,
    estimator: SceneEstimator,
    progress: bool = True,
    say: Callable[[str], None] = print,
    gallery: Path | None = None,
) -> dict[str, Any]:
    """Estimate every detected object of every image, score, and print the table.

    Parameters
    ----------
    images : SceneImages or ReArtMixFolder
    detections : Detections or None
        None: what the estimator's own detector finds.
    estimator : SceneEstimator
    progress : bool
    say : callable
        Gets each line.
    gallery : Path, optional
        PNG to write, of the first images with the estimates over them; over depth where there is no colour.

    Returns
    -------
    dict
        ``categories`` (see :func:`artperl.evaluation.average_precision.ap_table`), ``mean`` over all categories,
        ``mean_with_estimator`` over those that there is an estimator for, ``strict`` and ``mean_strict`` where poses
        that look the same count as wrong, ``images``, ``detections``, ``failures``, ``seconds`` (median of an image
        by stage), ``notes``.
    """
    true, found, results = list[PosedObject](), list[PosedObject](), list[SceneEstimate]()
    pictures, colourless = list[bytes](), 0
    for key, image in track("images", images, total=len(images), unit="image", shown=progress):
        true += image.objects
        colourless += image.rgb is None
        result = estimator(image.rgb, image.depth, image.K, None if detections is None else detections.of(key))
        results.append(result)
        found += [
            PosedObject(str(key), obj.detection.category, own.rotation, own.translation, own.size, obj.score)
            for obj in result.objects
            if (own := obj.estimate) is not None
        ]
        if gallery is not None and len(pictures) < _SHOWN:
            pictures.append(draw_scene(_background(image), image.K, result))
    times = [{**own.milliseconds, "all": sum(own.milliseconds.values())} for own in results]
    stages = [stage for stage in _STAGES if times and stage in times[0]]
    detected = sum(len(own.objects) for own in results)
    table, strict = ap_table(found, true), ap_table(found, [replace(obj, equals=()) for obj in true])
    notes = [f"objects are found by {estimator.detector}"] if detections is None else list(detections.notes)
    if detections is None and colourless:
        notes.append(f"{colourless} images have no colour: their objects are found by depth alone")
    have = [name for name in table if name in estimator.categories]
    figures: dict[str, Any] = {
        "categories": table, "mean": _mean(table, list(table)), "mean_with_estimator": _mean(table, have),
        "strict": strict, "mean_strict": _mean(strict, list(strict)),
        "images": len(images), "detections": detected, "failures": detected - len(found), "notes": notes,
        "seconds": {stage: float(np.median([own[stage] for own in times])) / 1e3 for stage in stages},
    }  # fmt: skip
    lacking = [name for name in table if name not in have]
    if lacking:
        text = f"no estimator for {', '.join(lacking)}: none of their parts can be found."
        figures["notes"].append(f"{text} Fix: --estimators {lacking[0]}=FOLDER")
    if gallery is not None:
        write_output(gallery, scene_gallery(pictures))
    for line in _lines(figures):
        say(line)
    return figures


def _background(image: AnnotatedImage) -> NDArray[np.uint8]:
    """(H, W, 3) its colours, or its depth in grey."""
    if image.rgb is not None:
        return image.rgb
    return np.repeat(grey_depth(image.depth.astype(np.float32))[..., None], 3, axis=2)


def _mean(table: Mapping[str, Any], names: Sequence[str]) -> dict[str, float]:
    return {rule: float(np.mean([table[name][rule] for name in names])) if names else 0.0 for rule in CRITERIA}


def _lines(figures: Mapping[str, Any]) -> Iterator[str]:
    yield f"{'AP, %':<22}{'5 deg':>8}{'5 cm':>8}{'IoU 0.5':>9}{'objects':>9}{'parts':>7}"
    for name, own in figures["categories"].items():
        values = "".join(f"{100 * own[rule]:>{width}.1f}" for rule, width in zip(CRITERIA, (8, 8, 9), strict=True))
        yield f"{name:<22}{values}{own['objects']:>9}{own['parts']:>7}"
    titles = (("mean", "mean"), ("with estimators", "mean_with_estimator"), ("one truth alone", "mean_strict"))
    for title, key in titles:
        yield f"{title:<22}" + "".join(
            f"{100 * figures[key][rule]:>{width}.1f}" for rule, width in zip(CRITERIA, (8, 8, 9), strict=True)
        )
    published = "".join(f"{PUBLISHED[rule]:>{width}.1f}" for rule, width in zip(CRITERIA, (8, 8, 9), strict=True))
    yield f"{'published, mean':<22}{published}   (the original images; box 82.3 at 5 deg)"
    yield (
        f"{figures['images']} images, {figures['detections']} detections, {figures['failures']} without an estimate, "
        + ", ".join(f"{stage} {own:.2f} s" for stage, own in figures["seconds"].items())
        + " an image (median)"
    )
    for note in figures["notes"]:
        yield f"note: {note}"
