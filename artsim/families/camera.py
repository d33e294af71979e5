"""Cameras: compact, single-lens reflex, rangefinder, instant, camcorder, and cameras on a swivel.

What varies: the kind, the body, the lens (rings that turn, one to three tubes that slide, a cap), dials and buttons, a
flash that pops up, a screen that swings out, a back or a door at the side that opens. Two to eleven parts move.
"""

from itertools import pairwise

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.lenses import Lens
from artsim.making.assembly import Assembly, JointSpec, continuous, prismatic, revolute, swivel
from artsim.making.draws import Draws
from artsim.making.outlines import FRONT, SIDE, UP, Array, about, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull_of, prism, ring, rod, tube, union

GAP = 0.0005
DENSITY = 900.0
_MEASURES = {
    "compact": ((0.084, 0.12), (1.05, 1.45), (0.35, 0.75)),
    "reflex": ((0.11, 0.16), (1.15, 1.6), (0.5, 0.95)),
    "rangefinder": ((0.11, 0.15), (1.0, 1.35), (0.4, 0.65)),
    "instant": ((0.1, 0.15), (1.3, 2.1), (0.6, 1.3)),
}
"""Width of a body, metres; its height and depth as shares of half of that."""


class Shell:
    """Half width, depth and height of a body with its front at x = 0; place and largest radius of the lens; metres."""

    def __init__(self, draws: Draws, kind: str) -> None:
        wide, tall, deep = _MEASURES[kind]
        place = list(_MEASURES).index(kind)
        draws.rng.random(place)  # the width has a draw for each kind, one of which counts
        self.half = half = 0.5 * draws.length("width", wide)
        draws.rng.random(len(_MEASURES) - 1 - place)
        self.height, self.depth = draws.length("height", tall, of=half), draws.length("depth", deep, of=half)
        radius = self.height * draws.number("lens_radius", (0.24, 0.4) if kind != "instant" else (0.18, 0.3))
        y = draws.one_of("lens_place", {"middle": 0.0, "aside": half * draws.number("lens_shift", (-0.35, 0.1))})
        self.lens_y = float(np.clip(y, -half + radius + 0.004, half - radius - 0.014))
        self.lens_z = self.height * draws.number("lens_height", (0.42, 0.52))
        self.lens_radius = min(radius, self.lens_z - 0.002)


def build(draws: Draws) -> Assembly:
    """A camera; its lens looks towards -X and is drawn in at rest, all covers are shut."""
    kinds = {"compact": 0.26, "reflex": 0.27, "rangefinder": 0.17, "instant": 0.1, "camcorder": 0.12, "swivel": 0.08}
    kind = draws.pick("kind", kinds)
    if kind == "camcorder":
        return _camcorder(draws)
    if kind == "swivel":
        return _swivel(draws)
    shell = Shell(draws, kind)
    body, top = _body(draws, shell, kind)
    styles = {"compact": ["tubes"], "instant": ["tubes", "prime"]}
    style = draws.pick("lens", styles.get(kind, ["tubes", "prime", "zoom", "zoom"]))
    lens = Lens(draws, (0.0, shell.lens_y, shell.lens_z), shell.lens_radius, style)
    camera = Assembly("body", body + lens.fixed, DENSITY)
    lens.add_to(camera)
    _add_controls(draws, camera, shell, top, kind)
    _back(draws, camera, shell)
    if kind != "compact" and top[1] - top[0] > 0.01 and draws.chance("flash", 0.5):
        _flash(draws, camera, shell, top)
    return camera


def _body(draws: Draws, shell: Shell, kind: str) -> tuple[Solid, tuple[float, float, float]]:
    """The body; the span along Y and the height of what stands on its middle, for a flash."""
    half, depth, height = shell.half, shell.depth, shell.height
    r = min(draws.number("edge_radius", (0.05, 0.45)) * depth, 0.4 * height)
    axis = draws.one_of("round_edges", {"all": None, "upright": 2, "crosswise": 1, "lengthwise": 0})
    body = box((0, depth), half, (0, height), fillet=r, axis=axis)
    if draws.chance("covering", 0.4):  # covering between two metal plates
        body += box((-0.001, depth + 0.001), half + 0.0005, (0.16 * height, 0.8 * height), fillet=r, axis=2)
    if kind in ("reflex", "compact") and draws.chance("grip", 0.85 if kind == "reflex" else 0.4):  # of the right hand
        deep = depth * draws.number("grip_depth", (0.2, 0.6) if kind == "reflex" else (0.05, 0.2))
        room = max(half - shell.lens_y - shell.lens_radius - 0.004, 0.008)
        wide = min(draws.number("grip_width", (0.25, 0.5)) * half, room)
        upright = (0.02 * height, 0.97 * height)
        grip = box((-deep, 0.6 * depth), (half - wide, half), upright, fillet=0.45 * wide, axis=2)
        body += grip.called("handle", FRONT)
    span = (0.0, 0.0, height)
    if kind == "reflex":
        wide = half * draws.number("prism_width", (0.28, 0.42))
        rise = height * draws.number("prism_height", (0.14, 0.32))
        y = float(np.clip(shell.lens_y, -half + wide, half - wide))
        low = [(y - wide, height - 0.002), (y + wide, height - 0.002)]
        left, right = draws.numbers("prism_crest", 0.4, 0.85, 2) * wide
        crest = [(y + left, height + rise), (y - right, height + rise)]
        front, back = draws.number("prism_front", (-0.15, 0.2)), draws.number("prism_back", (0.8, 1.1))
        body += prism(low + crest, front * depth, back * depth, 0)
        upright = (height - 0.2 * rise, height + 0.7 * rise)
        eyepiece = box((depth - 0.004, 1.15 * depth), about(y, 0.5 * wide), upright, fillet=0.004)
        body += eyepiece.called("glass", -FRONT)
        span = (y - 0.4 * wide, y + 0.4 * wide, height + rise)
    elif kind == "rangefinder":
        if draws.chance("raised_deck", 0.6):
            y0, y1 = sorted(draws.numbers("deck_end", -0.95, 0.95, 2) * half)
            body += box((0.05 * depth, 0.95 * depth), (y0, y1), (height - 0.003, height + 0.06 * height), fillet=0.002)
        for y, size in ((-0.75, 0.1), (0.3, 0.07)):  # windows
            window = box((-0.0012, 0.002), ((y - size) * half, (y + size) * half), (0.8 * height, 0.93 * height))
            body += window.called("glass", FRONT)
    elif kind == "instant":
        rise = height * draws.number("top_height", (0.1, 0.35))
        wide = half * draws.number("top_width", (0.3, 0.98))
        crown = box((0.4 * depth, depth), 0.9 * wide, (height + rise - 0.002, height + rise))
        body += hull_of(box((0.2 * depth, depth), wide, (height - 0.002, height)), crown)
        slot = min(0.18 * height, shell.lens_z - shell.lens_radius - 0.002)  # where pictures come out
        body += box((-0.3 * depth, 0.1 * depth), half, (0, slot), fillet=0.004)
        span = (-0.6 * wide, 0.6 * wide, height + rise)
    if kind in ("compact", "instant"):
        y = half * draws.number("window_place", (0.3, 0.7)) * draws.side("window_side")
        window = box((-0.0012, 0.003), about(y, 0.14 * half), (0.8 * height, 0.93 * height), fillet=0.002, axis=0)
        body += window.called("glass", FRONT)
    if kind in ("reflex", "rangefinder") and draws.chance("lugs", 0.4):  # for a strap
        for s in (-1.0, 1.0):
            body += ring((0.5 * depth, s * (half + 0.002), 0.85 * height), (1, 0, 0), 0.0018, 0.004, 0.0018, 12)
    return body, span


def _add_controls(draws: Draws, camera: Assembly, shell: Shell, middle: tuple[float, float, float], kind: str) -> None:
    """Shutter button and dials, on seats on the deck, beside what stands on its middle."""
    half, depth = shell.half, shell.depth
    z = shell.height * (1.06 if kind == "rangefinder" else 1.0) + GAP
    # The crest is 0.4 of the prism's foot wide, and 0.6 of an instant camera's top.
    share = {"reflex": 0.4, "instant": 0.6}.get(kind, 1.0)
    center, foot = 0.5 * (middle[0] + middle[1]), 0.5 * (middle[1] - middle[0]) / share
    least = 0.0 if kind == "instant" else 0.35 * half
    left, right = min(center - foot, -least), max(center + foot, least)

    def add(name: str, solid: Solid, joint: JointSpec, radius: float, label: str = "dial") -> None:
        at = np.asarray(joint.origin)
        camera.body += cylinder(at - (0, 0, 0.4 * depth), at - (0, 0, GAP), 1.05 * radius, sections=16)
        camera.add(name, solid, joint, label)

    size = min(0.3 * depth, 0.18 * (half - right), 0.011)
    if size > 0.0015:
        spots = np.linspace(right + 1.3 * size, half - 1.5 * size, 2 if half - right < 7.8 * size else 3).tolist()
        r = size * draws.number("shutter_radius", (0.6, 0.9))
        at = np.array([depth * draws.number("shutter_place", (0.3, 0.6)), spots.pop(), z])
        button = cylinder(at + (0, 0, 0.0016), at + (0, 0, 0.0016 + 0.5 * r), r, 0.9 * r, 18)
        add("shutter_button", button, prismatic("body", -UP, 0.0, 0.0015, at), r, "button")
        for number, y in enumerate(spots):
            if draws.chance("dial", 0.75):
                at = np.array([draws.number("dial_place", (0.4, 0.6)) * depth, y, z])
                add(f"dial_{number}", _dial(draws.within("dial"), at, size), continuous("body", UP, at), size)
    room = half + left
    if kind in ("reflex", "rangefinder") and room > 0.012 and draws.chance("knob", 0.65):
        size = min(0.3 * depth, 0.4 * room, 0.012)
        at = np.array([0.5 * depth, 0.5 * (left - half), z])
        crank = _dial(draws.within("knob"), at, size)
        if draws.chance("knob_crank", 0.4):
            low, high = at + (-0.15 * size, -0.9 * size, 0.8 * size), at + (0.15 * size, 0.9 * size, 1.2 * size)
            crank += box(low, high, fillet=0.1 * size)
        add("knob", crank, continuous("body", UP, at), size, "knob")


def _dial(draws: Draws, foot: Array, radius: float) -> Solid:
    """A flat dial, knurled by chance."""
    tall = radius * draws.number("height", (0.4, 1.1))
    solid = cylinder(foot, foot + tall * UP, radius, radius * draws.number("taper", (0.9, 1.0)), 20)
    if draws.chance("knurled", 0.5):
        for a in turns(10):
            edge = foot + (radius * cos(a), radius * sin(a), 0)
            solid += cylinder(edge + 0.1 * tall * UP, edge + 0.9 * tall * UP, 0.07 * radius, sections=4)
    if draws.chance("cap", 0.4):
        solid += cylinder(foot + 0.9 * tall * UP, foot + 1.3 * tall * UP, 0.4 * radius, sections=12)
    return solid


def _back(draws: Draws, camera: Assembly, shell: Shell) -> None:
    """A screen that swings or tilts, or buttons; and a door for the battery at the side."""
    half, depth, height = shell.half, shell.depth + 0.001, shell.height
    kind = draws.pick("back", {"plain": 0.25, "swing": 0.25, "tilt": 0.15, "door": 0.1, "bare": 0.25})
    y0, y1 = -0.92 * half, half * draws.number("screen_width", (0.2, 0.5))
    z0, z1 = height * draws.number("screen_bottom", (0.08, 0.14)), height * draws.number("screen_top", (0.68, 0.8))
    thick = draws.length("screen_thickness", (0.002, 0.006))
    x = depth + GAP
    screen = box((x, x + thick), (y0, y1), (z0, z1), fillet=0.003, axis=0)
    if kind == "swing":
        joint = revolute("body", -UP, (x + thick, y0, z0), 0.0, draws.angle("screen_angle", (1.2, 3.0)))
        camera.add("screen", screen, joint)
    elif kind == "tilt":
        upward = draws.chance("screen_tilts_up", 0.5)  # about its upper edge
        hinge = (x + thick, 0, z1 if upward else z0)
        joint = revolute("body", (0, -1 if upward else 1, 0), hinge, 0.0, draws.angle("screen_tilt", (0.5, 1.5)))
        camera.add("screen", screen, joint)
    elif kind == "door":  # the whole back of a film camera opens
        leaf = box((x, x + thick), 0.97 * half, (0.06 * height, 0.92 * height), fillet=0.002, axis=0)
        joint = revolute("body", -UP, (x + thick, -0.97 * half, 0), 0.0, draws.angle("back_angle", (1.2, 2.2)))
        camera.add("back", leaf, joint, label="door")

    def press(name: str, z: float, radius: float, tall: float) -> None:
        button = rod((x + 0.0012, x + 0.0012 + tall), y, z, radius, sections=14)
        camera.add(name, button, prismatic("body", FRONT, 0.0, 0.001, (x, y, z)))

    if kind != "door":
        y, size = 0.5 * (y1 + half), min(0.2 * (half - y1), 0.08 * height, 0.006)
        style = draws.pick("back_controls", {"pad": 0.4, "row": 0.35, "none": 0.25})
        if style == "pad" and size > 0.001:
            z = 0.4 * height
            wheel = ring((x + 0.3 * size, y, z), (1, 0, 0), 1.1 * size, 1.9 * size, 0.6 * size, 16)
            camera.add("wheel", wheel, continuous("body", (1, 0, 0), (x, y, z)), label="dial")
            press("button", z, 0.8 * size, 0.6 * size)
        elif style == "row" and size > 0.001:
            for number in range(draws.integer("back_buttons", 1, 3)):
                press(f"button_{number}", height * (0.2 + 0.2 * number), size, 0.5 * size)
    if draws.chance("side_door", 0.2):  # at the right side
        y, t = half + 0.001, 0.0025
        deep = (0.2 * shell.depth, 0.8 * shell.depth)
        door = box(deep, (y, y + t), (0.2 * height, 0.75 * height), fillet=0.002, axis=1)
        angle = draws.angle("side_door_angle", (1.0, 2.2))
        camera.add("door", door, revolute("body", -UP, (0.8 * shell.depth, y + t, 0), 0.0, angle))


def _flash(draws: Draws, camera: Assembly, shell: Shell, span: tuple[float, float, float]) -> None:
    """A flash on the crest: it lies flat and swings up about its back edge, or slides up."""
    y0, y1, z = span
    low = z + GAP
    tall = shell.height * draws.number("flash_height", (0.06, 0.2))
    x0, x1 = 0.42 * shell.depth, 0.78 * shell.depth
    flash = box((x0, x1), (y0, y1), (low, low + tall), fillet=0.3 * tall)
    if draws.chance("flash_swings", 0.7):
        joint = revolute("body", (0, 1, 0), (x1, 0, low), 0.0, draws.angle("flash_angle", (0.5, 1.3)))
    else:
        joint = prismatic("body", UP, 0.0, tall * draws.number("flash_travel", (0.5, 1.2)), (x1, 0, low))
    camera.add("flash", flash, joint)


# --- other kinds -----------------------------------------------------------------------------------------------------


def _camcorder(draws: Draws) -> Assembly:
    """A long body with a screen at its left side, a strap at its right, and a viewfinder at the back."""
    half, height = 0.5 * draws.length("width", (0.044, 0.09)), draws.length("height", (0.05, 0.085))
    depth, lens_z = draws.length("depth", (0.09, 0.2)), height * draws.number("lens_height", (0.5, 0.62))
    r = draws.number("edge_radius", (0.1, 0.6)) * half
    axis = draws.one_of("round_edges", {"all": None, "lengthwise": 0, "crosswise": 1})
    body = box((0, depth), half, (0, height), fillet=r, axis=axis)
    style = draws.pick("lens", ["tubes", "prime", "zoom"])
    lens = Lens(draws, (0.0, 0.0, lens_z), min(half, 0.38 * height) * 0.92, style)
    if draws.chance("handle", 0.5):  # on top
        x0, x1, z = 0.1 * depth, 0.85 * depth, height + draws.length("handle_height", (0.02, 0.04))
        r = draws.length("handle_radius", (0.004, 0.008))
        path = [(x0, height - 0.004), (x0, z - r), (x0 + r, z), (x1 - r, z), (x1, z - r), (x1, height - 0.004)]
        body += tube([(x, 0, z) for x, z in path], r, 10).called("handle", UP)
    if draws.chance("strap", 0.6):  # at the right
        bulge = half + draws.length("strap_bulge", (0.008, 0.02))
        xs = np.linspace(0.15, 0.85, 5) * depth
        ys = [half - 0.003, 0.6 * half + 0.4 * bulge, bulge, 0.6 * half + 0.4 * bulge, half - 0.003]
        wide = draws.number("strap_width", (0.2, 0.35)) * height
        links = [box(about(x, 0.001), about(y, 0.001), about(0.5 * height, wide)) for x, y in zip(xs, ys, strict=True)]
        body += union(hull_of(*ends) for ends in pairwise(links)).called("handle", SIDE)
    if draws.chance("battery", 0.5):  # at the back
        deep = (depth - 0.004, depth + draws.length("battery_depth", (0.008, 0.03)))
        body += box(deep, 0.7 * half, (0.05 * height, 0.62 * height), fillet=0.004)
    camera = Assembly("body", body + lens.fixed, DENSITY)
    lens.add_to(camera)
    if draws.chance("screen", 0.85):
        thick = draws.length("screen_thickness", (0.004, 0.009))
        y = -half - GAP
        x0, x1 = depth * draws.number("screen_front", (0.06, 0.2)), depth * draws.number("screen_back", (0.65, 0.95))
        screen = box((x0, x1), (y - thick, y), (0.15 * height, 0.88 * height), fillet=0.003, axis=1)
        angle = draws.angle("screen_angle", (1.2, 2.0))
        camera.add("screen", screen, revolute("body", -UP, (x0, y - thick, 0), 0.0, angle))
    if draws.chance("viewfinder", 0.5):
        z = 0.85 * height
        r = 0.22 * height * draws.number("viewfinder_radius", (0.6, 1.0))
        x = depth + 0.001 + r
        eye = rod((x, depth + draws.length("viewfinder_length", (0.03, 0.06))), 0, z, 0.8 * r, r, 16)
        eye += rod(x, (-0.6 * half, 0.6 * half), z, r, sections=14)
        tilt = revolute("body", (0, -1, 0), (x, 0, z), 0.0, draws.angle("viewfinder_angle", (0.4, 1.2)))
        camera.add("viewfinder", eye, tilt)
    for number, x in enumerate((0.3, 0.9)[: draws.integer("buttons", 0, 2)]):
        size = 0.25 * half
        at = (x * depth, 0.55 * half, height + GAP)
        button = box(about(at[0], size), about(at[1], 0.6 * size), (at[2] + 0.0012, at[2] + 0.004), fillet=0.001)
        camera.add(f"button_{number}", button, prismatic("body", -UP, 0.0, 0.001, at))
    return camera


def _swivel(draws: Draws) -> Assembly:
    """A camera that turns and nods in a fork on a foot: for a desk, a wall, a ceiling."""
    r = 0.5 * draws.length("width", (0.04, 0.12))  # of the head
    shape = draws.pick("head", ["ball", "bullet", "box"])
    thick = 0.14 * r
    reach = r + 0.002
    if shape == "ball":
        head, front, low = ellipsoid((0, 0, 0), r, 20), r, 1.2 * r
    else:
        long = 0.5 * draws.length("depth", (1.4, 2.6) if shape == "bullet" else (0.9, 2.0), of=2.0 * r)
        front, low = long, 1.3 * long + r
        head = box(long, r, 0.8 * r, fillet=0.2 * r)
    if shape == "bullet":
        head = rod((-long, 0.8 * long), 0, 0, r, sections=22)
        if draws.chance("sun_roof", 0.6):
            head += box((-1.25 * long, 0.7 * long), 0.9 * r, (0.75 * r, 1.1 * r), fillet=0.1 * r)
    head += rod((-0.8 * front, -front - 0.12 * r), 0, 0, 0.6 * r, sections=20)
    head += ring((-front - 0.18 * r, 0, 0), FRONT, 0.45 * r, 0.6 * r, 0.16 * r, 20).called("glass", FRONT)
    sink = low + thick + 0.004
    fork = tube([(0, -reach - thick, 0), (0, -reach - thick, -0.6 * sink), (0, -0.5 * r, -sink), (0, 0.5 * r, -sink),
                 (0, reach + thick, -0.6 * sink), (0, reach + thick, 0)], thick, 10)  # fmt: skip
    neck = 0.3 * r
    fork += rod(0, 0, (-sink - thick, -sink), 2.2 * thick, sections=14)
    foot = -sink - thick - GAP
    kind = draws.pick("foot", ["disc", "column", "clip"])
    if kind == "clip":
        base = box(0.8 * r, r, (foot - 0.01, foot)) + box((0.4 * r, -0.7 * r, foot - 2 * r), (0.6 * r, 0.7 * r, foot))
    else:
        tall = draws.length("height", (0.2, 0.5) if kind == "disc" else (1.0, 3.0), of=r)
        base = rod(0, 0, (foot - tall, foot), neck if kind == "column" else 1.1 * r, 0.9 * neck + 0.4 * r)
        base += rod(0, 0, (foot - tall - 0.2 * r, foot - tall + 1e-4), 1.3 * r, 1.2 * r)
    camera = Assembly("body", base, DENSITY)
    pan = draws.angle("pan_angle", (0.8, 3.0)) if draws.chance("pan_stops", 0.5) else None
    camera.add("fork", fork, swivel("body", UP, (0, 0, foot), pan))
    limit = draws.angle("nod_angle", (0.3, 1.2))
    camera.add("head", head, revolute("fork", (0, 1, 0), (0, 0, 0), -limit, limit))
    return camera
