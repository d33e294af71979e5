"""Panels of displays: flat or bent ones, their screens towards -X."""

from dataclasses import dataclass

import numpy as np

from artsim.families.details import drawn_from
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT
from artsim.making.solids import Solid, box, frame, hull


@dataclass(frozen=True)
class Panel:
    """A flat or bent screen about the origin, its back at x = 0."""

    half: float  # of the width
    rise: float  # half of the height
    thick: float  # of the whole panel, before x = 0
    bend: float  # how far the left and right edges come forward


def draw_panel(draws: Draws, most: float = 0.95) -> Panel:
    """A panel at most so wide, metres."""
    width = draws.triangular("width", 0.22, 0.52, most, unit="m")
    formats = {"wide": (0.36, 0.48), "usual": (0.54, 0.68), "square": (0.72, 0.85)}
    ratio = drawn_from(draws, "format", formats, (0.2, 0.5, 0.3))
    thick = draws.triangular("thickness", 0.015, 0.05, 0.16, of=width, unit="m")
    bend = draws.length("bend", (0.03, 0.14), of=width) if ratio < 0.6 and draws.chance("bent", 0.4) else 0.0
    return Panel(0.5 * width, 0.5 * width * ratio, thick, bend)


def screen(draws: Draws, panel: Panel, chin: float) -> Solid:
    """The panel: a shell with a frame around the sunken screen, and a hump on its back."""
    half, rise, thick = panel.half, panel.rise, panel.thick
    rim = draws.number("rim", (0.008, 0.07)) * half + 0.002
    lip = min(0.12 * thick, 0.004)  # how far the frame stands before the screen
    # What the shell leaves of the thickness goes to the hump.
    back = -thick * (draws.number("hump", (0.0, 0.65)) * draws.pick("humped", [False, True]))
    solid = Solid()
    if panel.bend:
        edges = np.linspace(-half, half, 8)
        forward = panel.bend * np.square(edges / half)
        for k in range(7):
            corners = list(zip(edges[k : k + 2], forward[k : k + 2], strict=True))
            for x0, x1, z0, z1 in (
                (lip - thick, back, -rise, rise),
                (-thick, lip - thick + 0.0005, -rise, chin + rim - rise),
                (-thick, lip - thick + 0.0005, rise - rim, rise),
            ):
                solid += hull([(x - f, y, z) for y, f in corners for x in (x0, x1) for z in (z0, z1)])
    else:
        radius = draws.number("corner", (0.01, 0.12)) * rise
        solid += box((lip - thick, back), half, rise, fillet=radius, axis=0)
        inset = 0.3 * radius
        solid += frame((-thick, inset - half, inset - rise), (lip - thick + 0.0005, half - inset, rise - inset),
                       [rim, rim, chin + rim, rim])  # fmt: skip
    solid = solid.called("display", FRONT)
    if back < 0:
        wide, high = draws.number("hump_width", (0.25, 0.85)) * half, draws.number("hump_height", (0.3, 0.85)) * rise
        wide, inner = min(wide, 0.35 * half) if panel.bend else wide, draws.number("hump_taper", (0.5, 0.95))
        solid += hull([(x, s * wide * t, u * high * t) for x, t in ((back - 0.001, 1.0), (0.0, inner))
                       for s in (-1, 1) for u in (-1, 1)])  # fmt: skip
    return solid
