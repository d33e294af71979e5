"""A table with five articulated objects: a colour picture, and everything that is true of it."""

import sys
from pathlib import Path

from PIL import Image

from artsim.drawing import write_overview
from artsim.scenes import SceneCameraOptions, SceneOptions, make_scene, observe_scene, scene_camera

SEED = 17


def main(out: Path, samples: int = 32) -> None:
    options = SceneOptions(categories=("laptop", "stapler", "scissors", "box", "eyeglasses"))
    scene = make_scene(options, SEED)
    camera = scene_camera(scene, SceneCameraOptions(width=1280, height=720), SEED)
    (view,) = observe_scene(scene, [camera], noise="d435", seed=SEED, rgb_samples=samples)
    write_overview(view, out)

    for i, (sample, thing) in enumerate(zip(view.samples, scene.instances, strict=True)):
        if sample is None:
            print(f"{i} {thing.obj.category}: not seen")
            continue
        parts = ", ".join(
            f"{name} {100 * share:.0f} %"
            for name, share in zip(sample.part_names, sample.visible_fraction, strict=True)
        )
        print(f"{i} {sample.category}: {len(sample.points)} points; seen: {parts}")
    with Image.open(out / "rgb.png") as picture:
        print(f"wrote {out}: rgb.png of {picture.width} x {picture.height}, overview.png, masks, depth, ground truth")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/scene"), *map(int, sys.argv[2:]))
