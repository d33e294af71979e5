"""The verb ``artperl detections``."""

import logging
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import tyro

from artperl.evaluation.realistic_detections import Flaws
from artsim.common.outputs import write_output
from artsim.common.program import Figures
from artsim.errors import ConfigError

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class MakeDetections(Figures):
    """Detect the objects of scenes: COCO's results, with masks. By default, detections are made from the ground truth.

    Borders of masks are off, pieces are missing or too much, objects are missed, found twice, confused, or made up. The
    same seed makes the same file. Flaws of 0 make perfect detections.

    From the ground truth: artperl detections out/scenes --out out/detections.json --seed 0

    By a detector, with COCO's average precision: artperl detections out/scenes --out out/found.json --detector tabletop
    """

    scenes: tyro.conf.Positional[Path]
    """Folder that artsim scene wrote."""
    out: Path
    """File to write, .json."""
    detector: str | None = None
    """tabletop, which comes with the package, or a folder that artperl train-detector wrote."""
    seed: int = 0
    """Seed of all random draws."""
    flaws: Annotated[Flaws, tyro.conf.arg(name="")] = field(default_factory=Flaws)

    def run(self) -> None:
        from artperl.evaluation.realistic_detections import realistic_detections
        from artsim.formats.bop import json_bytes
        from artsim.scenes import open_scenes

        scenes = open_scenes(self.scenes)
        if self.detector is None:
            found = realistic_detections(scenes, self.flaws, self.seed)
        else:
            from artperl.detection.detector import load_detector
            from artperl.evaluation.mask_precision import detect, mask_precision, precision_lines

            if (self.flaws, self.seed) != (Flaws(), 0):
                raise ConfigError("a detector has its own flaws, and no chance", "flaws, seed", "leave them out")
            found = detect(scenes, load_detector(self.detector))
        write_output(self.out, json_bytes(found))
        counts = Counter(d["category"] for d in found)
        there = sum(obj.visible_fraction > 0 for entry in scenes.entries for obj in entry.objects)
        told = ", ".join(f"{n} {name}" for name, n in sorted(counts.items()))
        figures: dict[str, Any] = {"detections": counts, "objects": there, "images": len(scenes)}
        if self.detector is not None:
            figures["masks"] = mask_precision(scenes, found)
            for line in precision_lines(figures["masks"]):
                self.say(line)
        self.finish(figures)
        log.info(f"wrote {self.out}: {len(found)} detections ({told}) of {there} objects in {len(scenes)} images")
