"""The verb ``artperl detections``."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated

import tyro

from artperl.evaluation.realistic_detections import Flaws
from artsim.common.files import write_atomic


@dataclass(frozen=True)
class MakeDetections:
    """Make detections of scenes as a detector of today would, from their ground truth: COCO's results, with masks.

    Borders of masks are off, pieces are missing or too much, objects are missed, found twice, confused, or made up. The
    same seed makes the same file. Flaws of 0 make perfect detections.

    Example: artperl detections out/scenes --out out/detections.json --seed 0
    """

    scenes: tyro.conf.Positional[Path]
    """Folder that artsim scene wrote."""
    out: Path
    """File to write, .json."""
    seed: int = 0
    """Of all chance."""
    flaws: Annotated[Flaws, tyro.conf.arg(name="")] = field(default_factory=Flaws)

    def run(self) -> None:
        from artperl.evaluation.realistic_detections import realistic_detections
        from artsim.formats.bop import json_bytes
        from artsim.scenes import open_scenes

        scenes = open_scenes(self.scenes)
        found = realistic_detections(scenes, self.flaws, self.seed)
        write_atomic(self.out, json_bytes(found))
        counts = ", ".join(f"{n} {name}" for name, n in sorted(Counter(d["category"] for d in found).items()))
        there = sum(obj.visible_fraction > 0 for entry in scenes.entries for obj in entry.objects)
        print(f"wrote {self.out}: {len(found)} detections ({counts}) of {there} objects in {len(scenes)} images")
