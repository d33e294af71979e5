"""``artperl evaluate --benchmark reartmix``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from artperl.detection import SHIPPED
from artsim.common.files import write_atomic
from artsim.common.outputs import check_output
from artsim.common.program import cores
from artsim.common.progress import say
from artsim.errors import ConfigError

if TYPE_CHECKING:
    from artperl.commands.evaluate import Evaluate

_SCENES = 50
_FOLDER = Path("out/reartmix")


def evaluate_reartmix(options: Evaluate) -> None:
    """Make or open the images, read or make detections, estimate, print the table.

    Raises
    ------
    ConfigError
        When an option does not fit, or detections cannot be used.
    DatasetError
        When the folder holds no images.
    """
    from artperl.commands.estimate_scene import named_estimators
    from artperl.evaluation.reartmix import SEEDS, open_images, reartmix_scenes, run_reartmix
    from artperl.inputs.detections import read_detections
    from artperl.scene.estimator import SceneEstimator
    from artsim.scenes import generate_scenes

    own = ("rows", "conditions", "real_weights", "files", "package_root", "states", "preset", "noise", "ablation",
           "category", "num_points", "estimator", "method")  # fmt: skip
    given = [name for name in own if getattr(options, name) != getattr(type(options)(), name)]
    if given:
        raise ConfigError(
            "reartmix has images of its own", ", ".join(given), "leave it out; name estimators with --estimators"
        )
    if options.json is not None:
        check_output(options.json, [options.detections])
    root = options.root
    if root is None:
        root = _FOLDER
        generate_scenes(reartmix_scenes(), root, options.views or _SCENES, SEEDS, 10, cores())
    images = open_images(root)
    if options.detector is not None and options.detections is not None:
        raise ConfigError("objects are found once", "detector, detections", "leave one of them out")
    detections = None if options.detector is not None else images.own_detections(0)
    if options.detections is not None:
        detections = read_detections(options.detections, images.sizes, images.names(), options.skip_bad)
    for text in () if detections is None else detections.skipped:
        say(f"left out: {text}")
    told: dict[str, Any] = {} if options.seen_from is None else {"seen_from": options.seen_from}
    named: dict[str, str | Path] = {"drawer": "any", **named_estimators(options.estimators)}
    estimator = SceneEstimator(named, options.detector or SHIPPED, apart=options.apart, **told)
    figures = run_reartmix(images, detections, estimator, True, say, options.picture, options.json)
    if options.json is not None:  # it may have been read: a stopped run goes on from it
        write_atomic(options.json, (json.dumps(figures, indent=1) + "\n").encode())
