"""Random trees of 2 to 12 parts, up to six joints deep, with every type of joint.

Parts are simple shapes. No two can touch in any state: a tree is put together from the leaves on, every branch knows
the box that it can reach, and a branch is moved away from its parent until that box is clear of all others there.
What varies: everything.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from artsim.common.elementary import cos, exp, log
from artsim.common.products import apply, matmul, norm, unit
from artsim.making.assembly import Assembly, JointSpec
from artsim.making.draws import Draws
from artsim.making.solids import Solid, box, ellipsoid, hull, ring, rod, tube, union
from artsim.model.kinematics import Array
from artsim.model.transforms import rotation_about

GAP = 0.002
_STUBS = np.concatenate([[0.0], 0.005 * exp(np.linspace(0.0, log(800.0), 50))])
"""Lengths to try: 0, then from 5 mm to 4 m, each the same factor longer."""
_DEEPEST_DIP = 0.02  # metres by which a branch on a hinge may swing below the foot of its neck
_BELOW = np.array([[-9.0, -9.0, -9.0], [9.0, 9.0, -GAP]])
"""Where nothing may hang on a part: towards its own parent."""
SHAPES = ("box", "rounded", "cylinder", "cone", "ball", "frame", "ring", "bar", "cross", "wedge")
JOINTS = {"revolute": 0.25, "continuous": 0.3, "prismatic": 0.28, "screw": 0.17}


@dataclass
class _Motion:
    """A joint in its own branch's frame; z leads away from the parent."""

    type: str
    axis: Array
    origin: Array
    lower: float
    upper: float
    pitch: float = 0.0
    follows: int | None = None
    multiplier: float = 1.0

    def reached(self, bounds: Array) -> Array:
        """(2, 3) box that holds a box of the moved part in all states."""
        low, high = (-np.pi, np.pi) if self.type == "continuous" else (self.lower, self.upper)
        states = np.linspace(low, high, 2 if self.type == "prismatic" else 25)
        turns = np.zeros(len(states)) if self.type == "prismatic" else states
        shifts = {"prismatic": states, "screw": self.pitch * states}.get(self.type, np.zeros(len(states)))
        arms = _corners(bounds) - self.origin
        turned = matmul(arms, np.array([rotation_about(self.axis, turn).T for turn in turns]))
        points = (turned + self.origin + (shifts[:, None] * self.axis)[:, None]).reshape(-1, 3)
        # Between two of the states a corner leaves the box of the samples by less than the sagitta of its arc.
        radius = norm(np.cross(arms, self.axis)).max()
        sagitta = radius * (1.0 - cos(0.5 * (turns[1] - turns[0])))
        return np.stack([points.min(axis=0) - sagitta, points.max(axis=0) + sagitta])


@dataclass
class _Branch:
    """A part with all that hangs on it. Its frame: z leads away from the parent, the part stands on the origin."""

    solid: Solid
    boxes: list[Array]  # (2, 3) each; together they hold the part and all that hangs on it, in all states
    hinge_height: float | None = None  # where a hinge across z goes, if the part has a neck for one
    children: list[tuple[_Branch, _Motion, Array, Array]] = field(default_factory=list)
    """Branch, joint, and where the branch's frame stands: rotation (3, 3) and position (3,)."""


def build(draws: Draws) -> Assembly:
    """A random articulated object."""
    parents = _parents(draws, 1 + draws.integer("parts", 1, 11), draws.integer("deepest", 1, 6))
    root = _grow(draws, 0, parents, draws.length("scale", (0.04, 0.12)))
    tree = Assembly()
    _put(tree, root, (f"part_{k}" for k in itertools.count()), None, np.eye(3), np.zeros(3))
    return tree


def _parents(draws: Draws, count: int, depth: int) -> list[int]:
    """Parent of every part; -1 for the root. Long chains are as likely as bushes."""
    parents, depths = [-1], [0]
    eager = draws.number("chains", (0.0, 1.0))
    for k in range(1, count):
        allowed = [i for i in range(k) if depths[i] < depth and parents.count(i) < 5]
        if not allowed:
            break
        parents.append(allowed[-1] if draws.chance("goes_on", eager) else draws.pick("parent", allowed))
        depths.append(depths[parents[-1]] + 1)
    return parents


def _grow(draws: Draws, k: int, parents: list[int], scale: float) -> _Branch:
    """Part ``k`` with everything that hangs on it."""
    size = scale * draws.numbers("side", 0.6, 1.5, 3) * (1.6 if k == 0 else 1.0)
    solid = _shape(draws, size)
    bounds = solid.bounds()
    branch = _Branch(solid, [bounds])
    if k > 0:  # stand on z = 0, on a neck by chance
        neck = 0.12 * float(size.min()) + 0.002
        hinged = draws.chance("neck", 0.4)
        lift = neck + draws.number("neck_length", (0.5, 1.0)) * float(bounds[1, :2].max()) if hinged else 0.0
        branch.solid = solid.moved((0, 0, lift - bounds[0, 2]))
        branch.boxes = [branch.solid.bounds()]
        if hinged:
            stem = tube([(0, 0, 0.3 * neck), (0, 0, lift - bounds[0, 2])], neck, 10) + ellipsoid((0, 0, neck), neck, 12)
            branch.boxes.append(np.array([[-neck, -neck, 0], [neck, neck, lift]]))
            branch.solid += stem
            branch.hinge_height = neck
        branch.boxes.append(_BELOW)
    bounds = branch.boxes[0]
    motions: list[_Motion] = []
    faces = [f for f in product(range(3), (-1, 1)) if k == 0 or f != (2, -1)]
    for child in (i for i, parent in enumerate(parents) if parent == k):
        grown = _grow(draws, child, parents, scale * draws.number("shrink", (0.8, 1.0)))
        motion = _motion(draws, grown, motions)
        face = _attach(draws, branch, grown, motion, faces, bounds)
        if face is not None:
            faces.remove(face)
            motions.append(motion)
    branch.boxes = [b for b in branch.boxes if b is not _BELOW]
    return branch


def _shape(draws: Draws, size: Array) -> Solid:
    """A simple solid about the origin with roughly the given sides."""
    kind = draws.pick("shape", SHAPES)
    half = 0.5 * size
    x, y, z = half
    thin = 0.22 * float(size.min())
    if kind == "rounded":
        return box(-half, half, fillet=0.3 * size.min(), steps=2)
    if kind == "cylinder":
        return rod(0, 0, (-z, z), min(x, y))
    if kind == "cone":
        return rod(0, 0, (-z, z), min(x, y), draws.number("cone_top", (0.2, 0.7)) * min(x, y))
    if kind == "ball":
        return ellipsoid((0, 0, 0), 0.5 * (half + half.min()))
    if kind == "frame":
        bars = [(np.array([x, thin, thin]), np.array([0, s * (y - thin), 0])) for s in (-1, 1)]
        bars += [(np.array([thin, y, thin]), np.array([s * (x - thin), 0, 0])) for s in (-1, 1)]
        solid = union(box(middle - extent, middle + extent) for extent, middle in bars)
        return solid + box(x - thin, 0.5 * thin, 0.8 * thin)
    if kind == "ring":  # with a spoke, to carry stubs
        radius = min(x, y)
        spoke = box(radius - thin, 0.5 * thin, 0.8 * thin)
        return ring((0, 0, 0), (0, 0, 1), radius - 2 * thin, radius, 2 * thin, 16) + spoke
    if kind == "bar":
        return box(0.4 * x, 0.4 * y, 1.6 * z)
    if kind == "cross":
        return box((-x, -thin, -thin), (x, thin, thin)) + box((-thin, -y, -thin), (thin, y, thin)) + box(thin, thin, z)
    if kind == "wedge":
        return hull([(-x, -y, -z), (x, -y, -z), (-x, y, -z), (x, y, -z), (-x, -y, z), (-x, y, z)])
    return box(-half, half)


def _motion(draws: Draws, branch: _Branch, siblings: list[_Motion]) -> _Motion:
    """A joint for a branch; by chance one that follows the joint of a sibling."""
    bounds = branch.boxes[0]
    extent = float((bounds[1] - bounds[0]).max())
    axis, origin = np.array([0.0, 0.0, 1.0]), np.zeros(3)
    if branch.hinge_height is not None:
        axis = np.eye(3)[draws.one_of("hinge_axis", {"x": 0, "y": 1})]
        origin = np.array([0.0, 0.0, branch.hinge_height])
        lower, upper = -draws.angle("hinge_lower", (0.0, 1.3)), draws.angle("hinge_upper", (0.3, 1.3))
        return _Motion("revolute", axis, origin, lower, upper)
    leaders = [i for i, motion in enumerate(siblings) if motion.follows is None and motion.type != "screw"]
    if leaders and draws.chance("follows", 0.4):
        source = draws.pick("leader", leaders)
        leader, multiplier = siblings[source], draws.pick("ratio", [-1.0, 0.5, 1.0])
        lower, upper = sorted((multiplier * leader.lower, multiplier * leader.upper))
        return _Motion(leader.type, axis, origin, lower, upper, 0.0, source, multiplier)
    kind = draws.pick("joint", JOINTS)
    if draws.chance("oblique", 0.15):
        axis = unit(axis + draws.rng.normal(0.0, 0.2, 3))
    if kind == "prismatic":
        return _Motion(kind, axis, origin, 0.0, draws.number("travel", (0.2, 0.9)) * extent)
    if kind == "screw":
        turns = draws.number("screw_turns", (0.5, 3.0)) * 2.0 * np.pi
        return _Motion(kind, axis, origin, 0.0, turns, draws.number("screw_travel", (0.2, 0.6)) * extent / turns)
    if kind == "continuous":
        return _Motion(kind, axis, origin, -np.inf, np.inf)
    return _Motion(kind, axis, origin, -draws.angle("lower", (0.0, 1.5)), draws.angle("upper", (0.3, 1.5)))


def _attach(
    draws: Draws, parent: _Branch, child: _Branch, motion: _Motion, faces: list[tuple[int, int]], bounds: Array
) -> tuple[int, int] | None:
    """Hang a branch on a free face of its parent, on a stub just long enough to keep all boxes apart.

    The first face that a short stub will do for is taken, or else the one with the shortest, and returned; None, and
    no branch, where there is no room on any.
    """
    radius = 0.1 * float((bounds[1] - bounds[0]).min()) + 0.002
    swept = np.array([motion.reached(b) for b in child.boxes])
    while child.hinge_height is not None and swept[:, 0, 2].min() < -_DEEPEST_DIP:
        motion.lower, motion.upper = 0.8 * motion.lower, 0.8 * motion.upper
        swept = np.array([motion.reached(b) for b in child.boxes])
    # Boxes over the stub's end must lie above it.
    over = (swept[:, 0, :2] < 1.5 * radius).all(axis=1) & (swept[:, 1, :2] > -1.5 * radius).all(axis=1)
    lift = GAP - min(0.0, float(swept[over, 0, 2].min()))
    inner = 0.5 * (bounds[0] + bounds[1])
    shortest, chosen = np.inf, None
    for choice in draws.rng.permutation(len(faces)):
        if chosen is not None and shortest < 0.05:
            break
        axis, side = faces[choice]
        askew = draws.chance("askew", 0.3)
        turn = draws.angle("turn", (0, 2 * np.pi)) if askew else 0.5 * np.pi * draws.integer("quarter_turns", 0, 3)
        # (3, 3) rotation that takes z to a coordinate direction.
        normal = side * np.eye(3)[axis]
        u = np.abs(np.roll(normal, 1))
        rotation = matmul(np.column_stack([u, np.cross(normal, u), normal]), rotation_about((0, 0, 1), turn))
        reach = np.array([_box_around(matmul(_corners(b), rotation.T)) for b in swept])
        across = np.arange(3) != axis
        surface = float(bounds[1, axis] if side > 0 else bounds[0, axis])
        for stub in _STUBS:
            if stub >= shortest:
                break
            start, end = (np.where(across, inner, surface + side * s) for s in (0.0, stub))
            stem = _box_around(np.stack([start, end])) + np.array([[-radius], [radius]]) * across
            foot = np.where(across, inner, surface + side * (stub + lift))
            if not _meet(reach + foot, np.array(parent.boxes)) and not _meet(stem[None], np.array(parent.boxes[1:])):
                shortest, chosen = stub, (choice, rotation, foot, end, [*(reach + foot), stem])
                break
    if chosen is None:
        return None
    choice, rotation, foot, end, taken = chosen
    parent.solid += tube([inner, end], radius, 8)
    parent.boxes += taken
    parent.children.append((child, motion, rotation, foot))
    return faces[choice]


def _corners(bounds: Array) -> Array:
    """(8, 3) corners of a box."""
    return np.array(list(product(*bounds.T)))


def _box_around(points: Array) -> Array:
    """(2, 3) box of points."""
    return np.stack([points.min(axis=0), points.max(axis=0)])


def _meet(first: Array, second: Array) -> bool:
    """Whether any of (M, 2, 3) boxes comes closer than nearly the gap to any of (N, 2, 3) others."""
    if not len(second):
        return False
    below = (first[:, None, 0] < second[None, :, 1] + 0.9 * GAP).all(axis=-1)
    above = (second[None, :, 0] < first[:, None, 1] + 0.9 * GAP).all(axis=-1)
    return bool((below & above).any())


def _put(
    tree: Assembly, branch: _Branch, names: Iterator[str], joint: JointSpec | None, rotation: Array, position: Array
) -> str:
    """Add a branch to the assembly, its frame standing at the given pose; returns the name of its part."""
    name = tree.add(next(names), branch.solid.rotated(rotation).moved(position), joint)
    siblings: list[str] = []
    for child, motion, R_branch_child, foot in branch.children:
        R, at = matmul(rotation, R_branch_child), apply(rotation, foot) + position
        mimic = None if motion.follows is None else (siblings[motion.follows], motion.multiplier)
        axis, origin = apply(R, motion.axis), apply(R, motion.origin) + at
        spec = JointSpec(motion.type, name, axis, origin, motion.lower, motion.upper, motion.pitch, mimic)
        siblings.append(_put(tree, child, names, spec, R, at))
    return name
