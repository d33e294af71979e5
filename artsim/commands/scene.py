"""The verb ``artsim scene``."""

import logging
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Annotated, Literal

import tyro

from artsim.commands.having import Workers
from artsim.commands.printing import log_made
from artsim.common.program import Figures, resumable
from artsim.common.progress import track
from artsim.scenes.dataset import open_scenes
from artsim.scenes.generate import SceneRun, generate_scenes

log = logging.getLogger(__name__)

_LISTED = 12
"""Views that are printed one by one; the others are counted."""


@dataclass(frozen=True)
class Scene(Figures, Workers):
    """Make scenes: several articulated objects on a table or a floor, in colour, with the ground truth of each.

    Every view becomes a folder: rgb.png, depth.npy, instance_ids.png, part_ids.png, scene.json, a cloud with its full
    record for each object, and overview.png, which shows it all. With --shard-size, tar files hold the same.
    scenes.json lists all views. Stop it at any moment: rerun the command to resume. A larger --scenes
    adds to what is there. The result depends on the options and the seed alone, never on the number of workers.

    Example: artsim scene --categories laptop stapler box --seed 3 --scenes 10 --views 2 --out out/scenes

    Small things in metres, crowded, as a camera sees them: artsim scene --categories box stapler cutter scissors drawer
    --count 3 6 --diagonal 0.18 0.38 --crowded --noise d435 --misses --scenes 100 --shard-size 20 --formats coco --out
    out/mix
    """

    out: Path
    """Folder to write to; made if missing."""
    scenes: int = 1
    """Scenes, seeds counting up."""
    seed: int = 0
    """Seed of the first scene: the same seed and options make the same files."""
    shard_size: int = 0
    """Scenes of each tar file; 0 writes a folder for each view."""
    options: Annotated[SceneRun, tyro.conf.arg(name="")] = field(default_factory=SceneRun)
    overviews: int = 12
    """Write overview.png for the views of so many scenes, the first ones."""
    formats: tuple[Literal["coco", "bop"], ...] = ()
    """Also write the finished scenes in these formats, into the folder <out>_<format>. coco: images and instance masks.
    bop: models, poses and masks of parts."""

    simulate: bool = False
    """Also write the scenes so that they simulate, into the folder <out>_simulation: objects with free joints in one
    MJCF file, one USD file, and URDF files with their places. Joints that would meet another object are named."""
    base: Literal["fixed", "free"] = "fixed"
    """With --simulate. fixed: objects are fixed where they stand; free: they can be pushed (MJCF, USD)."""

    def run(self) -> None:
        from artsim.drawing.scene_overview import overview_files
        from artsim.scenes.convert import convert_scenes

        with resumable("whole files are kept", self.out):
            result = generate_scenes(
                self.options,
                self.out,
                self.scenes,
                self.seed,
                self.shard_size,
                self.workers,
                overview_files,
                self.overviews,
            )
            converted = [convert_scenes(self.options, self.out, name, self.workers) for name in self.formats]
        for entry in open_scenes(self.out).entries[:_LISTED]:
            seen = ", ".join(f"{obj.category} {100 * obj.visible_fraction:.0f}%" for obj in entry.objects)
            self.say(f"{entry.key}: {seen} visible")
        log_made(result.folder, f"{result.total} scenes", result.made, "scenes", result.seconds)
        for folder in converted:
            log.info(f"wrote {folder}")
        if self.simulate:
            self._simulations()
        self.finish(result)

    def _simulations(self) -> None:
        from artsim.scenes.random_scene import make_scene
        from artsim.scenes.simulation import write_simulation

        out = self.out.with_name(f"{self.out.name}_simulation")
        recipe = {"scene": self.options.recipe()["scene"], "base": self.base, "artsim_version": version("artsim")}
        for seed in track("simulations", range(self.seed, self.seed + self.scenes), unit="scene"):
            scene = make_scene(self.options.scene, seed)
            written = write_simulation(scene.instances, out / f"{seed:06d}", self.base, {**recipe, "seed": seed})
            if written.blocked:
                log.warning(f"{written.folder}: {len(written.blocked)} joints would meet another object somewhere: "
                            f"{', '.join(written.blocked[:6])}")  # fmt: skip
        log.info(f"wrote {out}")
