"""The verb ``artperl reartmix``."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from artperl.commands.estimators import named_estimators
from artperl.detection import SHIPPED
from artsim.common.outputs import check_output
from artsim.common.program import Figures, cores
from artsim.errors import ConfigError

log = logging.getLogger(__name__)

_FOLDER = Path("out/reartmix")


@dataclass(frozen=True)
class ReArtMix(Figures):
    """Test estimators on images of several objects: average precision at 5 degrees, 5 cm and IoU 0.5."""

    root: Path | None = None
    """Folder that artsim scene wrote, or that has the layout of ReArtMix; by default scenes are made in
    out/reartmix."""
    views: int = 50
    """Scenes that are made."""
    detector: str | None = None
    """What finds the objects: tabletop, which comes with the package, or a folder that artperl train-detector wrote. By
    default detections are realistic ones, made from the truth."""
    detections: Path | None = None
    """COCO's results instead, with image_id as artperl detections writes it."""
    skip_bad: bool = False
    """Leave out detections that cannot be used, and list them, instead of refusing the file."""
    estimators: tuple[str, ...] = ()
    """CATEGORY=NAME, such as box=out/train/box-long, or a folder with one for each category, of any method. By default
    those that come with the package, by their names, and any for drawers, whose number varies."""
    seen_from: tuple[float, float] | None = None
    """Range of the camera's azimuth, for the estimators: degrees about the object's vertical, 0 for its front.
    By default unknown."""
    picture: Path | None = None
    """Write the first 12 images with the estimates over them here, as PNG."""

    def run(self) -> None:
        from artperl.evaluation.reartmix import SEEDS, open_images, reartmix_scenes, run_reartmix
        from artperl.inputs.detections import read_detections
        from artperl.scene.estimator import SceneEstimator
        from artsim.scenes import generate_scenes

        if self.json_file is not None:
            check_output(self.json_file, [self.detections])
        root = self.root
        if root is None:
            root = _FOLDER
            generate_scenes(reartmix_scenes(), root, self.views, SEEDS, 10, cores())
        images = open_images(root)
        if self.detector is not None and self.detections is not None:
            raise ConfigError("objects are found once", "detector, detections", "leave one of them out")
        detections = None if self.detector is not None else images.own_detections(0)
        if self.detections is not None:
            detections = read_detections(self.detections, images.sizes, images.names(), self.skip_bad)
        for text in () if detections is None else detections.skipped:
            log.warning(f"left out: {text}")
        told: dict[str, Any] = {} if self.seen_from is None else {"seen_from": self.seen_from}
        named: dict[str, str | Path] = {"drawer": "generic", **named_estimators(self.estimators)}
        estimator = SceneEstimator(named, self.detector or SHIPPED, **told)
        figures = run_reartmix(images, detections, estimator, True, self.say, self.picture)
        self.finish(figures)
