"""From objects, made and loaded, to labelled partial clouds, and on to an estimator of poses: all in one page."""

import os
import sys
from pathlib import Path

import artsim
from artperl.training.options import PRESETS
from artperl.training.run import Training
from artsim import CATEGORIES, SampleOptions, family_sources, find_sources, verify
from artsim.drawing import draw_gallery, write_contact_sheet

ASSETS = Path(__file__).resolve().parents[2] / "urdf_assets"


def main(out: Path) -> None:
    # 1. Objects: procedural ones, a few URDF folders, and real ones where there are any.
    out.mkdir(parents=True, exist_ok=True)
    (out / "gallery.png").write_bytes(draw_gallery([artsim.make(category) for category in sorted(CATEGORIES)]))
    objects = [ASSETS / name for name in ("laptop", "cabinet", "eyeglasses", "dishwasher", "scissors")]
    if "ARTSIM_PARTNET_DIR" in os.environ:
        objects.append(Path(os.environ["ARTSIM_PARTNET_DIR"]))

    # 2. Samples: random joint states and views, 2,048 points each, with full ground truth.
    sources = [*find_sources(objects), *family_sources(sorted(CATEGORIES), 2)]
    made = artsim.generate(
        sources, out / "dataset", num_samples=500, sample=SampleOptions(num_points=2048), splits=(1, 0, 0)
    )

    # 3. Checks: checksums, and what must hold of every sample.
    problems = verify(made.folder)
    if problems:
        sys.exit("\n".join(map(str, problems)))

    # 4. Use: random access, or a stream of fresh samples for training.
    dataset = artsim.open_dataset(made.folder)
    sample = dataset[0]
    print(f"{len(dataset)} samples of {len(dataset.plan.objects)} objects; the first shows a {sample.category}:")
    for k, name in enumerate(sample.part_names):
        print(f"  {name}: {(sample.part == k).sum()} points, {100 * sample.visible_fraction[k]:.0f} % visible")

    # 5. Pictures.
    sheet, recording = write_contact_sheet(made.folder, rerun=made.folder / "recording.rrd")

    # 6. ArtPERL: learn the poses of a laptop's parts from fresh objects, and test on unseen ones.
    training = Training(PRESETS["quick"], out / "training")
    print("\nlearning the poses of a laptop's parts, a few minutes ...", flush=True)
    training.run()
    print((training.out / "table.txt").read_text())

    print(f"look at   {out / 'gallery.png'}: every procedural category in three joint states")
    print(f"and at    {sheet}: samples with their ground truth\nor with   rerun {recording}")
    print(f"and at    {training.out / 'overlays.png'}: estimated and true parts of unseen laptops")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/demo"))
