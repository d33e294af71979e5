"""The verb ``artperl demo``: from objects, made and loaded, to labelled clouds and an estimator, on one page."""

import logging
import os
import sys
from dataclasses import dataclass
from pathlib import Path

import artsim
from artsim.common.extras import require_extra

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Demo:
    """Draw all categories, generate and verify 500 samples, train a small estimator: two minutes on two cores.

    ARTSIM_PARTNET_DIR names an unpacked PartNet-Mobility folder that adds real objects.
    """

    out: Path = Path("out/demo")
    """Folder of all that it makes."""

    def run(self) -> None:
        with require_extra("demo", extra="view,train"):
            import matplotlib  # noqa: F401  # before minutes of work, not after them

            from artperl.training.options import PRESETS
            from artperl.training.run import Training
        from artsim.drawing import draw_gallery, write_contact_sheet
        from artsim.export import export

        # 1. Objects: procedural ones, one of them by its URDF file, and real ones where there are any.
        self.out.mkdir(parents=True, exist_ok=True)
        pictures = draw_gallery([artsim.make(category) for category in sorted(artsim.CATEGORIES)])
        (self.out / "gallery.png").write_bytes(pictures)
        export(artsim.make("storage_furniture", seed=7), self.out / "cabinet")
        files = [self.out / "cabinet"]
        if "ARTSIM_PARTNET_DIR" in os.environ:
            files.append(Path(os.environ["ARTSIM_PARTNET_DIR"]))

        # 2. Samples: random joint states and views, 2,048 points each, with full ground truth.
        found, drawn = artsim.find_sources(files), artsim.family_sources(sorted(artsim.CATEGORIES), 2)
        sample, folder = artsim.SampleOptions(num_points=2048), self.out / "dataset"
        artsim.generate([*found, *drawn], folder, num_samples=500, sample=sample, splits=(1, 0, 0))

        # 3. Checks: checksums, and what must hold of every sample.
        problems = artsim.verify(folder)
        if problems:
            sys.exit("\n".join(map(str, problems)))

        # 4. Use: random access, or a stream of fresh samples for training.
        dataset = artsim.open_dataset(folder)
        first = dataset[0]
        print(f"{len(dataset)} samples of {len(dataset.plan.objects)} objects; the first shows a {first.category}:")
        for k, name in enumerate(first.part_names):
            print(f"  {name}: {(first.part == k).sum()} points, {100 * first.visible_fraction[k]:.0f} % visible")

        # 5. Pictures.
        sheet, recording = write_contact_sheet(folder, rerun=folder / "recording.rrd")

        # 6. ArtPERL: learn the poses of a laptop's parts from fresh objects, and test on unseen ones.
        training = Training(PRESETS["quick"], self.out / "training")
        log.info("learning the poses of a laptop's parts, a few minutes ...")
        training.run()
        print((training.out / "table.txt").read_text())

        print(f"look at   {self.out / 'gallery.png'}: every procedural category in three joint states")
        print(f"and at    {sheet}: samples with their ground truth\nor with   rerun {recording}")
        print(f"and at    {training.out / 'overlays.png'}: estimated and true parts of unseen laptops")
