"""``artperl estimate`` of an image of several objects: all objects, all parts."""

from __future__ import annotations

import json
import logging
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PIL import Image

from artperl.commands.estimate_options import EstimateOptions
from artperl.commands.estimators import named_estimators
from artperl.detection import SHIPPED
from artsim.common.outputs import write_output
from artsim.common.program import STDOUT
from artsim.errors import ConfigError

if TYPE_CHECKING:
    from artperl.inputs.detections import Detections
    from artperl.scene.estimator import SceneEstimate

log = logging.getLogger(__name__)

_PICTURES = (".png", ".jpg", ".jpeg", ".bmp", ".webp", ".tif", ".tiff")


def is_image_pair(files: Sequence[Path]) -> bool:
    """Whether these are two files, the first a picture in colour, which no depth image is."""
    if len(files) != 2 or files[0].suffix.lower() not in _PICTURES or not files[0].is_file():
        return False
    from artperl.inputs.images import IN_COLOUR

    try:
        with Image.open(files[0]) as image:
            return image.mode in IN_COLOUR
    except (OSError, ValueError, Image.DecompressionBombError):
        return False  # what is wrong with it is told where it is read


def estimate_scene(options: EstimateOptions) -> None:
    """Estimate, print, and write what is asked for.

    Raises
    ------
    ConfigError
        When a file cannot be used, or an option does not fit.
    """
    from artperl.inputs.detections import Detections
    from artperl.inputs.images import read_image
    from artperl.inputs.reading import read_depth_image
    from artperl.scene.drawing import draw_scene
    from artperl.scene.estimator import SceneEstimator
    from artperl.scene.simulation import export_scene
    from artsim.export.folders import new_folder

    _check(options)
    image, depth_file = options.clouds
    depth = read_depth_image(depth_file, options.input_options())
    rgb = read_image(image)
    told: dict[str, Any] = {} if options.seen_from is None else {"seen_from": options.seen_from}
    estimator = SceneEstimator(named_estimators(options.estimators), options.detector or SHIPPED, **told)
    size = (depth.values.shape[1], depth.values.shape[0])
    given = None if options.detections is None else _read_detections(options, image, size)
    detections = given or Detections((), (), (f"objects are found by {estimator.detector}",))
    for text in (*depth.notes, *detections.notes):
        log.info("note: %s", text)
    for text in (*depth.warnings, *(f"left out: {text}" for text in detections.skipped)):
        log.warning(text)
    result = estimator(rgb, depth.values, depth.K, None if given is None else given.all)
    if options.picture is not None:
        write_output(options.picture, draw_scene(rgb, depth.K, result))
    for folder in dict.fromkeys(own for own in (options.urdf, options.mjcf, options.usd) if own is not None):
        with new_folder(folder) as part:
            export_scene(result, part)
    record = scene_record(result, detections)
    if options.out == STDOUT:
        print(json.dumps(record))
        return
    print(result)
    stages = ", ".join(f"{name} {value:.0f} ms" for name, value in result.milliseconds.items())
    print(
        f"\n{len(result.objects)} detections, {sum(o.estimate is not None for o in result.objects)} estimates; {stages}"
    )
    if options.out is not None:
        write_output(options.out, (json.dumps(record, indent=1) + "\n").encode())


def _check(options: EstimateOptions) -> None:
    if len(options.clouds) != 2 or any(path.is_dir() for path in options.clouds):
        raise ConfigError(
            f"{len(options.clouds)} files are named", "estimate",
            "name the image in colour, then the depth image: artperl estimate image.png depth.png --intrinsics"
            " camera.json",
        )  # fmt: skip
    if options.intrinsics is None:
        raise ConfigError("a depth image needs intrinsics", "intrinsics", "add --intrinsics camera.json")
    if options.out is not None and str(options.out) != "-" and options.out.suffix != ".json":
        raise ConfigError(f"{options.out} is no .json file", "out", "name one, or - for standard output")
    if options.detections is not None and options.detector is not None:
        raise ConfigError("objects are found once", "detector, detections", "leave one of them out")
    given = [name for name in ("mask", "mask_id", "view") if getattr(options, name) is not None]
    if given or options.method != "full" or options.camera != "opencv":
        names = ", ".join([*given, *(["method"] if options.method != "full" else [])]) or "camera"
        raise ConfigError("these do not go with several objects", names, "leave them out")


def _read_detections(options: EstimateOptions, image: Path, size: tuple[int, int]) -> Detections:
    """Detections of this one image, whichever of a file's images it is."""
    from artperl.inputs.detections import image_ids, read_detections

    assert options.detections is not None
    listed = image_ids(options.detections)
    named = [key for key, name in listed.items() if name and Path(name).stem in (image.stem, image.parent.name)]
    chosen = options.image_id
    if chosen is None and len(named) == 1:
        chosen = named[0]
    elif chosen is None and len(listed) <= 1:
        chosen = next(iter(listed), "0")
    if chosen is None or (listed and chosen not in listed):
        known = ", ".join(list(listed)[:8]) + (", ..." if len(listed) > 8 else "")
        raise ConfigError(
            f"it is of {len(listed)} images ({known}), and which of them is {image.name} is not said"
            if chosen is None else f"it has no image {chosen!r:.40} (it has {known})",
            options.detections, "add --image-id N",
        )  # fmt: skip
    return read_detections(options.detections, {chosen: size}, None, options.skip_bad, chosen)


def scene_record(result: SceneEstimate, detections: Detections) -> dict[str, Any]:
    """Estimates of an image in JSON's terms."""
    objects = []
    for obj in result.objects:
        found = obj.detection
        record: dict[str, Any] = {"category": found.category, "detection_score": found.score, "bbox": list(found.box)}
        if obj.estimate is None:
            objects.append({**record, "error": obj.problem})
        else:
            objects.append({**record, "score": obj.score, **obj.estimate.to_dict()})
    return {
        "objects": objects, "skipped": list(detections.skipped), "notes": list(detections.notes),
        "milliseconds": result.milliseconds,
    }  # fmt: skip
