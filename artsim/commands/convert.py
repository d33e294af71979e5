"""The verb ``artsim convert``."""

from dataclasses import dataclass
from pathlib import Path

import tyro

from artsim.commands.having import Workers
from artsim.commands.printing import print_made, resumable
from artsim.formats.base import FormatName


@dataclass(frozen=True)
class Convert(Workers):
    """Convert a finished dataset to a format that other programs read.

    webdataset: tar shards with plain keys. bop: scenes, models of parts, poses, masks, joints. coco: masks of parts.
    hdf5: one file for each sample, with BlenderProc's keys. ply: one coloured cloud for each sample. All but webdataset
    and ply need images: generate with --images depth part_mask. Stop it at any moment: rerun the command to
    resume. The result does not depend on the number of workers.

    Example: artsim convert out/first --to bop --out out/first_bop
    """

    path: tyro.conf.Positional[Path]
    """Dataset folder."""
    to: FormatName
    """Format to write."""
    out: Path
    """Folder to write to; made if missing."""
    split: str | None = None
    """Convert this split only: train, val or test."""
    samples: tuple[int, ...] = ()
    """Convert samples with these indices only."""
    group: int = 256
    """Samples of each tar file (webdataset), or images of each scene (bop)."""

    def run(self) -> None:
        from artsim.formats.conversion import convert

        with resumable("whole files are kept", self.out):
            result = convert(self.path, self.to, self.out, self.split, self.samples, self.group, self.workers)
        whole = f"{result.num_samples} samples in {result.files} files"
        print_made(result.folder, whole, result.made, "samples", result.seconds)
