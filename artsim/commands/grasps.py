"""The command ``artsim grasps``."""

import logging
from dataclasses import dataclass
from pathlib import Path

import tyro

from artsim.commands.having import Workers, categories_named
from artsim.common.program import Figures
from artsim.errors import AssetError, ConfigError
from artsim.loading.roots import Packages

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Grasps(Figures, Packages, Workers):
    """Find grasps of movable parts that open their joints, each proved in MuJoCo by a hand with two fingers.

    For every part there are up to 16 places where the fingers close on opposite sides of a handle or an edge. The hand
    comes without touching anything, closes with 70 N, and takes the part along the way that its joint goes.

    Example: artsim grasps path/to/StorageFurniture/45162 --out out/grasps

    Procedural ones: artsim grasps --category drawer refrigerator --count 20 --out out/grasps
    """

    objects: tyro.conf.Positional[tuple[Path, ...]] = ()
    """URDF, MJCF or USD files, or folders of them."""
    category: tuple[str, ...] = ()
    """Categories of procedural objects; 'all' for every one."""
    out: Path = Path("out/grasps")
    """Folder to write to, a JSON and an npz file for each object."""
    count: int = 10
    """Objects of each category."""
    seed: int = 0
    """Seed of the first object of a category, and of the draws."""
    per_part: int = 16
    """Grasps of a part, at most."""

    def run(self) -> None:
        from artsim.loading.sources import Source, family_sources, find_sources
        from artsim.physics.grasp_files import write_grasps

        if not (self.objects or self.category):
            raise ConfigError("there are no objects", fix="name files, or --category drawer")
        categories = categories_named(self.category)
        sources: list[Source] = [*find_sources(self.objects, self.package_root)] if self.objects else []
        if categories:
            sources += family_sources(categories, self.count, self.seed)
        done = write_grasps(sources, self.out, self.per_part, self.seed, self.workers)
        for line in done.failed:
            log.warning("left out: %s", line)
        self.say(
            f"{self.out}: {done.grasps} grasps of {done.grasped} parts; {done.graspable} of {done.parts} movable parts "
            f"of {done.objects} objects have room for the hand ({done.objects - done.made} objects were there already)"
        )
        self.finish(done)
        if len(done.failed) == done.objects:
            raise AssetError("no object has grasps", str(self.out), "see the lines above")
