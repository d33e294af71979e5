"""The verb ``artsim vary``."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from artsim.commands.printing import say_some
from artsim.common.program import Figures, resumable
from artsim.errors import AssetError
from artsim.loading.roots import Packages


@dataclass(frozen=True)
class Vary(Figures, Packages):
    """Write variations of an object: stretched, other limits and axes, parts exchanged or left out.

    Every variation passes the gates that the object passes, and has a folder <out>/<seed> with a URDF file, meshes, and
    a meta.json that says what was done. Stop it at any moment: rerun the command to resume.

    Example: artsim vary path/to/StorageFurniture/45162 --others path/to/StorageFurniture --count 20 --out out/varied
    """

    path: tyro.conf.Positional[Path]
    """URDF, MJCF, USD, GLB or joint file, or its folder; or a procedural object: its name, such as laptop:3, or the
    params.json that comes with its files. Without --others, it is made of other parameters."""
    out: Path
    """Folder to write to; made if missing."""
    count: int = 10
    """Variations."""
    seed: int = 0
    """Seed of the first variation; the others count up from it."""
    others: tuple[Path, ...] = ()
    """Objects of the same category, or folders of them: parts of theirs may take the place of the object's."""
    strength: float | None = None
    """How far parameters of a procedural object move, as a share of their ranges; 0.3 by default."""
    towards: Path | None = None
    """Procedural object of the same category: write those on the way to it, in equal steps."""
    formats: tuple[Literal["urdf", "mjcf", "usd", "usdz", "simready"], ...] = ("urdf",)
    """File formats: mobility.urdf, mobility.xml, mobility.usda, mobility.usdz, and in the folder simready a package for
    NVIDIA's profile Robotics-Prop."""

    def run(self) -> None:
        from artsim.variation.folder import write_variations

        with resumable("whole variations are kept", self.out):
            summary = write_variations(
                self.path, self.out, self.count, self.seed, self.others, self.formats, self.package_root,
                strength=self.strength, towards=self.towards,
            )  # fmt: skip
        say_some(summary.failed, self.say)
        self.say(f"{summary.folder}: {len(summary.notes)} variations of {self.path}\n{summary}")
        self.finish(summary)
        if not summary.notes:
            raise AssetError("no variation passes the gates that the object passes", self.path, "use another --seed")
