"""An estimate as text: one line of the whole, one for each part, one for each warning."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

if TYPE_CHECKING:
    from artperl.core.estimate import Estimate

HEAD = ("part", "joint", "state", "limits", "box centre, m", "rotation vector, deg", "box size, m", "seen", "sure")
_MOST_PARTS = 40
"""Parts that are listed: as many as fit a screen."""


def full_text(estimate: Estimate) -> str:
    """What it found, for a terminal."""
    rows = [HEAD, *cells(estimate)[:_MOST_PARTS]]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    more = len(estimate.joint_type) - _MOST_PARTS
    lines += [f"... and {more} parts more"] if more > 0 else []
    return "\n".join([summary(estimate), *lines, *(f"warning: {text}" for text in estimate.warnings)])


def summary(estimate: Estimate) -> str:
    """One line: how sure it is, how well it fits, and by which reference."""
    reference = f"reference {estimate.reference}, " if estimate.reference else ""  # some methods have none
    other = f"{100 * estimate.foreign:.0f} % of the points left out, " if estimate.foreign >= 0.005 else ""
    return (
        f"confidence {100 * estimate.confidence:.0f} %, residual {100 * estimate.residual:.2f} % of the diagonal, "
        f"{other}{reference}{sum(estimate.milliseconds.values()):.0f} ms"
    )


def short_text(estimate: Estimate) -> str:
    """The least that tells it from others, as in a list of estimates."""
    states = [f"{name} {state}".strip() for name, _, state, *_ in cells(estimate)[:8]]
    states += ["..."] if len(estimate.joint_type) > 8 else []
    warnings = f", {len(estimate.warnings)} warnings" if estimate.warnings else ""
    sure = f"confidence {100 * estimate.confidence:.0f} %"
    return f"<Estimate of {estimate.reference}: {', '.join(states)}; {sure}{warnings}>"


def cells(estimate: Estimate) -> list[tuple[str, ...]]:
    """What `HEAD` names, of each part."""
    rows: list[tuple[str, ...]] = []
    for k, kind in enumerate(estimate.joint_type):
        turn = Rotation.from_matrix(estimate.rotation[k]).as_rotvec(degrees=True)
        low, high = estimate.joint_limits[k] if k < len(estimate.joint_limits) else (np.nan, np.nan)
        rows.append((
            estimate.part_names[k] if k < len(estimate.part_names) else f"{k}", kind,
            "" if kind in ("free", "fixed") else _amount(kind, estimate.state[k]),
            "" if kind in ("free", "fixed") or not np.isfinite([low, high]).all()
            else f"{_amount(kind, low)} to {_amount(kind, high)}",
            " ".join(f"{x:.3f}" for x in estimate.translation[k]),
            " ".join(f"{x:.1f}" for x in turn), " x ".join(f"{x:.3f}" for x in estimate.size[k]),
            f"{100 * estimate.visibility[k]:.0f} %",
            f"{100 * estimate.part_confidence[k]:.0f} %" if k < len(estimate.part_confidence) else "",
        ))  # fmt: skip
    return rows


def _amount(kind: str, state: float) -> str:
    """A joint's state with its unit: centimetres of a slide, degrees of what turns."""
    return f"{100 * state:.1f} cm" if kind == "prismatic" else f"{np.rad2deg(state):.1f}°"
