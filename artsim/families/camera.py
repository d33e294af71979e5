"""Cameras: compact, single-lens reflex, rangefinder, instant, camcorder, and cameras on a swivel.

What varies: the kind, the proportions of the body, grip, prism and viewfinder, the lens (rings that turn, one to
three tubes that slide out of each other, a cap), dials and buttons on top and at the back, a flash that pops up, a
screen that swings out at the back or at the side, a back that opens, a door at the side. Two to eleven parts move.
"""

import numpy as np

from artsim.common.elementary import cos, sin
from artsim.families.lenses import Lens
from artsim.making.assembly import Assembly, JointSpec, Rng, continuous, pick, prismatic, revolute, swivel
from artsim.making.outlines import FRONT, UP, about, turns
from artsim.making.solids import Solid, box, cylinder, ellipsoid, hull_of, prism, ring, rod, tube
from artsim.model.kinematics import Array

GAP = 0.0005
DENSITY = 900.0


class Shell:
    """Half width, depth and height of a body with its front at x = 0; place and largest radius of the lens; metres."""

    def __init__(self, rng: Rng, kind: str) -> None:
        # Half width; height and depth over it.
        half, tall, deep = {
            "compact": (rng.uniform(0.042, 0.06), (1.05, 1.45), (0.35, 0.75)),
            "reflex": (rng.uniform(0.055, 0.08), (1.15, 1.6), (0.5, 0.95)),
            "rangefinder": (rng.uniform(0.055, 0.075), (1.0, 1.35), (0.4, 0.65)),
            "instant": (rng.uniform(0.05, 0.075), (1.3, 2.1), (0.6, 1.3)),
        }[kind]
        self.half, self.height, self.depth = half, half * rng.uniform(*tall), half * rng.uniform(*deep)
        radius = self.height * (rng.uniform(0.24, 0.4) if kind != "instant" else rng.uniform(0.18, 0.3))
        y = half * rng.choice([0.0, rng.uniform(-0.35, 0.1)])
        self.lens_y = float(np.clip(y, -half + radius + 0.004, half - radius - 0.014))
        self.lens_z = self.height * rng.uniform(0.42, 0.52)
        self.lens_radius = min(radius, self.lens_z - 0.002)


def build(rng: Rng) -> Assembly:
    """A camera; its lens looks towards -X and is drawn in at rest, all covers are shut."""
    kind = pick(
        rng, {"compact": 0.26, "reflex": 0.27, "rangefinder": 0.17, "instant": 0.1, "camcorder": 0.12, "swivel": 0.08}
    )
    if kind == "camcorder":
        return _camcorder(rng)
    if kind == "swivel":
        return _swivel(rng)
    shell = Shell(rng, kind)
    body, top = _body(rng, shell, kind)
    styles = {"compact": ["tubes"], "instant": ["tubes", "prime"]}
    style = pick(rng, styles.get(kind, ["tubes", "prime", "zoom", "zoom"]))
    lens = Lens(rng, (0.0, shell.lens_y, shell.lens_z), shell.lens_radius, style)
    camera = Assembly("body", body + lens.fixed, DENSITY)
    lens.add_to(camera)
    _add_controls(rng, camera, shell, top, kind)
    _back(rng, camera, shell)
    if kind != "compact" and top[1] - top[0] > 0.01 and rng.random() < 0.5:
        _flash(rng, camera, shell, top)
    return camera


def _body(rng: Rng, shell: Shell, kind: str) -> tuple[Solid, tuple[float, float, float]]:
    """The body; the span along Y and the height of what stands on its middle, for a flash."""
    half, depth, height = shell.half, shell.depth, shell.height
    r = min(rng.uniform(0.05, 0.45) * depth, 0.4 * height)
    axis = [None, 2, 1, 0][int(rng.integers(4))]
    body = box((0, depth), half, (0, height), fillet=r, axis=axis)
    if rng.random() < 0.4:  # covering between two metal plates
        body += box((-0.001, depth + 0.001), half + 0.0005, (0.16 * height, 0.8 * height), fillet=r, axis=2)
    if kind in ("reflex", "compact") and rng.random() < (0.85 if kind == "reflex" else 0.4):  # grip of the right hand
        deep = depth * (rng.uniform(0.2, 0.6) if kind == "reflex" else rng.uniform(0.05, 0.2))
        room = max(half - shell.lens_y - shell.lens_radius - 0.004, 0.008)
        wide = min(rng.uniform(0.25, 0.5) * half, room)
        upright = (0.02 * height, 0.97 * height)
        body += box((-deep, 0.6 * depth), (half - wide, half), upright, fillet=0.45 * wide, axis=2)
    span = (0.0, 0.0, height)
    if kind == "reflex":
        wide = half * rng.uniform(0.28, 0.42)
        rise = height * rng.uniform(0.14, 0.32)
        y = float(np.clip(shell.lens_y, -half + wide, half - wide))
        low = [(y - wide, height - 0.002), (y + wide, height - 0.002)]
        crest = [(y + wide * rng.uniform(0.4, 0.85), height + rise), (y - wide * rng.uniform(0.4, 0.85), height + rise)]
        body += prism(low + crest, rng.uniform(-0.15, 0.2) * depth, rng.uniform(0.8, 1.1) * depth, 0)
        upright = (height - 0.2 * rise, height + 0.7 * rise)
        body += box((depth - 0.004, 1.15 * depth), about(y, 0.5 * wide), upright, fillet=0.004)
        span = (y - 0.4 * wide, y + 0.4 * wide, height + rise)
    elif kind == "rangefinder":
        if rng.random() < 0.6:  # a raised deck
            y0, y1 = sorted(rng.uniform(-0.95, 0.95, 2) * half)
            body += box((0.05 * depth, 0.95 * depth), (y0, y1), (height - 0.003, height + 0.06 * height), fillet=0.002)
        for y, size in ((-0.75, 0.1), (0.3, 0.07)):  # windows
            body += box((-0.0012, 0.002), ((y - size) * half, (y + size) * half), (0.8 * height, 0.93 * height))
    elif kind == "instant":
        rise = height * rng.uniform(0.1, 0.35)
        wide = half * rng.uniform(0.3, 0.98)
        body += hull_of(
            box((0.2 * depth, depth), wide, (height - 0.002, height)),
            box((0.4 * depth, depth), 0.9 * wide, (height + rise - 0.002, height + rise)),
        )
        slot = min(0.18 * height, shell.lens_z - shell.lens_radius - 0.002)  # where pictures come out
        body += box((-0.3 * depth, 0.1 * depth), half, (0, slot), fillet=0.004)
        span = (-0.6 * wide, 0.6 * wide, height + rise)
    if kind in ("compact", "instant"):
        y = half * rng.uniform(0.3, 0.7) * rng.choice([-1.0, 1.0])
        body += box((-0.0012, 0.003), about(y, 0.14 * half), (0.8 * height, 0.93 * height), fillet=0.002, axis=0)
    if kind in ("reflex", "rangefinder") and rng.random() < 0.4:  # lugs for a strap
        for s in (-1.0, 1.0):
            body += ring((0.5 * depth, s * (half + 0.002), 0.85 * height), (1, 0, 0), 0.0018, 0.004, 0.0018, 12)
    return body, span


def _add_controls(rng: Rng, camera: Assembly, shell: Shell, middle: tuple[float, float, float], kind: str) -> None:
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
        r = size * rng.uniform(0.6, 0.9)
        at = np.array([depth * rng.uniform(0.3, 0.6), spots.pop(), z])
        button = cylinder(at + (0, 0, 0.0016), at + (0, 0, 0.0016 + 0.5 * r), r, 0.9 * r, 18)
        add("shutter_button", button, prismatic("body", -UP, 0.0, 0.0015, at), r, "button")
        for number, y in enumerate(spots):
            if rng.random() < 0.75:
                at = np.array([rng.uniform(0.4, 0.6) * depth, y, z])
                add(f"dial_{number}", _dial(rng, at, size), continuous("body", UP, at), size)
    room = half + left
    if kind in ("reflex", "rangefinder") and room > 0.012 and rng.random() < 0.65:
        size = min(0.3 * depth, 0.4 * room, 0.012)
        at = np.array([0.5 * depth, 0.5 * (left - half), z])
        crank = _dial(rng, at, size)
        if rng.random() < 0.4:
            low, high = at + (-0.15 * size, -0.9 * size, 0.8 * size), at + (0.15 * size, 0.9 * size, 1.2 * size)
            crank += box(low, high, fillet=0.1 * size)
        add("knob", crank, continuous("body", UP, at), size, "knob")


def _dial(rng: Rng, foot: Array, radius: float) -> Solid:
    """A flat dial, knurled by chance."""
    tall = radius * rng.uniform(0.4, 1.1)
    solid = cylinder(foot, foot + tall * UP, radius, radius * rng.uniform(0.9, 1.0), 20)
    if rng.random() < 0.5:
        for a in turns(10):
            edge = foot + (radius * cos(a), radius * sin(a), 0)
            solid += cylinder(edge + 0.1 * tall * UP, edge + 0.9 * tall * UP, 0.07 * radius, sections=4)
    if rng.random() < 0.4:
        solid += cylinder(foot + 0.9 * tall * UP, foot + 1.3 * tall * UP, 0.4 * radius, sections=12)
    return solid


def _back(rng: Rng, camera: Assembly, shell: Shell) -> None:
    """A screen that swings or tilts, or buttons; and a door for the battery at the side."""
    half, depth, height = shell.half, shell.depth + 0.001, shell.height
    kind = pick(rng, {"fixed": 0.25, "swing": 0.25, "tilt": 0.15, "back": 0.1, "none": 0.25})
    y0, y1 = -0.92 * half, half * rng.uniform(0.2, 0.5)
    z0, z1 = height * rng.uniform(0.08, 0.14), height * rng.uniform(0.68, 0.8)
    thick = rng.uniform(0.002, 0.006)
    x = depth + GAP
    screen = box((x, x + thick), (y0, y1), (z0, z1), fillet=0.003, axis=0)
    if kind == "swing":
        camera.add("screen", screen, revolute("body", -UP, (x + thick, y0, z0), 0.0, rng.uniform(1.2, 3.0)))
    elif kind == "tilt":
        upward = rng.random() < 0.5  # about its upper edge
        joint = revolute("body", (0, -1 if upward else 1, 0), (x + thick, 0, z1 if upward else z0), 0.0,
                         rng.uniform(0.5, 1.5))  # fmt: skip
        camera.add("screen", screen, joint)
    elif kind == "back":  # the whole back of a film camera opens
        leaf = box((x, x + thick), 0.97 * half, (0.06 * height, 0.92 * height), fillet=0.002, axis=0)
        camera.add("back", leaf, revolute("body", -UP, (x + thick, -0.97 * half, 0), 0.0, rng.uniform(1.2, 2.2)),
                   label="door")  # fmt: skip
    if kind in ("fixed", "swing", "tilt", "none"):
        room = half - y1
        size = min(0.2 * room, 0.08 * height, 0.006)
        style = pick(rng, {"pad": 0.4, "row": 0.35, "none": 0.25})
        y = 0.5 * (y1 + half)
        if style == "pad" and size > 0.001:
            z = 0.4 * height
            wheel = ring((x + 0.3 * size, y, z), (1, 0, 0), 1.1 * size, 1.9 * size, 0.6 * size, 16)
            camera.add("wheel", wheel, continuous("body", (1, 0, 0), (x, y, z)), label="dial")
            button = rod((x + 0.0012, x + 0.0012 + 0.6 * size), y, z, 0.8 * size, sections=14)
            camera.add("button", button, prismatic("body", FRONT, 0.0, 0.001, (x, y, z)))
        elif style == "row" and size > 0.001:
            for number in range(int(rng.integers(1, 4))):
                z = height * (0.2 + 0.2 * number)
                button = rod((x + 0.0012, x + 0.0012 + 0.5 * size), y, z, size, sections=14)
                camera.add(f"button_{number}", button, prismatic("body", FRONT, 0.0, 0.001, (x, y, z)))
    if rng.random() < 0.2:  # a door at the right side
        y, t = half + 0.001, 0.0025
        deep = (0.2 * shell.depth, 0.8 * shell.depth)
        door = box(deep, (y, y + t), (0.2 * height, 0.75 * height), fillet=0.002, axis=1)
        camera.add("door", door, revolute("body", -UP, (0.8 * shell.depth, y + t, 0), 0.0, rng.uniform(1.0, 2.2)))


def _flash(rng: Rng, camera: Assembly, shell: Shell, span: tuple[float, float, float]) -> None:
    """A flash on the crest: it lies flat and swings up about its back edge, or slides up."""
    y0, y1, z = span
    low = z + GAP
    tall = shell.height * rng.uniform(0.06, 0.2)
    x0, x1 = 0.42 * shell.depth, 0.78 * shell.depth
    flash = box((x0, x1), (y0, y1), (low, low + tall), fillet=0.3 * tall)
    if rng.random() < 0.7:
        joint = revolute("body", (0, 1, 0), (x1, 0, low), 0.0, rng.uniform(0.5, 1.3))
    else:
        joint = prismatic("body", UP, 0.0, tall * rng.uniform(0.5, 1.2), (x1, 0, low))
    camera.add("flash", flash, joint)


# --- other kinds -----------------------------------------------------------------------------------------------------


def _camcorder(rng: Rng) -> Assembly:
    """A long body with a screen at its left side, a strap at its right, and a viewfinder at the back."""
    half, height = rng.uniform(0.022, 0.045), rng.uniform(0.05, 0.085)
    depth = rng.uniform(0.09, 0.2)
    lens_z = height * rng.uniform(0.5, 0.62)
    body = box((0, -half, 0), (depth, half, height), fillet=rng.uniform(0.1, 0.6) * half,
                       axis=[None, 0, 1][int(rng.integers(3))])  # fmt: skip
    lens = Lens(rng, (0.0, 0.0, lens_z), min(half, 0.38 * height) * 0.92, pick(rng, ["tubes", "prime", "zoom"]))
    if rng.random() < 0.5:  # a handle on top
        x0, x1, z = 0.1 * depth, 0.85 * depth, height + rng.uniform(0.02, 0.04)
        r = rng.uniform(0.004, 0.008)
        body += tube([(x0, 0, height - 0.004), (x0, 0, z - r), (x0 + r, 0, z), (x1 - r, 0, z), (x1, 0, z - r),
                      (x1, 0, height - 0.004)], r, 10)  # fmt: skip
    if rng.random() < 0.6:  # a strap at the right
        bulge = half + rng.uniform(0.008, 0.02)
        xs = np.linspace(0.15, 0.85, 5) * depth
        ys = [half - 0.003, 0.6 * half + 0.4 * bulge, bulge, 0.6 * half + 0.4 * bulge, half - 0.003]
        wide = rng.uniform(0.2, 0.35) * height
        for k in range(4):
            ends = [box(about(xs[i], 0.001), about(ys[i], 0.001), about(0.5 * height, wide)) for i in (k, k + 1)]
            body += hull_of(*ends)
    back = rng.random() < 0.5
    if back:
        body += box((depth - 0.004, -0.7 * half, 0.05 * height), (depth + rng.uniform(0.008, 0.03), 0.7 * half,
                                                                         0.62 * height), fillet=0.004)  # fmt: skip
    camera = Assembly("body", body + lens.fixed, DENSITY)
    lens.add_to(camera)
    if rng.random() < 0.85:
        thick = rng.uniform(0.004, 0.009)
        y = -half - GAP
        x0, x1 = depth * rng.uniform(0.06, 0.2), depth * rng.uniform(0.65, 0.95)
        screen = box((x0, x1), (y - thick, y), (0.15 * height, 0.88 * height), fillet=0.003, axis=1)
        camera.add("screen", screen, revolute("body", -UP, (x0, y - thick, 0), 0.0, rng.uniform(1.2, 2.0)))
    if rng.random() < 0.5:
        z = 0.85 * height
        r = 0.22 * height * rng.uniform(0.6, 1.0)
        eye = rod((depth + 0.001 + r, depth + rng.uniform(0.03, 0.06)), 0, z, 0.8 * r, r, 16)
        eye += rod(depth + 0.001 + r, (-0.6 * half, 0.6 * half), z, r, sections=14)
        tilt = revolute("body", (0, -1, 0), (depth + 0.001 + r, 0, z), 0.0, rng.uniform(0.4, 1.2))
        camera.add("viewfinder", eye, tilt)
    for number, x in enumerate((0.3, 0.9)[: int(rng.integers(0, 3))]):
        size = 0.25 * half
        at = (x * depth, 0.55 * half, height + GAP)
        button = box(about(at[0], size), about(at[1], 0.6 * size), (at[2] + 0.0012, at[2] + 0.004), fillet=0.001)
        camera.add(f"button_{number}", button, prismatic("body", -UP, 0.0, 0.001, at))
    return camera


def _swivel(rng: Rng) -> Assembly:
    """A camera that turns and nods in a fork on a foot: for a desk, a wall, a ceiling."""
    r = rng.uniform(0.02, 0.06)
    shape = pick(rng, ["ball", "bullet", "box"])
    thick = 0.14 * r
    reach = r + 0.002
    if shape == "ball":
        head, front, low = ellipsoid((0, 0, 0), r, 20), r, 1.2 * r
    elif shape == "bullet":
        long = r * rng.uniform(1.4, 2.6)
        head = rod((-long, 0.8 * long), 0, 0, r, sections=22)
        if rng.random() < 0.6:
            head += box((-1.25 * long, 0.7 * long), 0.9 * r, (0.75 * r, 1.1 * r), fillet=0.1 * r)
        front, low = long, 1.3 * long + r
    else:
        long = r * rng.uniform(0.9, 2.0)
        head = box(long, r, 0.8 * r, fillet=0.2 * r)
        front, low = long, 1.3 * long + r
    head += rod((-0.8 * front, -front - 0.12 * r), 0, 0, 0.6 * r, sections=20)
    head += ring((-front - 0.18 * r, 0, 0), FRONT, 0.45 * r, 0.6 * r, 0.16 * r, 20)
    sink = low + thick + 0.004
    fork = tube([(0, -reach - thick, 0), (0, -reach - thick, -0.6 * sink), (0, -0.5 * r, -sink), (0, 0.5 * r, -sink),
                 (0, reach + thick, -0.6 * sink), (0, reach + thick, 0)], thick, 10)  # fmt: skip
    neck = 0.3 * r
    fork += rod(0, 0, (-sink - thick, -sink), 2.2 * thick, sections=14)
    foot = -sink - thick - GAP
    kind = pick(rng, ["disc", "column", "clip"])
    if kind == "clip":
        base = box(0.8 * r, r, (foot - 0.01, foot)) + box((0.4 * r, -0.7 * r, foot - 2 * r), (0.6 * r, 0.7 * r, foot))
    else:
        tall = r * (rng.uniform(0.2, 0.5) if kind == "disc" else rng.uniform(1.0, 3.0))
        base = rod(0, 0, (foot - tall, foot), neck if kind == "column" else 1.1 * r, 0.9 * neck + 0.4 * r)
        base += rod(0, 0, (foot - tall - 0.2 * r, foot - tall + 1e-4), 1.3 * r, 1.2 * r)
    camera = Assembly("body", base, DENSITY)
    pan = rng.uniform(0.8, 3.0) if rng.random() < 0.5 else None
    camera.add("fork", fork, swivel("body", UP, (0, 0, foot), pan))
    limit = rng.uniform(0.3, 1.2)
    camera.add("head", head, revolute("fork", (0, 1, 0), (0, 0, 0), -limit, limit))
    return camera
