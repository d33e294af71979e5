"""Robot arms: serial chains of 3 to 9 joints on a column, a plinth or a rail, with or without a gripper.

Joints turn across the links (bends), along them (rolls) or slide (telescopes, rails, the quills of SCARA arms). What
varies: the order of the joints, lengths, thickness, the shape of links, the side that each bend steps to, the tool.
"""

from collections.abc import Callable
from typing import Any

import numpy as np

from artsim.common.products import apply, matmul
from artsim.families.clearance import Link, narrow_limits
from artsim.making.assembly import Assembly, JointSpec, prismatic, revolute, swivel
from artsim.making.draws import Draws
from artsim.making.outlines import Array, Span, rounded_rectangle
from artsim.making.solids import Solid, box, cylinder, hull, hull_of, ring, union
from artsim.model.transforms import rotation_about

GAP = 0.0015

# Y, R: roll about the link's own direction (Y: of the turret); P: bend; S: telescope.
ARMS = (
    "YPP", "YPS", "YPPR", "YPPP", "YPRP", "YPPPR", "YPPRP", "YPSRP", "YPPRPR", "YPPPRP", "YPPSRP",
    "YPRPRP", "YPRPRPR", "YPRPPRP", "YPRPSRPR", "YPRPRPRP",
)  # fmt: skip
SCARAS = ("PPS", "PPSR", "PPPS", "PPPSR")
BEAM = rounded_rectangle((-1, -1), (1, 1), 0.3, 2)
"""Section of a square beam, its edges broken."""
STOOP = {"shoulder_rest": (-25, 40), "elbow_rest": (40, 100), "wrist_rest": (10, 60)}
"""Degrees by which the first three bends of an arm lean forward at rest."""


class _Chain:
    """Links built one after the other, each from a pose: a point, a direction along the link, a lateral axis."""

    def __init__(self, draws: Draws, reach: float):
        self.draws = draws
        self.radius = self.widest = reach * draws.number("thickness", (0.055, 0.085))
        """Half the width of a joint; and of the link so far: the next one steps past that."""
        self.at: Array = np.zeros(3)
        self.along: Array = np.array([0.0, 0.0, 1.0])
        self.lateral: Array = np.array([0.0, 1.0, 0.0])
        self.links = [Link("base")]
        self.collars, self.square = draws.chance("collars", 0.6), draws.chance("square", 0.35)
        self.side, self.same_side = draws.side("side"), draws.chance("same_side", 0.5)

    @property
    def link(self) -> Link:
        return self.links[-1]

    def begin(self, joint: Callable[..., JointSpec], *details: Any) -> None:
        """Start the next link, on a joint to this one."""
        self.links.append(Link(f"link_{len(self.links)}", joint(self.link.name, *details)))

    def limb(self, length: float, end_radius: float, plate: bool = False) -> None:
        """Go on along the link: a tube, a beam or, between two bends, a plate with round ends."""
        end = self.at + length * self.along
        r = self.radius
        if plate:
            half = 0.7 * end_radius * self.lateral
            self.link.solid += hull_of(*[cylinder(p - half, p + half, q) for p, q in ((self.at, r), (end, end_radius))])
            self.link.guard(self.at - r * self.along, end + end_radius * self.along, r)
        elif self.square and length > 3 * r:
            a, b = 0.72 * r, 0.72 * end_radius
            square = matmul(BEAM, [np.cross(self.lateral, self.along), self.lateral])
            self.link.solid += hull(np.concatenate([self.at + a * square, end + b * square]))
            self.link.guard(self.at, end, 1.2 * max(a, b))
        else:
            self.link.rod(self.at, end, 0.86 * r, 0.86 * end_radius)
            if self.collars and length > 3 * r:
                spot = self.at + 1.25 * r * self.along
                self.link.solid += cylinder(spot, spot + 0.25 * r * self.along, 0.97 * r, sections=20)
        self.at, self.radius = end, end_radius

    def roll(self, spin: bool = False) -> None:
        """Joint about the link's direction, between two round flanges."""
        r = self.radius
        self.link.rod(self.at - 0.02 * r * self.along, self.at + 0.5 * r * self.along, r)
        face = self.at + 0.5 * r * self.along
        limit = np.deg2rad(self.draws.degrees("roll_angle", (120, 175)))
        self.begin(swivel, self.along, face, None if spin else limit)
        self.link.narrowing = 0.97
        self.widest = r
        self.at = face + GAP * self.along
        self.link.rod(self.at, self.at + 0.5 * r * self.along, r)
        self.at = self.at + 0.45 * r * self.along

    def bend(self, angle: float, radius: float, reach: tuple[float, float]) -> None:
        """Joint about the lateral axis: the next link lies beside this one and turns freely past it."""
        r, half = self.radius, max(self.radius, self.widest)
        if not self.same_side:
            self.side = -self.side
        step = self.side * self.lateral
        cap = 0.2 * half
        self.link.rod(self.at - (half - cap) * step, self.at + half * step, r)
        self.link.solid += cylinder(self.at - half * step, self.at, 0.75 * r, sections=20)
        center = self.at + (half + GAP) * step
        self.begin(revolute, self.lateral, center, *reach)
        self.radius = radius
        half = self.widest = radius
        self.link.rod(center, center + (2 * half - cap) * step, r)
        self.link.solid += cylinder(center + half * step, center + 2 * half * step, 0.75 * r, sections=20)
        self.at = center + half * step
        self.along = apply(rotation_about(self.lateral, angle), self.along)

    def slide(self, depth: float, travel: float) -> None:
        """Telescope: a rod that comes out of a sleeve."""
        r, d = self.radius, self.along
        bore = 0.62 * r
        self.link.solid += ring(self.at + 0.5 * depth * d, d, bore, r, depth, 20)
        self.link.solid += cylinder(self.at - 0.3 * r * d, self.at + 0.2 * r * d, r, sections=20)
        self.link.guard(self.at, self.at + depth * d, r)
        mouth = self.at + depth * d
        self.begin(prismatic, d, 0.0, travel, mouth)
        inner = bore - GAP
        self.link.rod(mouth - min(depth - 0.3 * r, travel + 0.2 * depth) * d, mouth + 0.6 * r * d, inner)
        self.at, self.radius = mouth + 0.3 * r * d, 0.9 * r
        self.link.rod(mouth + GAP * d, mouth + 0.6 * r * d, 0.9 * r)


def build(draws: Draws) -> Assembly:
    """A robot arm, stretched out or bent at rest."""
    for _ in draws.tries():
        reach = draws.length("length", (0.4, 1.6))
        chain = _Chain(draws, reach)
        if draws.chance("scara", 0.17):
            _scara(chain, reach, draws.pick("scara_joints", SCARAS))
        else:
            _arm(chain, reach, draws.pick("arm_joints", ARMS))
        spread = _tool(chain)
        if narrow_limits(chain.links, 0.025 * reach):
            break

    arm = Assembly(density=1800.0)
    for link in chain.links:
        arm.add(link.name, link.solid, link.joint)
    if spread is not None:
        _fingers(arm, chain, spread)
    return arm


def _arm(chain: _Chain, reach: float, kinds: str) -> None:
    """An upright arm with a turret, its elbow bent by chance."""
    draws, r = chain.draws, chain.radius
    _base(chain, reach)
    bends = kinds.count("P")
    angles = np.zeros(bends)  # of every bend at rest: upright, or as a crane stoops
    if not draws.chance("upright", 0.25):
        angles[:3] = -np.deg2rad([draws.degrees(name, ends) for name, ends in STOOP.items()])[:bends]
    long_limbs = 2 if bends > 1 else 1
    bend = 0
    for k, kind in enumerate(kinds):
        following = kinds[k + 1] if k + 1 < len(kinds) else ""
        thin = chain.radius * draws.number("joint_taper", (0.8, 0.97))
        if kind in "YR":
            chain.roll(spin=not following and draws.chance("last_spins", 0.5))
            length = 1.3 * chain.radius if following else 0.6 * chain.radius
            if kind == "R" and bend <= long_limbs:  # the second half of a limb with a roll in it
                length = max(length, reach * draws.number("roll_length", (0.14, 0.22)))
            chain.limb(length, thin if following else chain.radius)
        elif kind == "P":
            limit = draws.turn("bend_angle", (95, 150))
            chain.bend(angles[bend], thin, (-limit * draws.number("bend_back", (0.6, 1.0)), limit))
            bend += 1
            if bend <= long_limbs:
                length = reach * draws.number("limb_length", (0.28, 0.42))
                length *= 0.5 if following in ("R", "S") else 1.0
            else:
                length = 2.3 * r * draws.number("wrist_length", (0.8, 1.2))
            plate = following == "P" and bend <= long_limbs and draws.chance("plate", 0.4)
            chain.limb(length, chain.radius * draws.number("limb_taper", (0.8, 0.95)), plate)
        else:
            depth = reach * draws.number("sleeve_length", (0.16, 0.26))
            chain.slide(depth, 0.7 * depth)
            chain.limb(1.5 * chain.radius, chain.radius)


def _base(chain: _Chain, reach: float) -> None:
    """Plate and column, on a rail by chance."""
    draws, r = chain.draws, chain.radius
    if draws.chance("rail", 0.15):
        _rail(chain, reach)
    link = chain.link
    floor = chain.at.copy()
    height, wide = r * draws.number("base_height", (1.0, 3.5)), r * draws.number("base_width", (1.15, 1.7))
    thick = 0.25 * r
    if draws.chance("round_base", 0.5):
        link.rod(floor, floor + (0, 0, thick), wide)
    else:
        link.solid += box(floor - (wide, wide, 0), floor + (wide, wide, thick), fillet=0.2 * wide, axis=2)
        link.guard(floor, floor + (0, 0, thick), 1.3 * wide)
    link.rod(floor + (0, 0, 0.5 * thick), floor + (0, 0, height), r * draws.number("column_foot", (1.0, 1.15)), r)
    chain.at = floor + (0, 0, height - 0.1 * r)


def _rail(chain: _Chain, reach: float) -> None:
    """A linear axis under the arm: a beam, and a carriage that slides along it."""
    draws, r = chain.draws, chain.radius
    axis = draws.pick("rail_axis", ["x", "y"])
    direction = np.eye(3)["xy".index(axis)]
    half, travel = 1.6 * r, reach * draws.number("rail_length", (0.4, 0.9))
    along = (-half, half + travel)

    def beam(across: Span, z: Span, fillet: float | None = None) -> Solid:
        return box(along, across, z, fillet=fillet) if axis == "x" else box(across, along, z, fillet=fillet)

    chain.link.solid += beam(1.1 * r, (0, r), 0.15 * r)
    chain.link.solid += union(beam(((side - 0.15) * r, (side + 0.15) * r), (0.9 * r, 1.15 * r)) for side in (-0.7, 0.7))
    start, end = (share * direction + (0, 0, 0.5 * r) for share in along)
    chain.link.guard(start, end, 1.25 * r)
    chain.begin(prismatic, direction, 0.0, travel, (0, 0, 1.15 * r))
    bottom = 1.15 * r + GAP
    chain.link.solid += box(half, half, (bottom, bottom + 0.5 * r), fillet=0.1 * r)
    chain.link.guard((0, 0, bottom), (0, 0, bottom + 0.5 * r), 1.8 * r)
    chain.at = np.array([0.0, 0.0, bottom + 0.49 * r])


def _scara(chain: _Chain, reach: float, kinds: str) -> None:
    """Flat links above one another on a column, with a quill that goes up and down."""
    draws = chain.draws.within("scara")
    r = chain.radius = 1.15 * chain.radius
    height = reach * draws.number("height", (0.35, 0.6))
    chain.link.rod((0, 0, 0), (0, 0, 0.3 * r), r * draws.number("base_width", (1.2, 1.6)))
    chain.link.rod((0, 0, 0.2 * r), (0, 0, height), r)
    chain.at = np.array([0.0, 0.0, height])
    chain.along, chain.lateral = np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    chain.side, chain.same_side = 1.0, True
    bends = kinds.count("P")
    for k in range(bends):
        limit = draws.turn("bend_angle", (100, 150))
        angle = draws.turn("rest_angle", (-60, 60)) if k else 0.0
        chain.bend(angle, chain.radius * draws.number("joint_taper", (0.85, 0.95)), (-limit, limit))
        length = reach * draws.number("limb_length", (0.55, 0.8)) / bends
        chain.limb(length, chain.radius * draws.number("limb_taper", (0.75, 0.95)), plate=True)
    _quill(chain, height)
    if kinds.endswith("R"):
        chain.roll(spin=True)
    chain.limb(0.4 * chain.radius, chain.radius)


def _quill(chain: _Chain, height: float) -> None:
    """A rod through an upright sleeve at the end of the last flat link; it sticks out above at rest."""
    end, r = chain.radius, 0.8 * chain.radius
    center = chain.at + (end + 0.8 * r) * chain.along
    bore, travel = 0.6 * r, 0.45 * height
    top, bottom = 1.6 * end, -0.9 * end
    down = np.array([0.0, 0.0, -1.0])
    middle = center + (0, 0, 0.5 * (top + bottom))
    chain.link.solid += ring(middle, down, bore, r, top - bottom, 20)
    chain.link.guard(center + (0, 0, bottom), center + (0, 0, top), r)
    mouth = center + (0, 0, bottom)
    chain.begin(prismatic, down, 0.0, travel, mouth)
    chain.link.rod(center + (0, 0, top + travel), mouth + 1.9 * r * down, bore - GAP)
    chain.along, chain.lateral, chain.radius = down, np.array([0.0, 1.0, 0.0]), 0.8 * r
    chain.at = mouth + 1.8 * r * down


def _tool(chain: _Chain) -> float | None:
    """What the last link carries; for a gripper, half its width in metres."""
    kind = chain.draws.pick("tool", {"gripper": 0.55, "suction": 0.15, "probe": 0.15, "flange": 0.15})
    r, d, link, end = chain.radius, chain.along, chain.link, chain.at
    if kind == "flange":
        link.rod(end - 0.1 * r * d, end + 0.2 * r * d, 0.7 * r)
    elif kind == "suction":
        link.rod(end - 0.1 * r * d, end + 0.9 * r * d, 0.35 * r)
        link.rod(end + 0.8 * r * d, end + 1.3 * r * d, 0.35 * r, 0.8 * r)
    elif kind == "probe":
        link.rod(end - 0.1 * r * d, end + 0.6 * r * d, 0.5 * r)
        link.rod(end + 0.5 * r * d, end + 2.2 * r * d, 0.35 * r, 0.08 * r)
    else:  # the body of a parallel gripper
        half = r * chain.draws.number("gripper_width", (1.1, 1.5))
        v = np.cross(d, chain.lateral)
        outline = matmul(rounded_rectangle((-half, -0.6 * r), (half, 0.6 * r), 0.25 * r, 2), [chain.lateral, v])
        low, high = end - 0.1 * r * d, end + 0.8 * r * d
        link.solid += hull(np.concatenate([low + outline, high + outline]))
        chain.at = high
        link.guard(low, high + 2.6 * r * d, 1.05 * half)
        return half
    return None


def _fingers(arm: Assembly, chain: _Chain, half: float) -> None:
    """Two fingers that open sideways, one as the mimic of the other."""
    r, d, u = chain.radius, chain.along, chain.lateral
    v = np.cross(d, u)
    length = r * chain.draws.number("finger_length", (1.4, 2.3))
    tip = chain.draws.number("finger_tip", (0.4, 1.0))
    thick, inner = 0.28 * half, 0.5 * GAP
    # From the middle outwards, along the finger, and half its width.
    blocks = [
        ((inner, inner + 1.6 * thick), (GAP, 0.4 * r), 0.42 * r),
        ((inner + 0.3 * thick, inner + 1.3 * thick), (0.35 * r, length), 0.3 * r),
        ((inner, inner + 0.8 * thick), (length - 0.5 * r * tip, length + 0.05 * r), 0.3 * r),
    ]
    for number, side in enumerate((1.0, -1.0)):
        finger = union(
            hull([chain.at + side * a * u + b * d + c * v for a in out for b in along for c in (-wide, wide)])
            for out, along, wide in blocks
        )
        travel = half - inner - 1.6 * thick
        mimic = ("finger_0", 1.0) if number else None
        arm.add(f"finger_{number}", finger, prismatic(chain.link.name, side * u, 0.0, travel, chain.at, mimic=mimic))
