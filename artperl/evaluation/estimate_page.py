"""An estimate to look at: a page for any browser with the cloud by part, boxes and joint axes, beside the truth."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from artperl.core.clouds import is_measured
from artperl.core.estimate import HEAD, Array, Estimate, cells, joint_cells, points_at_rest, pose_cells, summary
from artperl.evaluation.metrics import rotation_error, translation_error, true_poses
from artsim.common.showing import page_of
from artsim.drawing.page import PageContent, PageFrame, PageParts, frames_page, sample_parts, world_up
from artsim.observing.annotation import segment_at
from artsim.observing.sample import Sample


@page_of.register
def page(estimate: Estimate, points: ArrayLike | None = None, title: str = "", truth: Sample | None = None) -> str:
    """HTML with everything in it: the way of the fit step by step, and what was found.

    Parameters
    ----------
    estimate : Estimate
    points : (N, 3) float, optional
        The cloud that was estimated; by default that of the truth.
    title : str, optional
    truth : Sample, optional
        What is drawn beside the estimate. Its points are coloured by error.
    """
    cloud, part, error = np.zeros((0, 3)), estimate.part[:0], None
    if points is None and truth is not None and len(truth.points) == len(estimate.part):
        points = truth.points
    if points is not None:
        cloud = np.asarray(points, dtype=np.float64)
        shown = is_measured(cloud)
        if truth is not None and len(truth.points) == len(cloud):
            error = point_errors(estimate, truth)[shown]
        cloud, part = cloud[shown], estimate.part[shown]
    T, carried = estimate.trajectory, estimate.T_camera_part
    center = points_at_rest(estimate.translation, carried)
    diagonal = float(
        np.linalg.norm((center + 0.5 * estimate.size).max(axis=0) - (center - 0.5 * estimate.size).min(axis=0))
    )
    joints = zip(estimate.joint_type, estimate.joint_axis, estimate.joint_origin, estimate.translation, strict=True)
    arrows = [(k, *segment_at(*joint, diagonal)) for k, joint in enumerate(joints) if joint[0] not in ("free", "fixed")]
    found = PageParts(carried, center, estimate.size, arrows)
    beside = None if truth is None else sample_parts(truth)
    up = carried[0, :3, 2] if truth is None else world_up(truth)
    view = (beside or found).view(up, cloud[part >= 0])
    last = len(T) - 1
    steps = [PageParts(step, center, estimate.size) for step in T[:last]] + [found]
    rows = cells(estimate)
    frames = [
        PageFrame(
            "refined" if number == last else f"agent, step {number}" if number else "start",
            [row[0] for row in rows],
            estimate.joint_type,
            view,
            parts,
            beside,
            cloud,
            part,
            error,
            _table(estimate, rows, truth),
        )
        for number, parts in enumerate(steps)
    ]
    content = PageContent(
        title or f"estimate of {estimate.reference}",
        [summary(estimate)],
        estimate.warnings,
        "Step of the fit",
        last,
        error_word="error at rest",
    )
    return frames_page(content, frames)


def point_errors(estimate: Estimate, truth: Sample) -> Array:
    """(N,) how far apart estimate and truth place each point in the rest frame, metres; NaN where one has no part."""
    part = estimate.part
    carried = estimate.T_camera_part[np.maximum(part, 0)]
    apart = np.linalg.norm(points_at_rest(truth.points.astype(np.float64), carried) - truth.rest_points, axis=1)
    return np.where(part >= 0, apart, np.nan)


def _table(
    estimate: Estimate, rows: Sequence[tuple[str, ...]], truth: Sample | None
) -> tuple[Sequence[str], Sequence[Sequence[Sequence[str]]]]:
    """For each part what it is called, what was estimated and, where it is known, what is true."""
    if truth is None or len(truth.joint_type) != len(rows):
        return ("", ""), [[pair for pair in zip(HEAD[1:], row[1:], strict=True) if pair[1]] for row in rows]
    rotation, center = true_poses(truth)
    turned = rotation_error(estimate.rotation, rotation)
    moved = translation_error(estimate.translation, center, truth.diagonal)
    tables = []
    for k, (_, *own) in enumerate(rows):
        kind = truth.joint_type[k]
        true = (
            kind,
            *joint_cells(kind, float(truth.joint_state[k]), truth.joint_limits[k]),
            *pose_cells(rotation[k], center[k], truth.box_size[k]),
            "",
            "",
        )
        table = [row for row in zip(HEAD[1:], own, true, strict=True) if any(row[1:])]
        off = f"{turned[k]:.1f}°, {100 * moved[k]:.1f} % of the diagonal"
        tables.append([*table, ("off by", off, "")])
    return ("", "estimate", "truth"), tables
