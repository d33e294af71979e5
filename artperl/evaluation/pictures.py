"""Pictures of a training run: curves like the paper's figure 5, and estimates drawn over what was seen."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from artperl.core.estimate import Estimate
from artperl.evaluation.metrics import true_poses
from artperl.evaluation.scoring import compare
from artperl.methods.protocol import Method
from artsim.common.extras import require_extra
from artsim.common.names import numbered, printable
from artsim.common.palette import PALETTE
from artsim.errors import ArtsimError
from artsim.model.camera import Camera
from artsim.observing.sample import Sample

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

_COLUMNS = 4
"""Of a sheet of overlays."""
_CORNERS = np.array([[i & 1, i & 2, i & 4] for i in range(8)], dtype=bool) - 0.5
_EDGES = [(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit]
_CURVES = (
    ("agent/reward", "reward of a step"),
    ("agent/chamfer_end", "chamfer distance at the end of an episode, radii"),
    ("agent/accuracy", "actions as the expert's"),
    ("perception/accuracy", "points with the right part"),
    ("segmentation/accuracy", "points with the right part"),
    ("retrieval/loss", "contrastive loss, equation 2"),
    ("perception/coordinates", "rest-frame coordinates off by, diagonals"),
    ("validation/score", "score on unseen objects"),
)


def curves(events: Path) -> bytes:
    """PNG of what a run wrote for TensorBoard.

    Parameters
    ----------
    events : Path
        Its folder ``events``.
    """
    with require_extra("curves"):
        from tensorboard.backend.event_processing import event_accumulator  # type: ignore[import-untyped]

    log = event_accumulator.EventAccumulator(str(events), size_guidance={"scalars": 0})
    log.Reload()
    known = [(tag, title) for tag, title in _CURVES if tag in log.Tags()["scalars"]]
    rows = max(1, -(-len(known) // 3))
    figure = _figure(13.0, 3.2 * rows)
    for number, (tag, title) in enumerate(known):
        axes = figure.add_subplot(rows, 3, number + 1)
        steps = np.array([(event.step, event.value) for event in log.Scalars(tag)])
        axes.plot(*steps.T, color="#9bbcd8", linewidth=0.7, marker="o" if len(steps) < 3 else "")
        width = max(1, len(steps) // 40)
        smooth = np.convolve(steps[:, 1], np.ones(width) / width, mode="valid")
        axes.plot(steps[width - 1 :, 0], smooth, color="#0072b2", linewidth=1.6)
        axes.set_title(title, fontsize=9)
        axes.set_xlabel("rollouts" if tag.startswith("agent") else "batches", fontsize=8)
        axes.tick_params(labelsize=8)
        axes.grid(alpha=0.25)
    figure.tight_layout()
    return _png(figure)


def overlays(estimator: Method, samples: Sequence[Sample]) -> bytes:
    """PNG of clouds with the boxes of their parts: true ones grey and dashed, estimated ones in the part's colour.

    Parameters
    ----------
    estimator : Method
    samples : sequence of Sample
    """
    rows = -(-len(samples) // _COLUMNS)
    figure = _figure(3.4 * _COLUMNS, 3.0 * rows)
    for number, sample in enumerate(samples):
        axes = figure.add_subplot(rows, _COLUMNS, number + 1)
        try:
            _overlay(axes, sample, estimator(sample.points))
        except ArtsimError as error:
            axes.set_title(str(error), fontsize=7, parse_math=False)
    figure.tight_layout()
    return _png(figure)


def _overlay(axes: Axes, sample: Sample, estimate: Estimate) -> None:
    camera = Camera(sample.K, sample.width, sample.height, np.eye(4))
    colours = PALETTE[np.where(estimate.part < 0, 7, estimate.part) % len(PALETTE)] / 255
    image = camera.project(sample.points)
    axes.scatter(image[:, 0], image[:, 1], s=1.2, c=colours, linewidths=0)
    rotation, center = true_poses(sample)
    for k in range(len(rotation)):
        _box(axes, camera, rotation[k], center[k], sample.box_size[k], color="#555555", linestyle="--", linewidth=0.7)
    for k in range(len(estimate.state)):
        colour = tuple(PALETTE[k % len(PALETTE)] / 255)
        _box(axes, camera, estimate.rotation[k], estimate.translation[k], estimate.size[k], color=colour, linewidth=1.1)
    name = printable(f"{sample.category}, object {sample.object_id}", 60)
    title = f"{name}: confidence {100 * estimate.confidence:.0f} %"
    if len(estimate.state) == len(sample.joint_type):
        error = compare(estimate, sample, 0.0)
        told = [
            f"{printable(part, 16)} {turn:.1f}° {100 * shift:.1f} %"
            for part, turn, shift in zip(numbered(sample.part_names), error.rotation, error.translation, strict=True)
        ]
        title += "".join(f"\n{', '.join(told[k : k + 2])}" for k in range(0, len(told), 2))
    axes.set_title(title, fontsize=7, parse_math=False)  # a dollar sign in a name begins no formula
    axes.set_aspect("equal")
    axes.invert_yaxis()
    axes.set_axis_off()


def _box(axes: Axes, camera: Camera, rotation: Array, center: Array, size: Array, **style: Any) -> None:
    corners = (_CORNERS * size) @ rotation.T + center
    if (corners[:, 2] > 1e-3).all():
        image = camera.project(corners)
        for i, j in _EDGES:
            axes.plot(*image[[i, j]].T, **style)


def _figure(width: float, height: float) -> Figure:
    with require_extra("pictures"):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    figure = Figure(figsize=(width, height), dpi=110, facecolor="white")
    FigureCanvasAgg(figure)
    return figure


def _png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", bbox_inches="tight")
    return buffer.getvalue()
