"""The verb ``artsim convert``."""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import tyro

from artsim.commands.having import Workers
from artsim.commands.printing import log_made
from artsim.common.program import Figures, resumable
from artsim.formats.base import FormatName

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Convert(Figures, Workers):
    """Convert a finished dataset to a format that other programs read.

    webdataset: tar shards with plain keys. huggingface: Parquet with a card. ply: one coloured cloud for each sample.
    op-align: one cloud with poses for each sample. With images (generate with --images depth part_mask): bop: scenes,
    models of parts, poses, masks, joints. coco: masks of parts. hdf5: one file for each sample, with BlenderProc's
    keys. Of the objects alone: particulate, singapo, gapartnet, and two-state: images of each object in two states.
    Stop it at any moment: rerun the command to resume. The result does not depend on the number of workers.

    Example: artsim convert out/first --to bop --out out/first_bop
    """

    path: tyro.conf.Positional[Path]
    """Dataset folder."""
    to: FormatName | Literal["lerobot"]
    """Format to write; lerobot is for the motions of artsim record."""
    out: Path
    """Folder to write to; made if missing."""
    split: str | None = None
    """Convert this split only: train, val or test."""
    samples: tuple[int, ...] = ()
    """Convert samples with these indices only."""
    group: int = 256
    """Samples of each tar file (webdataset), or images of each scene (bop)."""

    def run(self) -> None:
        if self.to == "lerobot":
            self.finish(_write_motions(self.path, self.out))
            return
        from artsim.formats.conversion import convert

        with resumable("whole files are kept", self.out):
            result = convert(self.path, self.to, self.out, self.split, self.samples, self.group, self.workers)
        whole = f"{result.num_samples} {result.unit}s in {result.files} files"
        log_made(result.folder, whole, result.made, f"{result.unit}s", result.seconds)
        self.finish(result)


def _write_motions(folder: Path, out: Path) -> dict[str, Any]:
    """Write the motions in a folder as a LeRobot dataset: what was written."""
    import numpy as np

    from artsim.common.progress import track
    from artsim.formats.lerobot import Recording, write_lerobot
    from artsim.physics.episode_file import open_motions

    motions = open_motions(folder)
    recordings = (
        Recording(
            f"move the joints of a {motion.obj.category.replace('_', ' ')}", motion.joint_state[:, 1:],
            motion.joint_velocity[:, 1:], np.stack([sample.points for sample in motion]),
        )
        for motion in track("motions", motions, unit="motion")
    )  # fmt: skip
    joints, points = max(len(motion.obj) - 1 for motion in motions), len(motions[0][0].points)
    write_lerobot(out, recordings, 1.0 / (motions[0].time[1] - motions[0].time[0]), joints, points)
    frames = sum(map(len, motions))
    log.info(f"{out}: {len(motions)} episodes of {frames} frames; open it with lerobot's LeRobotDataset")
    return {"folder": out, "episodes": len(motions), "frames": frames}
