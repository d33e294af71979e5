"""One view of one object as each depth sensor reports it, and how far noise lies from its formula."""

import sys
from pathlib import Path

import matplotlib
import numpy as np

import artsim
from artsim import SENSORS, Sensor

matplotlib.use("Agg")
import matplotlib.pyplot as plt

DEPTHS = (0.6, 1.0, 1.5, 2.5, 4.0)


def measured_sigma(sensor: Sensor, depth: float) -> float:
    """Standard deviation in metres of readings of a wall that almost faces the camera."""
    camera = artsim.Camera.look_at((0, 0, 0), (1, 0, 0), 200, 200, fov_y=2 * np.arctan(100 / sensor.focal))
    lean = np.tan(np.deg2rad(5.0)) * camera.directions(np.arange(200 * 200)) @ (0.9, 0.4, 0.0)
    wall = (depth / (1.0 - lean)).reshape(200, 200).astype(np.float32)
    return float(np.std([sensor.read_image(wall, camera, key) - wall for key in range(3)]))


def main(out: Path) -> None:
    obj = artsim.make("microwave", seed=1).with_diagonal(1.2)
    open_wide = np.where(np.isfinite(obj.tree.limits[:, 1]), 0.6 * obj.tree.limits[:, 1], 0.0)
    camera = artsim.Camera.look_at((-1.9, 1.1, 1.1), (0.0, 0.0, 0.0))
    true = artsim.render(obj, open_wide, camera)
    seen = true.depth > 0
    near, far = np.percentile(true.depth[seen], [1, 99])
    crop = np.s_[slice(*np.flatnonzero(seen.any(1))[[0, -1]]), slice(*np.flatnonzero(seen.any(0))[[0, -1]])]

    figure, axes = plt.subplots(2, len(SENSORS), figsize=(3.2 * len(SENSORS), 5.4), layout="constrained")
    for column, sensor in enumerate(SENSORS.values()):
        depth = sensor.read_image(true.depth, camera, key=0)
        error = np.where(seen & (depth > 0), 1e3 * (depth - true.depth), np.nan)
        axes[0, column].imshow(np.where(depth > 0, depth, np.nan)[crop], cmap="viridis", vmin=near, vmax=far)
        axes[0, column].set_title(sensor.name)
        shown = axes[1, column].imshow(error[crop], cmap="coolwarm", vmin=-15, vmax=15)
    figure.colorbar(shown, ax=axes, label="error, mm")
    for axis in axes.ravel():
        axis.set(xticks=[], yticks=[])
    out.mkdir(parents=True, exist_ok=True)
    figure.savefig(out / "sensors.png", dpi=80)

    print("standard deviation on a wall in mm, measured / by the formula")
    print(f"{'':13s}" + "".join(f"{depth:>15.1f} m" for depth in DEPTHS))
    for sensor in SENSORS.values():
        pairs = [(1e3 * measured_sigma(sensor, z), 1e3 * float(sensor.sigma(z, np.deg2rad(5.0)))) for z in DEPTHS]
        print(f"{sensor.name:13s}" + "".join(f"{m:>8.2f} / {f:<6.2f}" for m, f in pairs))
    print(f"wrote {out / 'sensors.png'}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/sensors"))
