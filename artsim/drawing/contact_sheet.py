"""Contact sheets: what samples and objects look like, with their ground truth drawn in."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from artsim.common.extras import require_extra
from artsim.common.names import printable, safe_name
from artsim.common.outputs import check_output, write_output
from artsim.common.palette import PALETTE
from artsim.common.progress import track
from artsim.datasets.dataset import Dataset
from artsim.errors import ArtsimError, AssetError
from artsim.loading.urdf import load
from artsim.model.draws import StateOptions, ViewOptions, joint_intervals, sample_state, sample_view
from artsim.model.frame import BACKGROUND
from artsim.model.objects import ArticulatedObject
from artsim.observing.annotation import BOX_EDGES, Shown, axis_segment, box_corners, shade_parts
from artsim.observing.capture import frame_of, observe
from artsim.observing.sample import Sample

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SAMPLES_PER_ROW = 2
_STATES = 4  # in the title of a sample


def write_contact_sheet(
    path: Path,
    out: Path | None = None,
    samples: int = 12,
    split: str | None = None,
    rerun: Path | None = None,
    package_roots: Mapping[str, Path] | None = None,
    body: str | None = None,
) -> list[Path]:
    """Draw a dataset or an object; see :class:`artsim.commands.view.View`.

    Returns
    -------
    list of Path
        The files written.
    """
    opened = open_shown(path, split, package_roots, body)
    if isinstance(opened, Dataset):
        chosen = spread(len(opened), samples)
        shown = [show_sample(sample, opened.object_of(sample)) for sample in (opened[i] for i in chosen)]
        out = out or path / "contact_sheet.png"
    else:
        shown = list(show_states(opened, samples))
        out = out or Path(f"{safe_name(f'{opened.category}-{opened.object_id}')}.png")
    if not shown:
        raise ArtsimError("there is no sample to draw", path, "choose another split, or ask for at least one")
    write_output(out, contact_sheet(shown), [path])
    written = [out]
    if rerun is not None:
        from artsim.drawing.rerun_recording import write_recording

        check_output(rerun, [path])
        write_recording(shown, rerun)
        written.append(rerun)
    return written


def open_shown(
    path: Path, split: str | None = None, package_roots: Mapping[str, Path] | None = None, body: str | None = None
) -> Dataset | ArticulatedObject:
    """What is looked at: the dataset of a folder, or an object; see :func:`artsim.loading.urdf.load`.

    Raises
    ------
    ArtsimError
        When it is neither.
    """
    if (path / "dataset.json").is_file() or (path / "plan.json").is_file():
        return Dataset(path, split)
    try:
        return load(path, package_roots=package_roots, body=body)
    except AssetError as error:
        if path.is_file() or error.where != str(path):  # an object that is there is at fault
            raise
        raise AssetError(error.what, path, f"{error.fix}; or the folder of a dataset") from error


def spread(total: int, count: int) -> list[int]:
    """About ``count`` different indices below ``total``, evenly spread but off any regular rotation of objects."""
    count = min(max(count, 0), total)
    order = np.random.default_rng(0).permutation(total) if total else np.zeros(0, int)
    return sorted(order[:count].tolist())


def show_sample(sample: Sample, obj: ArticulatedObject) -> Shown:
    """A stored sample with its frame."""
    return Shown(sample, frame_of(sample, obj), _title(sample, f"sample {sample.index}"))


def show_states(obj: ArticulatedObject, count: int) -> Iterator[Shown]:
    """An object at rest, at both ends of its joints, and in random states."""
    rng = np.random.default_rng(0)
    low, high = joint_intervals(obj).T
    named = [("at rest", obj.tree.rest), ("lower limits", low), ("upper limits", high)][:count]
    named += [("random", sample_state(obj, StateOptions(), rng)) for _ in range(count - len(named))]
    options = ViewOptions(azimuth=(30.0, 30.0), elevation=(25.0, 25.0), fill=(0.95, 0.95))
    for name, state in named:
        q = obj.tree.complete_state(state)
        camera = sample_view(obj, q, options, rng)
        sample = observe(obj, q, camera, rng=rng)
        yield Shown(sample, frame_of(sample, obj), _title(sample, name))


def _title(sample: Sample, what: str) -> str:
    return f"{printable(sample.category, 40)} {printable(sample.object_id, 40)}   {what}\n{state_text(sample)}"


def state_text(sample: Sample) -> str:
    """Joint states in words: ``lid 73 deg, drawer 12 cm``."""
    texts = []
    for k in range(1, len(sample.joint_type)):
        value = sample.joint_state[k] - sample.joint_rest[k]
        text = f"{100 * value:.1f} cm" if sample.joint_type[k] == "prismatic" else f"{np.rad2deg(value):.0f}°"
        texts.append(f"{printable(sample.part_names[k], 40)} {text}")
    more = f", and {len(texts) - _STATES} more" if len(texts) > _STATES else ""
    return ", ".join(texts[:_STATES]) + more or "rigid"


def contact_sheet(shown: Sequence[Shown]) -> bytes:
    """PNG with, for each sample: depth; parts with boxes and joint axes; the cloud from another side."""
    with require_extra("contact sheets"):
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    rows = -(-len(shown) // _SAMPLES_PER_ROW)
    columns = min(len(shown), _SAMPLES_PER_ROW)
    figure = Figure(figsize=(9.6 * columns, 2.75 * rows), dpi=100, facecolor="white")
    FigureCanvasAgg(figure)
    blocks = figure.add_gridspec(
        rows, columns, wspace=0.03, hspace=0.24, left=0.006, right=0.994, top=1 - 0.42 / (2.75 * rows), bottom=0.004
    )
    for number, one in enumerate(track("pictures", shown, unit="row", leave=False)):
        block = blocks[number // columns, number % columns].subgridspec(1, 3, wspace=0.02)
        axes = [figure.add_subplot(block[0, i]) for i in range(3)]
        draw_depth(axes[0], one)
        draw_parts(axes[1], one)
        draw_cloud(axes[2], one)
        # Names are names: a dollar sign in one must not begin a formula.
        axes[0].set_title(one.title, fontsize=9, loc="left", linespacing=1.3, pad=3, parse_math=False)
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png")
    return buffer.getvalue()


def draw_depth(axes: Axes, shown: Shown) -> None:
    """The depth image, near bright, cropped to the object."""
    depth = np.ma.masked_equal(shown.frame.depth, 0.0)
    axes.imshow(depth, cmap="viridis_r", interpolation="nearest")
    axes.set_facecolor("#f2f2f2")
    _crop(axes, shown)


def draw_parts(axes: Axes, shown: Shown) -> None:
    """Shaded parts, each with its box, and the joint axes: solid for turning, dashed for sliding."""
    axes.imshow(shade_parts(shown.frame, shown.camera), interpolation="nearest")
    sample = shown.sample
    for k in range(len(sample.joint_type)):
        colour = PALETTE[k % len(PALETTE)] / 255
        corners = box_corners(sample, k)
        if (corners[:, 2] > 1e-3).all():
            image = shown.camera.project(corners) - 0.5
            for a, b in BOX_EDGES:
                axes.plot(*image[[a, b]].T, color=0.75 * colour, linewidth=0.8, alpha=0.9)
    for k in range(1, len(sample.joint_type)):
        start, end = axis_segment(sample, k)
        if min(start[2], end[2]) > 1e-3:
            (u0, v0), (u1, v1) = shown.camera.project(np.stack([start, end])) - 0.5
            style = "--" if sample.joint_type[k] == "prismatic" else "-"
            arrow: dict[str, Any] = {"arrowstyle": "-|>", "color": "#c00020", "linewidth": 1.3, "linestyle": style}
            axes.annotate("", (u1, v1), (u0, v0), arrowprops=arrow | {"shrinkA": 0, "shrinkB": 0})
    _crop(axes, shown)


def draw_cloud(axes: Axes, shown: Shown) -> None:
    """The cloud, coloured by part, from 60 degrees to the side: what the camera did not see stays empty."""
    sample = shown.sample
    points = sample.points - sample.points.mean(axis=0)
    c, s = np.cos(np.deg2rad(60)), np.sin(np.deg2rad(60))
    turned = points @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]).T
    order = np.argsort(-turned[:, 2])
    colours = PALETTE[sample.part[order] % len(PALETTE)] / 255
    axes.scatter(turned[order, 0], turned[order, 1], s=1.6, c=colours, linewidths=0)
    axes.set_aspect("equal", adjustable="datalim")
    axes.invert_yaxis()
    _bare(axes)


def _crop(axes: Axes, shown: Shown) -> None:
    """Limit an image to the object, with a margin, in the shape of a 4:3 window."""
    rows, columns = np.nonzero(shown.frame.part_ids != BACKGROUND)
    if len(rows):
        center = 0.5 * np.array([columns.min() + columns.max(), rows.min() + rows.max()])
        half_height = 1.25 * max(np.ptp(rows) / 2, 0.75 * np.ptp(columns) / 2, 8.0)
        axes.set_xlim(center[0] - half_height / 0.75, center[0] + half_height / 0.75)
        axes.set_ylim(center[1] + half_height, center[1] - half_height)
    _bare(axes)


def _bare(axes: Axes) -> None:
    axes.set_xticks([])
    axes.set_yticks([])
    for spine in axes.spines.values():
        spine.set_visible(False)
