"""Where errors come from: ``python -m benchmarks.errors``.

Moving parts of unseen procedural objects, validation seeds, or of real ones, by how many of a cloud's points show them
and by how far from rest they are, in % of their joint's range: how many of these points have their label, rotation, IoU
of posed boxes, and what that would be if one thing were known: where the box's faces are along each axis of the rest
frame (x to the back, y to the side, z up). Last, IoU at rest, and the same if the root's box were known; and the root's
rotation, with and without the objects that it is worst for, and how far its faces are off. Errors against points are
drawn as a picture. The last line is one JSON object.
"""

import json
import os
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
import tyro
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from artperl.core.clock import Clock
from artperl.core.clouds import Clouds
from artperl.core.estimate import Estimate
from artperl.data.categories import ARTIMAGE, objects_of
from artperl.evaluation import box_overlap, metrics
from artperl.evaluation.artimage import real_objects
from artperl.evaluation.benchmark import find_estimator
from artperl.evaluation.metrics import rest_centers, true_poses
from artperl.evaluation.pictures import overlays
from artperl.evaluation.samples import NUM_POINTS, VALIDATION_SEEDS, samples_of
from artperl.methods.full import Estimator
from artperl.perception.network import Perceived, Votes
from artsim.common.files import atomic_file, write_atomic
from artsim.common.progress import track
from artsim.errors import ConfigError
from artsim.model.objects import ArticulatedObject
from artsim.observing.sample import Sample

Array = NDArray[np.float64]
BINS = {"points": (0, 80, 400, 1200, NUM_POINTS + 1), "percent moved": (0, 10, 30, 101)}
"""Lower ends, and what lies above the last, of what moving parts are told apart by."""
_SURE = 12.0  # the odds of a label that was told, as a logarithm
SHOWN = 4
"""Views in the picture of the worst."""
_LEAST = 0.1
"""Degrees that smaller errors of rotation are drawn at."""
FACES = ("-x", "-y", "-z", "+x", "+y", "+z")


@dataclass(frozen=True)
class Options:
    """Which parts are off, and in what."""

    weights: Path | None = None
    """Folder of estimators (or of training runs) by category; by default those that come with the package."""
    categories: tuple[str, ...] = tuple(ARTIMAGE)
    objects: int = 40
    """Procedural ones of each category."""
    views: int = 2
    """Of each object."""
    real: bool = False
    """Real objects of the test half of ``ARTSIM_PARTNET_DIR`` instead of procedural ones."""
    true_labels: bool = False
    """Tell the estimator which part each point is of: what is off even so is not for want of labels."""
    picture: Path | None = None
    """Draw errors against points here (.png)."""
    worst: Path | None = None
    """Draw the views whose moving parts have the lowest IoU here (.png): of one category, without true labels."""


@dataclass(kw_only=True)
class Told(Estimator):
    """An estimator that is told the true part of each point of one sample."""

    sample: Sample

    def perceive(self, clouds: Clouds, clock: Clock) -> tuple[Perceived | Votes, Array]:
        """What is perceived, but for the parts."""
        perceived, own = super().perceive(clouds, clock)
        assert isinstance(perceived, Perceived), "categories have named parts"
        metres = (clouds.points[0] * clouds.scale + clouds.center).cpu().numpy()
        part = torch.from_numpy(self.sample.part[cKDTree(self.sample.points).query(metres)[1]].astype(np.int64))
        true = torch.nn.functional.one_hot(part, perceived.part_logits.shape[-1]).to(perceived.part_logits)
        return replace(perceived, part_logits=_SURE * true[None]), own


def main(options: Options) -> None:
    """Measure and print.

    Raises
    ------
    ConfigError
        When one picture is to show several categories, or what is seen with true labels.
    """
    if options.worst is not None and (len(options.categories) > 1 or options.true_labels):
        raise ConfigError("it shows one category, as it is perceived", "worst", "name one --categories, no true labels")
    result: dict[str, dict[str, Any]] = {}
    every: dict[str, dict[str, Array]] = {}
    for category in options.categories:
        estimator, objects = find_estimator(options.weights, category), objects_to_test(category, options)
        rows, roots, faces, fit = [], [], [], []
        samples = samples_of(objects, options.views, None, VALIDATION_SEEDS)
        for sample in track(category, samples, unit="view", leave=False):
            asked = Told(**vars(estimator), sample=sample) if options.true_labels else estimator
            estimate = asked(sample.points)
            own = moving_parts(estimate, sample) if len(estimate.size) == len(sample.box_size) else []
            fit.append(float(np.mean([row["posed"] for row in own])) if own else 0.0)
            if own:
                rows += own
                roots.append(metrics.rotation_error(estimate.rotation[0], true_poses(sample)[0][0]))
                faces.append(root_faces(estimate, sample))
            else:
                roots.append(np.array(metrics.METRICS["rotation_deg"].failed))
        if not rows:
            print(f"{category}: no object with the parts of ArtImage, or no estimate with as many")
            continue
        every[category] = table = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        result[category] = {"all": figures(table), **{by: in_bins(table, by) for by in BINS}}
        print_figures(category, result[category])
        if options.worst is not None:
            write_atomic(options.worst, overlays(estimator, [samples[n] for n in np.argsort(fit)[:SHOWN]]))
        result[category]["root"] = root_figures(np.reshape(roots, (len(objects), options.views)), np.array(faces))
    print("labelled: % of the part's points; mean rotation in degrees; IoU in %, if what the column says were known")
    if options.picture is not None and every:
        draw(every, options.picture)
    print(json.dumps(result))


def objects_to_test(category: str, options: Options) -> list[ArticulatedObject]:
    """Objects of one category, always the same ones."""
    if not options.real:
        return objects_of([category], options.objects, VALIDATION_SEEDS)
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    return real_objects(category, "test", Path(folder) if folder else None)


def figures(table: dict[str, Array]) -> dict[str, float]:
    """How many parts, and the mean of each figure."""
    means = {name: round(float(np.nanmean(values)), 4) for name, values in table.items() if name not in BINS}
    return {"parts": len(table["posed"]), **means}


def in_bins(table: dict[str, Array], by: str) -> dict[str, dict[str, float]]:
    """Figures of the parts in each bin that has any."""
    bins = {f"{low}-{high - 1}": (table[by] >= low) & (table[by] < high) for low, high in pairwise(BINS[by])}
    return {
        label: figures({name: values[own] for name, values in table.items()})
        for label, own in bins.items()
        if own.any()
    }


def print_figures(category: str, result: dict[str, Any]) -> None:
    """One table for each of what parts are told apart by."""
    for by in BINS:
        names = list(result["all"])
        print(f"{category}\n{by:>12s}{names[0]:>7s}" + "".join(f"{name:>11s}" for name in names[1:]))
        for label, means in [*result[by].items(), ("all", result["all"])]:
            shown = (f"{means[n]:11.2f}" if n == "rotation" else f"{100 * means[n]:11.1f}" for n in names[1:])
            print(f"{label:>12s}{means['parts']:7d}" + "".join(shown), flush=True)


def root_figures(rotation: Array, faces: Array) -> dict[str, Any]:
    """Print and return how far roots are off: rotation (objects, views), degrees, faces (N, 6), % of diagonals."""
    by_object = np.sort(rotation.mean(1))
    best = by_object[: max(1, len(by_object) * 9 // 10)]
    print(f"root: rotation {by_object.mean():.2f}, without the tenth of objects it is worst for {best.mean():.2f}")
    off = dict(zip(FACES, np.quantile(faces, [0.5, 0.9], axis=0).T.round(2).tolist(), strict=True))
    shown = ", ".join(f"{face} {median:.1f} {most:.1f}" for face, (median, most) in off.items())
    print(f"root: faces off by, % of the diagonal, median and nine tenths: {shown}")
    return {"rotation": round(by_object.mean(), 4), "best nine tenths": round(best.mean(), 4), "faces": off}


def moving_parts(estimate: Estimate, sample: Sample) -> list[dict[str, float]]:
    """Figures of each moving part."""
    rotation, center = true_poses(sample)
    off = metrics.rotation_error(estimate.rotation, rotation)
    posed = box_overlap.iou_exact(
        estimate.rotation, estimate.translation, estimate.size, rotation, center, sample.box_size
    )
    known = known_axes(estimate, sample)
    rest, rooted = at_rest(estimate, sample), at_rest(estimate, sample, root_known=True)
    points = np.bincount(sample.part, minlength=len(off))
    labelled = np.bincount(sample.part, estimate.part == sample.part, len(off)) / np.where(points > 0, points, np.nan)
    low, high = sample.joint_limits.T
    share = np.abs(sample.joint_state - sample.joint_rest) / np.where(high > low, high - low, np.inf)
    return [
        {
            "points": points[k], "percent moved": 100 * share[k], "labelled": labelled[k], "rotation": off[k],
            "posed": posed[k], "x known": known[0][k], "y known": known[1][k], "z known": known[2][k],
            "rest": rest[k], "root known": rooted[k],
        }
        for k in range(1, len(off))
    ]  # fmt: skip


def root_faces(estimate: Estimate, sample: Sample) -> Array:
    """(6,) how far the faces of the root's box are off, in % of the diagonal: :data:`FACES`."""
    rotation, center = true_poses(sample)
    apart = rotation[0].T @ (estimate.translation[0] - center[0])
    half = 0.5 * (estimate.size[0] - sample.box_size[0])
    off: Array = 100.0 * np.abs(np.concatenate([apart - half, apart + half])) / sample.diagonal
    return off


def known_axes(estimate: Estimate, sample: Sample) -> list[Array]:
    """(3, K) IoU of posed boxes, in the true parts' frames, if both faces along an axis were known."""
    rotation, center = true_poses(sample)
    apart = np.einsum("kji,kj->ki", rotation, estimate.translation - center)
    result = []
    for axis in range(3):
        offset, size = apart.copy(), estimate.size.copy()
        offset[:, axis], size[:, axis] = 0.0, sample.box_size[:, axis]
        result.append(box_overlap.iou_rest_exact(offset, size, np.zeros_like(offset), sample.box_size))
    return result


def at_rest(estimate: Estimate, sample: Sample, root_known: bool = False) -> Array:
    """(K,) IoU in the rest frame, whose origin is the middle of all boxes."""
    center, size = estimate.translation.copy(), estimate.size.copy()
    if root_known:
        center[0], size[0] = true_poses(sample)[1][0], sample.box_size[0]
    rest_center = rest_centers(center, size, estimate.T_camera_part)
    return box_overlap.iou_rest_exact(rest_center, size, sample.box_center, sample.box_size)


def draw(every: dict[str, dict[str, Array]], path: Path) -> None:
    """Rotation and IoU of moving parts against the points that show them."""
    figure = Figure(figsize=(3.2 * len(every), 6.0))
    FigureCanvasAgg(figure)
    for n, (category, table) in enumerate(every.items()):
        for row, (column, label) in enumerate((("rotation", "rotation, deg"), ("posed", "IoU of posed boxes"))):
            axes = figure.add_subplot(2, len(every), row * len(every) + n + 1)
            shown = np.maximum(table[column], _LEAST) if row == 0 else table[column]
            axes.scatter(np.maximum(table["points"], 1), shown, s=6, alpha=0.5)
            axes.set(xscale="log", xlim=(0.6, 2 * NUM_POINTS), xlabel=f"points of {NUM_POINTS:,}")
            axes.set(xticks=(1, 10, 100, 1000), xticklabels=("≤1", "10", "100", "1,000"))
            axes.set(title=category if row == 0 else "", ylabel=label if n == 0 else "")
            if row == 0:
                axes.set(yscale="log", ylim=(0.7 * _LEAST, 250))
                axes.set(yticks=(_LEAST, 1, 10, 100), yticklabels=(f"≤{_LEAST}", "1", "10", "100"))
            else:
                axes.set(ylim=(-0.05, 1.05))
            axes.grid(alpha=0.3)
    figure.tight_layout()
    with atomic_file(path) as file:
        figure.savefig(file, format="png", dpi=80)


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
