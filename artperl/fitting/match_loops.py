"""Compiled :mod:`artperl.fitting.correspondence` of one object: its parts are posed, and each point is matched.

Distances that choose a disc, or a ray, are in single precision; everything else is in double precision.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from artperl.fitting.arrays import Array, Indices, Reference, State, Tree, View
from artperl.fitting.correspondence import BACK_FACE, DISC_RADIUS, OUTLINE_POINTS, TANGENT_WEIGHT
from artsim.common.compiled import compiled

Single = NDArray[np.float32]
Bits = NDArray[np.int32]

_ZERO, _MOST = np.float32(0.0), 2**31 - 1
_RUN = 64
"""Distances of which the least is looked for at once, before it is known which of them it is."""
_LOOK = 8
"""Points after which a pose may be given up."""


class Posed(NamedTuple):
    """See :class:`artperl.core.pose.Posed`; ``above`` and ``anchor`` (P, 3, 3), (P, 3) are the pose of each parent."""

    rotation: Array
    translation: Array
    center: Array
    origin: Array
    scale: Array
    reach: Array
    above: Array
    anchor: Array


class Rows(NamedTuple):
    """Distances between a cloud and a posed reference. Camera frame; R rows: observed points, then outline points.

    Attributes
    ----------
    point : (R, 3) float
        Where a distance is measured.
    part : (R,) int64
        Part of the reference that it depends on.
    local : (R, 3) float
        The reference's own point, in its rest frame.
    normal, tangent : (R, 3) float
        Unit directions in which the point is off.
    residual : (R, 2) float
        By how much, in diagonals; the second counts ``TANGENT_WEIGHT`` times.
    weight : (R,) float
    """

    point: Array
    part: Indices
    local: Array
    normal: Array
    tangent: Array
    residual: Array
    weight: Array


@compiled
def pose(tree: Tree, box_center: Array, state: State) -> Posed:
    """See :func:`artperl.core.pose.pose_parts`."""
    P = len(tree.parent)
    rotation, translation, above, anchor = np.empty((P, 3, 3)), np.empty((P, 3)), np.empty((P, 3, 3)), np.empty((P, 3))
    center, origin, scale, reach = np.empty((P, 3)), np.empty((P, 3)), np.empty((P, 3)), np.ones(P)
    turn, shift = np.empty((3, 3)), np.empty(3)
    for k in tree.order:
        for i in range(3):
            shift[i] = 0.0
            for j in range(P):
                if tree.carries[j, k]:
                    shift[i] += state.shift[j, i]
            whole = np.exp(state.log_scale[i])
            center[k, i] = whole * box_center[k, i] + shift[i]
            origin[k, i] = whole * tree.origin[k, i] + shift[i]
            scale[k, i] = np.exp(state.log_scale[i] + state.stretch[k, i])
        if tree.slide[k] != 0.0:
            reach[k] = 0.0
            for i in range(3):
                reach[k] += (np.exp(state.log_scale[i]) * tree.axis[k, i]) ** 2
            reach[k] = np.sqrt(reach[k])
        value = tree.rest[k] + tree.offset[k]
        if tree.multiplier[k] != 0.0:
            value = tree.multiplier[k] * state.state[tree.source[k]] + tree.offset[k]
        step = value - tree.rest[k]
        rotate_about(tree.axis[k], step * tree.turn[k], turn)
        parent = tree.parent[k]
        root = parent == k
        for i in range(3):
            for j in range(3):
                above[k, i, j] = state.rotation[i, j] if root else rotation[parent, i, j]
            anchor[k, i] = state.translation[i] if root else translation[parent, i]
        for i in range(3):
            moved = origin[k, i] + step * tree.slide[k] * reach[k] * tree.axis[k, i]
            for j in range(3):
                moved -= turn[i, j] * origin[k, j]
            shift[i] = moved
        for i in range(3):
            translation[k, i] = anchor[k, i]
            for j in range(3):
                translation[k, i] += above[k, i, j] * shift[j]
                rotation[k, i, j] = 0.0
                for m in range(3):
                    rotation[k, i, j] += above[k, i, m] * turn[m, j]
    # The parent of the root is, as everywhere, the root as it is posed.
    above[0], anchor[0] = rotation[0], translation[0]
    return Posed(rotation, translation, center, origin, scale, reach, above, anchor)


@compiled
def rotate_about(axis: Array, angle: float, out: Array) -> None:
    """Rodrigues' formula for a unit axis (3,), into (3, 3)."""
    sine, less = np.sin(angle), 1.0 - np.cos(angle)
    x, y, z = axis[0], axis[1], axis[2]
    out[0, 0], out[0, 1], out[0, 2] = 1.0 - less * (y * y + z * z), less * x * y - sine * z, less * x * z + sine * y
    out[1, 0], out[1, 1], out[1, 2] = less * x * y + sine * z, 1.0 - less * (x * x + z * z), less * y * z - sine * x
    out[2, 0], out[2, 1], out[2, 2] = less * x * z - sine * y, less * y * z + sine * x, 1.0 - less * (x * x + y * y)


@compiled
def match(tree: Tree, shape: Reference, view: View, state: State, outline_weight: float) -> tuple[Posed, Rows]:
    """See :func:`artperl.fitting.correspondence.match`."""
    posed = pose(tree, shape.box_center, state)
    P, M, N = len(shape.points), shape.points.shape[2], len(view.points)
    few = min(OUTLINE_POINTS, M) if outline_weight > 0.0 else 0
    R = N + P * few
    rows = Rows(
        np.empty((R, 3)), np.empty(R, dtype=np.int64), np.empty((R, 3)), np.empty((R, 3)), np.zeros((R, 3)),
        np.zeros((R, 2)), np.zeros(R),
    )  # fmt: skip
    points, normals = np.empty((P, 3, M)), np.empty((P, 3, M))
    discs = np.empty((P, 10, M), dtype=np.float32)
    for k in range(P):
        _pose_discs(shape, posed, k, points[k], normals[k])
        _describe_discs(points[k], normals[k], view.middle, view.unit, discs[k])
    _match_surface(shape, view, posed, points, normals, discs, rows, 0, N)
    if few > 0:
        _match_outline(shape, view, points, few, outline_weight, rows)
    return posed, rows


@compiled
def _pose_discs(shape: Reference, posed: Posed, k: int, points: Array, normals: Array) -> None:
    """Points and normals (3, M) of a part's surface in the camera frame."""
    R, scale = posed.rotation[k], posed.scale[k]
    # Numbers are read before the loop, since the compiler cannot know that it leaves them as they are.
    a, b, c, d, e, f, g, h, i = R[0, 0], R[0, 1], R[0, 2], R[1, 0], R[1, 1], R[1, 2], R[2, 0], R[2, 1], R[2, 2]
    sx, sy, sz = scale[0], scale[1], scale[2]
    tx, ty, tz = posed.translation[k, 0], posed.translation[k, 1], posed.translation[k, 2]
    cx = posed.center[k, 0] - sx * shape.box_center[k, 0]
    cy = posed.center[k, 1] - sy * shape.box_center[k, 1]
    cz = posed.center[k, 2] - sz * shape.box_center[k, 2]
    own, facing = shape.points[k], shape.normals[k]
    for m in range(own.shape[1]):
        x, y, z = cx + sx * own[0, m], cy + sy * own[1, m], cz + sz * own[2, m]
        points[0, m] = a * x + b * y + c * z + tx
        points[1, m] = d * x + e * y + f * z + ty
        points[2, m] = g * x + h * y + i * z + tz
    for m in range(own.shape[1]):
        u, v, w = facing[0, m] / sx, facing[1, m] / sy, facing[2, m] / sz
        length = 1.0 / max(np.sqrt(u * u + v * v + w * w), 1e-12)
        normals[0, m] = (a * u + b * v + c * w) * length
        normals[1, m] = (d * u + e * v + f * w) * length
        normals[2, m] = (g * u + h * v + i * w) * length


@compiled
def _describe_discs(points: Array, normals: Array, middle: Array, unit: float, discs: Single) -> None:
    """Numbers (10, M) whose product with those of a point is its squared distance from a disc, but for a constant."""
    weight, scale = TANGENT_WEIGHT**2, 1.0 / unit
    mx, my, mz = middle[0], middle[1], middle[2]
    for m in range(points.shape[1]):
        n0, n1, n2 = normals[0, m], normals[1, m], normals[2, m]
        along = points[0, m] * n0 + points[1, m] * n1 + points[2, m] * n2  # below 0 it faces the camera at the origin
        y0, y1, y2 = (points[0, m] - mx) * scale, (points[1, m] - my) * scale, (points[2, m] - mz) * scale
        height = n0 * y0 + n1 * y1 + n2 * y2
        discs[0, m], discs[1, m], discs[2, m] = n0 * n0, n1 * n1, n2 * n2
        discs[3, m], discs[4, m], discs[5, m] = 2.0 * n0 * n1, 2.0 * n1 * n2, 2.0 * n2 * n0
        discs[6, m] = -2.0 * (height * n0 + weight * y0)
        discs[7, m] = -2.0 * (height * n1 + weight * y1)
        discs[8, m] = -2.0 * (height * n2 + weight * y2)
        behind = 0.0 if along < 0.0 else BACK_FACE
        discs[9, m] = height * height + weight * (y0 * y0 + y1 * y1 + y2 * y2) + behind


@compiled
def _nearest_disc(discs: Single, x: Single, costs: Single, bits: Bits) -> int:
    """Disc of (10, M) at the least squared distance of a point with these numbers (10,)."""
    a, b, c, d, e, f, g, h, i, j = x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9]
    for m in range(discs.shape[1]):
        cost = (
            discs[0, m] * a + discs[1, m] * b + discs[2, m] * c + discs[3, m] * d + discs[4, m] * e
            + discs[5, m] * f + discs[6, m] * g + discs[7, m] * h + discs[8, m] * i + discs[9, m] + j
        )  # fmt: skip
        costs[m] = max(cost, _ZERO)
    return _least(bits, discs.shape[1])


@compiled
def _nearest_ray(rays: Single, x: float, y: float, costs: Single, bits: Bits) -> int:
    """Ray of (3, N) that is nearest on the image plane."""
    u, v, own = np.float32(-2.0 * x), np.float32(-2.0 * y), np.float32(x * x + y * y)
    for n in range(rays.shape[1]):
        costs[n] = max(rays[0, n] * u + rays[1, n] * v + rays[2, n] + own, _ZERO)
    return _least(bits, rays.shape[1])


@compiled
def _least(bits: Bits, count: int) -> int:
    """Index of the least of the first costs, which are not negative.

    Their bits, taken for whole numbers, are in the same order, and least whole numbers are found in wide registers.
    """
    best, run = np.int32(_MOST), 0
    for begin in range(0, count, _RUN):
        least = np.int32(_MOST)
        for m in range(begin, min(begin + _RUN, count)):
            least = min(least, bits[m])
        if least < best:
            best, run = least, begin
    for m in range(run, min(run + _RUN, count)):
        if bits[m] <= best:
            return m
    return run


@compiled
def _match_surface(
    shape: Reference, view: View, posed: Posed, points: Array, normals: Array, discs: Single, rows: Rows,
    begin: int, end: int,
) -> None:  # fmt: skip
    """The first rows, of some of the observed points and their discs."""
    costs, x, apart = np.empty(points.shape[2], dtype=np.float32), np.empty(10, dtype=np.float32), np.empty(3)
    bits, weight = costs.view(np.int32), TANGENT_WEIGHT**2
    for n in range(begin, end):
        k = view.part[n]
        a = (view.points[n, 0] - view.middle[0]) / view.unit
        b = (view.points[n, 1] - view.middle[1]) / view.unit
        c = (view.points[n, 2] - view.middle[2]) / view.unit
        x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8] = a * a, b * b, c * c, a * b, b * c, c * a, a, b, c
        x[9] = weight * (a * a + b * b + c * c)
        m = _nearest_disc(discs[k], x, costs, bits)
        offset, square = 0.0, 0.0
        for i in range(3):
            apart[i] = view.points[n, i] - points[k, i, m]
            offset += apart[i] * normals[k, i, m]
            rows.point[n, i], rows.local[n, i], rows.normal[n, i] = (
                view.points[n, i],
                shape.points[k, i, m],
                normals[k, i, m],
            )
        for i in range(3):
            apart[i] -= offset * normals[k, i, m]
            square += apart[i] * apart[i]
        length = np.sqrt(square)
        for i in range(3):
            rows.tangent[n, i] = apart[i] / max(length, 1e-12)
        radius = DISC_RADIUS * shape.spacing[k] * (posed.scale[k, 0] + posed.scale[k, 1] + posed.scale[k, 2]) / 3.0
        rows.part[n] = k
        rows.residual[n, 0] = offset / view.unit
        # A part without a surface is at no distance from the points that are labelled as it.
        if shape.spacing[k] < np.inf:
            rows.residual[n, 1] = max(length - radius, 0.0) / view.unit
            rows.weight[n] = view.share[n]


@compiled
def _match_outline(shape: Reference, view: View, points: Array, few: int, outline_weight: float, rows: Rows) -> None:
    """The last rows: points of the reference that must appear within the outline."""
    N, P = len(view.points), len(points)
    costs, solid = np.empty(view.rays.shape[1], dtype=np.float32), 0
    bits = costs.view(np.int32)
    for k in range(P):
        solid += shape.spacing[k] < np.inf
    for k in range(P):
        for m in range(few):
            row = N + k * few + m
            depth = max(points[k, 2, m], 1e-6)
            x, y = points[k, 0, m] / depth, points[k, 1, m] / depth
            rows.part[row] = k
            for i in range(3):
                rows.point[row, i], rows.local[row, i], rows.normal[row, i] = (
                    points[k, i, m],
                    shape.points[k, i, m],
                    0.0,
                )
            if not shape.spacing[k] < np.inf:
                continue
            rows.weight[row] = outline_weight / (few * solid)
            nearest = _nearest_ray(view.rays, x, y, costs, bits)
            u, v = x - view.rays[0, nearest], y - view.rays[1, nearest]
            length = np.sqrt(u * u + v * v)
            excess = length - view.gap
            if excess > 0.0:
                u, v = u / max(length, 1e-12), v / max(length, 1e-12)
                # depth * length grows by outwards . (dx - rays * dz) with the point; residuals fall along normals.
                rows.normal[row, 0], rows.normal[row, 1], rows.normal[row, 2] = -u, -v, u * x + v * y
                rows.residual[row, 0] = depth * excess / view.unit


@compiled
def robust_sum(rows: Rows, begin: int, end: int, width: float) -> float:
    """Robust squared distances, weighted, of some rows: see :mod:`artperl.fitting.levenberg_marquardt`."""
    total, wide = 0.0, width * width
    for r in range(begin, end):
        square = rows.residual[r, 0] ** 2 + (TANGENT_WEIGHT * rows.residual[r, 1]) ** 2
        total += rows.weight[r] * wide * square / (wide + square)
    return total


@compiled
def misfits(
    shape: Reference, view: View, rotation: Array, translation: Array, before: Array, keep: int, outline_weight: float,
    width: float,
) -> Array:  # fmt: skip
    """Robust distances of a cloud from an object of one part in many poses, and what was known before.

    Sums only grow. So a pose is given up once its sum is beyond those of as many others as are kept.

    Parameters
    ----------
    rotation, translation : (B, 3, 3), (B, 3) float
    before : (B,) float
    keep : int

    Returns
    -------
    (B,) float
        Infinite for poses that are given up.
    """
    M, N = shape.points.shape[2], len(view.points)
    few = min(OUTLINE_POINTS, M) if outline_weight > 0.0 else 0
    R = N + few
    rows = Rows(
        np.empty((R, 3)), np.empty(R, dtype=np.int64), np.empty((R, 3)), np.empty((R, 3)), np.zeros((R, 3)),
        np.zeros((R, 2)), np.zeros(R),
    )  # fmt: skip
    points, normals, discs = np.empty((1, 3, M)), np.empty((1, 3, M)), np.empty((1, 10, M), dtype=np.float32)
    scale, reach, least, total = np.ones((1, 3)), np.ones(1), np.full(keep, np.inf), np.full(len(before), np.inf)
    for b in range(len(before)):
        worst, own = least[keep - 1], before[b]
        if own >= worst:
            continue
        R1, t1 = rotation[b : b + 1], translation[b : b + 1]
        posed = Posed(R1, t1, shape.box_center, shape.box_center, scale, reach, R1, t1)
        _pose_discs(shape, posed, 0, points[0], normals[0])
        _describe_discs(points[0], normals[0], view.middle, view.unit, discs[0])
        rows.residual[:], rows.weight[:] = 0.0, 0.0
        for begin in range(0, N, _LOOK):
            end = min(begin + _LOOK, N)
            _match_surface(shape, view, posed, points, normals, discs, rows, begin, end)
            own += robust_sum(rows, begin, end, width)
            if own >= worst:
                break
        if own >= worst:
            continue
        if few > 0:
            _match_outline(shape, view, points, few, outline_weight, rows)
            own += robust_sum(rows, N, R, width)
        if own < worst:
            total[b] = own
            at = keep - 1
            while at > 0 and least[at - 1] > own:
                least[at] = least[at - 1]
                at -= 1
            least[at] = own
    return total
