"""The verb ``artsim record``."""

import logging
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

import tyro

from artsim.commands.having import categories_named
from artsim.common.program import Figures
from artsim.physics.episode import EpisodeOptions

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Record(Figures):
    """Record motions for tracking: objects under physics, frame by frame, with full ground truth.

    Every motion is a shard of samples of one object, a control step apart, whose joints a motor drives from one random
    goal to the next; motions.json lists times, joint states and speeds. Parts keep their number from frame to frame.

    Example: artsim record --categories laptop door --motions 20 --camera orbit --out out/motions
    """

    out: Path
    """Folder to write to; made if missing."""
    motions: int = 10
    """Motions, each of another object."""
    frames: int = 60
    """Frames of each: one for each control step."""
    seed: int = 0
    """Motion m depends on (seed, m) and the options alone."""
    episode: Annotated[EpisodeOptions, tyro.conf.arg(name="")] = field(default_factory=EpisodeOptions)

    def run(self) -> None:
        from artsim.physics.episode_file import record

        episode = replace(self.episode, categories=categories_named(self.episode.categories))
        folder = record(self.out, episode, self.motions, self.frames, self.seed)
        log.info(f"{folder}: {self.motions} motions of {self.frames} frames; read them: artsim.physics.open_motions")
        self.finish({"folder": folder, "motions": self.motions, "frames": self.frames})
