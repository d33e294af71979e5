"""Loops around the rays: what is worked out for every pixel, ray and point.

Nothing here contracts or reorders floating-point operations, so that clouds are the same bytes on every processor.
"""

from typing import Any

import numpy as np

from artsim.common.compiled import compiled_exactly
from artsim.model.frame import BACKGROUND

_BACKGROUND = np.uint8(BACKGROUND)


@compiled_exactly
def spans(
    T: Any, corners: Any, scale: float, has_surface: Any, K: Any, height: int,
    tangents: Any, slopes: Any, margins: Any, margin: float,
) -> Any:  # fmt: skip
    """Row spans of outlines and their rows; see :func:`artsim.renderers.outlines.outline_spans`."""
    parts, count, tilts = corners.shape[0], corners.shape[2], len(tangents)
    bounds = np.empty((parts, 2, tilts), np.float32)
    row_ranges = np.empty((parts, 2), np.int64)
    behind = np.zeros(parts, np.int64)
    u, v = np.empty(count), np.empty(count)
    for k in range(parts):
        for c in range(count):
            x, y, z = corners[k, 0, c] * scale, corners[k, 1, c] * scale, corners[k, 2, c] * scale
            a = ((T[k, 0, 0] * x + T[k, 0, 1] * y) + T[k, 0, 2] * z) + T[k, 0, 3]
            b = ((T[k, 1, 0] * x + T[k, 1, 1] * y) + T[k, 1, 2] * z) + T[k, 1, 3]
            depth = ((T[k, 2, 0] * x + T[k, 2, 1] * y) + T[k, 2, 2] * z) + T[k, 2, 3]
            behind[k] += not depth > 0
            over = depth if depth > 0 else np.inf
            u[c] = min(max(((K[0, 0] * a + K[0, 1] * b) + K[0, 2] * depth) / over, -1e6), 1e6)
            v[c] = min(max(((K[1, 0] * a + K[1, 1] * b) + K[1, 2] * depth) / over, -1e6), 1e6)
        row_ranges[k, 0] = int(min(max(np.ceil((v.min() - margin) - 0.5), 0.0), height))
        row_ranges[k, 1] = int(min(max(np.ceil(((v.max() + 1.0) + margin) - 0.5), 0.0), height))
        for t in range(tilts):
            least, most = np.inf, -np.inf
            for c in range(count):
                across = u[c] + v[c] * tangents[t]
                least, most = min(least, across), max(most, across)
            bounds[k, 0, t] = np.float32((least - margins[t]) - 0.5)
            bounds[k, 1, t] = np.float32((-most - margins[t]) + 0.5)
    first, end = row_ranges[:, 0].min(), row_ranges[:, 1].max()
    found = np.empty((parts, 2, height), np.float32)
    for k in range(parts):
        found[k, 0], found[k, 1] = np.inf, -np.inf
        if behind[k] == count or not has_surface[k]:
            row_ranges[k] = 0
            continue
        if behind[k]:  # reaches behind the camera: it may cover any pixel
            found[k, 0], found[k, 1] = -np.inf, np.inf
            row_ranges[k, 0], row_ranges[k, 1] = 0, height
            continue
        for r in range(first, end):
            row = np.float32(r) + np.float32(0.5)
            most = bounds[k, 0, 0] - slopes[0, 0] * row
            for t in range(1, tilts):
                most = max(most, bounds[k, 0, t] - slopes[0, t] * row)
            found[k, 0, r] = most
        for r in range(row_ranges[k, 0], row_ranges[k, 1]):
            row = np.float32(r) + np.float32(0.5)
            most = bounds[k, 1, 0] - slopes[1, 0] * row
            for t in range(1, tilts):
                most = max(most, bounds[k, 1, t] - slopes[1, t] * row)
            found[k, 1, r] = -most
    return found, row_ranges


@compiled_exactly
def columns(spans: Any, width: int) -> Any:
    """First and end column of each row's candidates; see :meth:`artsim.renderers.raycast.PosedObject.candidates`."""
    parts, height = len(spans), spans.shape[2]
    first, end = np.empty(height, np.int64), np.empty(height, np.int64)
    for r in range(height):
        low, high = spans[0, 0, r], spans[0, 1, r]
        for k in range(1, parts):
            low, high = min(low, spans[k, 0, r]), max(high, spans[k, 1, r])
        first[r] = int(min(max(np.ceil(low), np.float32(0)), np.float32(width)))
        end[r] = max(int(min(max(np.floor(high) + np.float32(1), np.float32(0)), np.float32(width))), first[r])
    return first, end


@compiled_exactly
def set_out(T: Any, scale: float) -> Any:
    """Rotations (K, 3, 3) from each part to the camera, and the camera's place (K, 3) in each part, native units."""
    rotations, origins = np.empty((len(T), 3, 3), np.float32), np.empty((len(T), 3), np.float32)
    for k in range(len(T)):
        for i in range(3):
            for j in range(3):
                rotations[k, i, j] = np.float32(T[k, i, j])
            place = (T[k, 0, i] * T[k, 0, 3] + T[k, 1, i] * T[k, 1, 3]) + T[k, 2, i] * T[k, 2, 3]
            origins[k, i] = np.float32(place / -scale)
    return rotations, origins


@compiled_exactly
def unvisited(drawn: Any, fresh: Any, up_to: Any, end: Any) -> Any:
    """Row and column of the candidates drawn, in ascending order, that are still ``fresh`` (total,): then no longer.

    See :func:`pixels_of` for the others.
    """
    row, column = np.empty(len(drawn), np.int64), np.empty(len(drawn), np.int64)
    m = r = 0
    for number in drawn:
        if fresh[number]:
            fresh[number] = False
            while up_to[r] <= number:
                r += 1
            row[m], column[m] = r, number + end[r] - up_to[r]
            m += 1
    return row[:m], column[:m]


@compiled_exactly
def hits(row: Any, column: Any, depth: Any, part: Any, width: int) -> Any:
    """Flat indices, depth and part of the pixels that show a part."""
    count = 0
    for k in part:
        count += k != _BACKGROUND
    pixels, depths, parts = np.empty(count, np.int64), np.empty(count, np.float32), np.empty(count, np.uint8)
    m = 0
    for i in range(len(part)):
        if part[i] != _BACKGROUND:
            pixels[m], depths[m], parts[m] = row[i] * width + column[i], depth[i], part[i]
            m += 1
    return pixels, depths, parts


@compiled_exactly
def pixels_of(numbers: Any, up_to: Any, end: Any) -> Any:
    """Row and column of candidates, of which ``up_to`` (H,) stand up to the end of each row, at column ``end`` (H,)."""
    row, column = np.empty(len(numbers), np.int64), np.empty(len(numbers), np.int64)
    r = 0
    for i in range(len(numbers)):
        while up_to[r] <= numbers[i]:
            r += 1
        row[i], column[i] = r, numbers[i] + end[r] - up_to[r]
    return row, column


@compiled_exactly
def ray_set_up(row: Any, column: Any, row_ranges: Any, spans: Any, rotations: Any, K: Any) -> Any:
    """Which rays to cast at each part, and their directions in its rest frame.

    Returns
    -------
    rays : (M,) int64
        Those of the first part first.
    directions : (M, 3) float32
    ends : (K + 1,) int64
        Where the rays of each part end.
    """
    count, parts = len(row), len(spans)
    half, one = np.float32(0.5), row_ranges.copy()
    x, y = np.empty(count, np.float32), np.empty(count, np.float32)
    for i in range(count):
        y[i] = (np.float32(row[i]) + (half - K[1, 2])) / K[1, 1]
        x[i] = ((np.float32(column[i]) + (half - K[0, 2])) - K[0, 1] * y[i]) / K[0, 0]
    most = 0
    for k in range(parts):
        one[k, 0] = np.searchsorted(row, row_ranges[k, 0])
        one[k, 1] = max(np.searchsorted(row, row_ranges[k, 1]), one[k, 0])
        most += one[k, 1] - one[k, 0]
    rays, directions = np.empty(most, np.int64), np.empty((most, 3), np.float32)
    ends = np.zeros(parts + 1, np.int64)
    m = 0
    for k in range(parts):
        R = rotations[k]
        for i in range(one[k, 0], one[k, 1]):
            if spans[k, 0, row[i]] <= column[i] <= spans[k, 1, row[i]]:
                rays[m] = i
                for axis in range(3):
                    directions[m, axis] = (x[i] * R[0, axis] + y[i] * R[1, axis]) + R[2, axis]
                m += 1
        ends[k + 1] = m
    return rays[:m], directions[:m], ends


@compiled_exactly
def depths(met: Any, directions: Any, eye: Any, forward: Any, vertices: Any, faces: Any, miss: Any, depth: Any) -> None:
    """Write where rays meet the planes of faces (N,), as multiples of their directions (N, 3); ``miss`` for face -1.

    In double precision, of the vertices that the ray caster has. Directions have the component 1 along ``forward``, so
    that no depth lies outside those of the face's corners, however much it is seen from the side.
    """
    corner, plane = np.empty((3, 3)), np.empty(3)
    for m in range(len(met)):
        if met[m] < 0:
            depth[m] = miss
            continue
        low, high = np.inf, -np.inf
        for c in range(3):
            for axis in range(3):
                corner[c, axis] = np.float64(np.float32(vertices[faces[met[m], c], axis])) - np.float64(eye[axis])
            z = (corner[c, 0] * forward[0] + corner[c, 1] * forward[1]) + corner[c, 2] * forward[2]
            low, high = min(low, z), max(high, z)
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            plane[axis] = (corner[1, i] - corner[0, i]) * (corner[2, j] - corner[0, j]) - (
                corner[1, j] - corner[0, j]
            ) * (corner[2, i] - corner[0, i])
        along = (plane[0] * directions[m, 0] + plane[1] * directions[m, 1]) + plane[2] * directions[m, 2]
        away = (plane[0] * corner[0, 0] + plane[1] * corner[0, 1]) + plane[2] * corner[0, 2]
        depth[m] = min(max(away / along if along != 0.0 else low, low), high)


@compiled_exactly
def nearest(rays: Any, ends: Any, distance: Any, count: int, miss: Any, scale: Any) -> Any:
    """Of each ray the depth and the part of its nearest hit; and of each part how many rays meet it, how many see it.

    Where surfaces of two parts coincide exactly, the part with the lower index is seen.
    """
    parts = len(ends) - 1
    depth, part = np.full(count, miss, np.float32), np.full(count, _BACKGROUND, np.uint8)
    met, saw = np.zeros(parts, np.int64), np.zeros(parts, np.int64)
    for k in range(parts):
        for m in range(ends[k], ends[k + 1]):
            if distance[m] < miss:
                met[k] += 1
                if distance[m] < depth[rays[m]]:
                    depth[rays[m]], part[rays[m]] = distance[m], k
    for i in range(count):
        if part[i] == _BACKGROUND:
            depth[i] = 0.0
        else:
            depth[i] *= scale
            saw[part[i]] += 1
    return depth, part, met, saw


@compiled_exactly
def labels(
    pixels: Any, depth: Any, true_depth: Any, part: Any, width: int, K: Any, T: Any, center: Any, size: Any
) -> Any:
    """Points that a sensor reports at pixels, and the normalised coordinates of the places that the rays truly meet.

    ``R^T (p - t)`` is the inverse transform; the part's centre and its one scale are folded into it.
    """
    table = np.empty((len(T), 4, 3))
    for k in range(len(T)):
        w, h, d = size[k, 0], size[k, 1], size[k, 2]
        length = np.sqrt((w * w + h * h) + d * d)
        length = length if length > 0 else 1.0
        for axis in range(3):
            place = (T[k, 0, axis] * T[k, 0, 3] + T[k, 1, axis] * T[k, 1, 3]) + T[k, 2, axis] * T[k, 2, 3]
            table[k, 3, axis] = 0.5 - (place + center[k, axis]) / length
            for i in range(3):
                table[k, i, axis] = T[k, i, axis] / length
    points, npcs = np.empty((len(pixels), 3), np.float32), np.empty((len(pixels), 3), np.float32)
    for i in range(len(pixels)):
        row, column = pixels[i] // width, pixels[i] % width
        y = ((row + 0.5) - K[1, 2]) / K[1, 1]
        x = (((column + 0.5) - K[0, 2]) - K[0, 1] * y) / K[0, 0]
        z = np.float64(depth[i])
        points[i, 0], points[i, 1], points[i, 2] = x * z, y * z, z
        z = np.float64(true_depth[i])
        x, y, k = x * z, y * z, part[i]
        for axis in range(3):
            npcs[i, axis] = ((table[k, 0, axis] * x + table[k, 1, axis] * y) + table[k, 2, axis] * z) + table[
                k, 3, axis
            ]
    return points, npcs


@compiled_exactly
def every_nth(first: Any, end: Any, most: int) -> Any:
    """Row and column of each n-th pixel between columns ``first`` and ``end`` (P, H); where those of each part end.

    See :func:`artsim.renderers.raycast.visibility`.
    """
    parts, height = first.shape
    ends, steps = np.zeros(parts + 1, np.int64), np.empty(parts, np.int64)
    for k in range(parts):
        total = (end[k] - first[k]).sum()
        steps[k] = max(1, total // most)
        ends[k + 1] = ends[k] + max(0, total - steps[k] // 2 + steps[k] - 1) // steps[k]
    row, column = np.empty(ends[-1], np.int64), np.empty(ends[-1], np.int64)
    for k in range(parts):
        number, before, m = steps[k] // 2, 0, ends[k]
        for r in range(height):
            up_to = before + end[k, r] - first[k, r]
            while number < up_to:
                row[m], column[m] = r, first[k, r] + number - before
                number += steps[k]
                m += 1
            before = up_to
    return row, column, ends


@compiled_exactly
def part_directions(row: Any, column: Any, ends: Any, rotations: Any, K: Any) -> Any:
    """(N, 3) directions of rays through pixels in the rest frame of a part: those up to ``ends[k + 1]`` of part k."""
    half = np.float32(0.5)
    directions = np.empty((len(row), 3), np.float32)
    for k in range(len(ends) - 1):
        R = rotations[k]
        for i in range(ends[k], ends[k + 1]):
            y = (np.float32(row[i]) + (half - K[1, 2])) / K[1, 1]
            x = ((np.float32(column[i]) + (half - K[0, 2])) - K[0, 1] * y) / K[0, 0]
            for axis in range(3):
                directions[i, axis] = (x * R[0, axis] + y * R[1, axis]) + R[2, axis]
    return directions
