"""The verb ``artsim export``."""

import shutil
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

import tyro

from artsim.common.program import Figures
from artsim.errors import ConfigError
from artsim.export.options import ExportOptions
from artsim.loading.roots import Opened


@dataclass(frozen=True)
class Export(Figures, Opened):
    """Write an object as URDF, MJCF and USD for simulators, such as one of PartNet-Mobility.

    What collides is cut into convex pieces, so that things can be put into drawers. That takes seconds for each hollow
    piece; the result is kept for the next time.

    Example: artsim export path/to/StorageFurniture/45162 --formats mjcf usd --out out/45162
    """

    path: tyro.conf.Positional[Path]
    """URDF, MJCF or USD file, GLB or joint file, or its folder."""
    out: Path
    """Folder to write; it must not exist."""
    formats: tuple[Literal["urdf", "mjcf", "usd", "usdz", "simready"], ...] = ("urdf", "mjcf", "usd")
    """File formats: mobility.urdf, mobility.xml, mobility.usda, mobility.usdz, and in the folder simready a package for
    NVIDIA's profile Robotics-Prop."""
    collision: Literal["pieces", "hull", "surface"] = "pieces"
    """What collides: convex pieces of each part (extra sim), one convex hull, or the surface as it is. Parts of MJCF
    and USD files keep what their file says."""
    options: Annotated[ExportOptions, tyro.conf.arg(name="")] = field(default_factory=ExportOptions)

    def run(self) -> None:
        from artsim.export import check_formats, export
        from artsim.export.loaded import prepare
        from artsim.loading.urdf import load

        check_formats(self.formats)
        if self.out.exists():
            raise ConfigError("it exists already", self.out, "name a folder that does not, or remove it")
        obj = prepare(load(self.path, package_roots=self.package_root, body=self.body), self.collision)
        self.out.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=f".{self.out.name}.", dir=self.out.parent) as place:
            made = Path(place) / "made"
            export(obj, made, self.formats, {"source": {"collision": self.collision}}, self.options)
            shutil.move(made, self.out)
        pieces = sum(len(part.body.pieces) for part in obj.parts if part.body is not None)
        self.say(f"{self.out}: {', '.join(self.formats)}; {len(obj)} parts, {pieces} shapes that collide")
        repairs = [repair for repair in obj.repairs if not repair.note]
        for repair in repairs:
            self.say(f"  {repair}")
        self.finish({"folder": self.out, "parts": len(obj), "pieces": pieces, "repairs": repairs})
