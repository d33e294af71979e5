"""The verb ``artsim generate-objects``."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro

from artsim.commands.having import Having, Workers, categories_named
from artsim.commands.printing import log_made
from artsim.common.program import Figures, resumable
from artsim.export.options import ExportOptions
from artsim.families.constraints import Constraints


@dataclass(frozen=True)
class GenerateObjects(Figures, Workers):
    """Write procedural objects as files: simulation-ready URDF folders in PartNet-Mobility's style, MJCF, USD.

    Every object has a folder <out>/<category>/<seed>, and index.csv lists them all. Stop it at any moment: rerun
    the command to resume. On one kind of processor, bytes depend on category, seed and formats alone.

    Example: artsim generate-objects --category drawer --count 1000 --out out/drawers
    """

    category: tuple[str, ...]
    """Categories, such as drawer laptop; 'all' for every one."""
    out: Path
    """Folder to write to; made if missing."""
    count: int = 1000
    """Objects of each category."""
    formats: tuple[Literal["urdf", "mjcf", "usd", "usdz", "simready"], ...] = ("urdf",)
    """File formats: mobility.urdf, mobility.xml, mobility.usda, mobility.usdz, and in the folder simready a package for
    NVIDIA's profile Robotics-Prop."""
    seed: int = 0
    """Seed of the first object; object n of a category is artsim.make(category, seed + n)."""
    having: Having = ()
    options: Annotated[ExportOptions, tyro.conf.arg(name="")] = field(default_factory=ExportOptions)

    def run(self) -> None:
        from artsim.export.batch import generate_objects

        with resumable("whole objects are kept", self.out):
            result = generate_objects(
                categories_named(self.category), self.out, self.count, self.seed, self.formats, self.workers,
                constraints=Constraints.parse(self.having), options=self.options,
            )  # fmt: skip
        log_made(result.folder, f"{result.total} objects", result.made, "objects", result.seconds)
        self.finish(result)
