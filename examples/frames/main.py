"""Draw what a pose means: the rest frame, the rest frame as each part carries it, and the box of each part."""

import sys
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import artsim
from artsim.common.palette import PALETTE
from artsim.observing.annotation import BOX_EDGES, axis_segment, box_corners, shade_parts
from artsim.observing.capture import frame_of

AXES = (("X", "#d62728"), ("Y", "#2ca02c"), ("Z", "#1f77b4"))
LINE = {"linewidth": 2.5, "solid_capstyle": "round"}


def main(out: Path) -> None:
    obj = artsim.make("laptop", seed=7)
    target = np.array([0.02, 0.0, 0.06])
    camera = artsim.Camera.look_at(eye=np.array([-0.36, -0.4, 0.36]), target=target, width=640, height=480)
    rng = np.random.default_rng(0)
    closed = artsim.observe(obj, obj.tree.rest, camera, rng=rng)
    opened = artsim.observe(obj, obj.tree.rest + [0.0, np.deg2rad(100.0)], camera, rng=rng)

    figure = Figure(figsize=(15, 4.1), dpi=100, layout="constrained")
    rest, posed, boxes = figure.subplots(1, 3)
    for axes, sample, title in (
        (rest, closed, "1. At rest, all parts share one frame"),
        (posed, opened, "2. Each part carries the rest frame along"),
        (boxes, opened, "3. 9D pose: rotation, box centre, box size"),
    ):
        axes.imshow((0.45 * shade_parts(frame_of(sample, obj), camera) + 0.55 * 255).astype(np.uint8))
        axes.set_title(title, fontsize=14)
        axes.axis("off")
    draw_frame(rest, closed, 0, "rest frame")
    for k, name in enumerate(opened.part_names):
        draw_frame(posed, opened, k, f"T_camera_part[{k}]: {name}")
    draw_line(posed, camera, np.stack(axis_segment(opened, 1)), color="black", linestyle="--", **LINE)
    for k in range(len(opened.part_names)):
        corners = box_corners(opened, k)
        for edge in BOX_EDGES:
            draw_line(boxes, camera, corners[list(edge)], color=PALETTE[k] / 255, linewidth=2)
        draw_frame(boxes, opened, k, "", corners.mean(axis=0))
    figure.savefig(out)
    print(f"wrote {out}")


def draw_frame(axes: Axes, sample: artsim.Sample, k: int, label: str, origin: np.ndarray | None = None) -> None:
    """Arrows of part k's frame, from its origin or from another point of the camera frame."""
    camera = artsim.Camera(sample.K, sample.width, sample.height, sample.T_world_camera)
    T = sample.T_camera_part[k]
    start = T[:3, 3] if origin is None else origin
    for column, (name, colour) in enumerate(AXES):
        end = start + 0.22 * sample.diagonal * T[:3, column]
        draw_line(axes, camera, np.stack([start, end]), color=colour, **LINE)
        axes.text(*pixels(camera, end[None])[0], name, color=colour, fontsize=12, weight="bold")
    column, row = pixels(camera, start[None])[0]
    axes.text(column, row + (-60 if k else 32), label, fontsize=12, ha="center", va="center", family="monospace")


def draw_line(axes: Axes, camera: artsim.Camera, points: np.ndarray, **style: object) -> None:
    axes.plot(*pixels(camera, points).T, **style)


def pixels(camera: artsim.Camera, points: np.ndarray) -> np.ndarray:
    """(n, 2) columns and rows of points of the camera frame."""
    projected = points @ camera.K.T
    return projected[:, :2] / projected[:, 2:] - 0.5


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "docs/concepts.png"))
