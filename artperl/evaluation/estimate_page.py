"""An estimate to look at: a page for any browser with the cloud by part, boxes and joint axes."""

import numpy as np
from numpy.typing import ArrayLike

from artperl.core.clouds import is_measured
from artperl.core.estimate import HEAD, Estimate, cells, summary
from artsim.common.names import printable
from artsim.common.showing import page_of
from artsim.drawing.page import PageContent, PageFrame, frames_page


@page_of.register
def page(estimate: Estimate, points: ArrayLike | None = None, title: str = "") -> str:
    """HTML with everything in it: the way of the fit step by step, and what was found.

    Parameters
    ----------
    estimate : Estimate
    points : (N, 3) float, optional
        The cloud that was estimated.
    title : str, optional
    """
    cloud = part = None
    if points is not None:
        cloud = np.asarray(points, dtype=np.float64)
        shown = is_measured(cloud)
        cloud, part = cloud[shown], estimate.part[shown]
    T = estimate.trajectory
    carried = estimate.T_camera_part
    center = np.einsum("kji,kj->ki", carried[:, :3, :3], estimate.translation - carried[:, :3, 3])
    reach = 0.5 * float(np.linalg.norm(estimate.size.max(axis=0)))
    arrows = [
        (k, estimate.joint_origin[k] - reach * axis, estimate.joint_origin[k] + reach * axis)
        for k, axis in enumerate(estimate.joint_axis)
        if k > 0 and estimate.joint_type[k] != "fixed"
    ]
    last = len(T) - 1
    frames = [
        PageFrame(f"agent, step {step}" if step else "start", cloud, part, T[step], center, estimate.size)
        for step in range(last)
    ]
    frames.append(PageFrame("refined", cloud, part, T[last], center, estimate.size, arrows))
    rows = cells(estimate)
    content = PageContent(
        title or f"estimate of {estimate.reference}",
        [printable(row[0], 60) for row in rows],
        estimate.joint_type,
        notes=[summary(estimate)],
        warnings=estimate.warnings,
        frame_word="Step of the fit",
        first_frame=last,
        table=("Parts in numbers", HEAD, [[printable(cell, 80) for cell in row] for row in rows]),
    )
    return frames_page(content, frames)
