"""The verb ``artsim dataset``."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from artsim.commands.having import Workers
from artsim.commands.printing import log_made
from artsim.common.program import Figures, resumable


@dataclass(frozen=True)
class Dataset(Figures, Workers):
    """Make a frozen dataset: the same bytes as everybody has.

    artsim-10k: 10,200 procedural objects of 51 categories, a view of each, in the splits train, val and test, each a
    dataset of its own. A manifest in the package has their seeds and checksums. Stop it at any moment: rerun the
    command to resume. The result does not depend on the number of workers.

    Example: artsim dataset artsim-10k --splits test --out out/artsim-10k
    """

    name: tyro.conf.Positional[str]
    """artsim-10k, or the file of a manifest."""
    out: Path
    """Folder to write to; made if missing."""
    splits: tuple[Literal["train", "val", "test"], ...] = ()
    """Make these splits only."""

    def run(self) -> None:
        from artsim.datasets.frozen import make_frozen, read_manifest

        manifest = read_manifest(self.name)
        with resumable("whole files are kept", self.out):
            result = make_frozen(manifest, self.out, self.splits, self.workers)
        log_made(result.folder, f"{result.total} samples, equal to {manifest.name}", result.made, "samples",
                 result.seconds)  # fmt: skip
        self.finish(result)
