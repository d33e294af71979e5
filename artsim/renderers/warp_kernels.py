"""What the warp renderer runs on its device. Warp compiles these functions from this file; they are not Python.

Poses are worked out in double precision, one thread for each part of each view; rays are cast in single precision in
the frame of each part, one thread for each pixel.
"""

import warp as wp

wp.set_module_options({"enable_backward": False})

BACKGROUND = wp.constant(wp.uint8(255))
TILE_ROWS = wp.constant(4)
TILE_COLUMNS = wp.constant(8)
_FACTOR_1 = wp.constant(wp.uint32(0x7FEB352D))
_FACTOR_2 = wp.constant(wp.uint32(0x846CA68B))
_FAR = wp.constant(1.0e30)
_MARGIN = wp.constant(wp.float64(0.05))  # pixels: covers single precision


@wp.struct
class Body:
    """One part of one object, for good. Lengths of the mesh and its box are native, those of the joint in metres."""

    mesh: wp.uint64
    low: wp.vec3d
    high: wp.vec3d
    parent: wp.int32
    axis: wp.vec3d
    origin: wp.vec3d
    source: wp.int32  # the joint moves by `gain * q[source] + offset`, counted from rest
    gain: wp.float64
    offset: wp.float64
    turn: wp.float64  # radians about the axis, and metres along it, for each unit of that
    slide: wp.float64


@wp.struct
class Eye:
    """One view as one part sees it: what rays need to know, native units."""

    mesh: wp.uint64
    origin: wp.vec3  # the camera in the part's frame
    from_image: wp.mat33  # image position (u, v, 1) to the direction of its ray, whose z in the camera frame is 1
    low: wp.vec2  # rectangle of the image outside of which no ray meets the part
    high: wp.vec2
    near: wp.float32  # z-depth before which no ray meets it


@wp.func
def motion(body: Body, q: wp.array(dtype=wp.float64)) -> wp.transformd:
    """Motion of a part against its parent: see KinematicTree.motions."""
    step = body.gain * q[body.source] + body.offset
    rotation = wp.quat_from_axis_angle(body.axis, body.turn * step)
    return wp.transformd(body.origin - wp.quat_rotate(rotation, body.origin) + body.slide * step * body.axis, rotation)


@wp.kernel
def pose(
    bodies: wp.array2d(dtype=Body),
    num_parts: wp.array(dtype=wp.int32),
    scales: wp.array(dtype=wp.float64),
    objects: wp.array(dtype=wp.int32),
    q: wp.array2d(dtype=wp.float64),
    T_camera_object: wp.array(dtype=wp.mat44d),
    K: wp.array(dtype=wp.mat33d),
    T_camera_part: wp.array2d(dtype=wp.mat44d),
    eyes: wp.array2d(dtype=Eye),
):
    """(view, part): where the part is, and the view as the part sees it."""
    view, k = wp.tid()
    number = objects[view]
    if k >= num_parts[number]:
        return
    T_rest_part = motion(bodies[number, k], q[view])
    parent = bodies[number, k].parent
    while parent >= 0:
        T_rest_part = motion(bodies[number, parent], q[view]) * T_rest_part
        parent = bodies[number, parent].parent
    T = T_camera_object[view] * wp.transform_to_matrix(T_rest_part)
    T_camera_part[view, k] = T
    eyes[view, k] = look(bodies[number, k], T, K[view], scales[number])


@wp.func
def look(body: Body, T: wp.mat44d, K: wp.mat33d, scale: wp.float64) -> Eye:
    """The view as a part sees it that is placed by ``T``."""
    rotation = wp.mat33d(T[0, 0], T[0, 1], T[0, 2], T[1, 0], T[1, 1], T[1, 2], T[2, 0], T[2, 1], T[2, 2])
    translation = wp.vec3d(T[0, 3], T[1, 3], T[2, 3]) / scale
    far = wp.float64(_FAR)
    low, high = wp.vec2d(far, far), wp.vec2d(-far, -far)
    near, nearly_far = far, -far
    for corner in range(8):
        right, back, top = wp.float64(corner & 1), wp.float64((corner >> 1) & 1), wp.float64(corner >> 2)
        seen = rotation * (body.low + wp.cw_mul(wp.vec3d(right, back, top), body.high - body.low)) + translation
        near, nearly_far = wp.min(near, seen[2]), wp.max(nearly_far, seen[2])
        if seen[2] > wp.float64(0.0):
            image = K * seen / seen[2]
            low = wp.min(low, wp.vec2d(image[0], image[1]))
            high = wp.max(high, wp.vec2d(image[0], image[1]))
    if near <= wp.float64(0.0):  # reaches behind the camera: it may cover any pixel
        low, high = wp.vec2d(-far, -far), wp.vec2d(far, far)
    eye = Eye()
    eye.mesh = body.mesh
    if body.mesh == wp.uint64(0) or nearly_far <= wp.float64(0.0):  # none: nothing is seen
        low, high = wp.vec2d(far, far), wp.vec2d(-far, -far)
    eye.origin = wp.vec3(-wp.transpose(rotation) * translation)
    eye.from_image = wp.mat33(wp.transpose(rotation) * wp.inverse(K))
    eye.low = wp.vec2(low - wp.vec2d(_MARGIN, _MARGIN))
    eye.high = wp.vec2(high + wp.vec2d(_MARGIN, _MARGIN))
    eye.near = wp.float32(near - wp.float64(1.0e-5) * wp.abs(nearly_far))
    return eye


@wp.kernel
def cast(
    eyes: wp.array2d(dtype=Eye),
    num_parts: wp.array(dtype=wp.int32),
    scales: wp.array(dtype=wp.float64),
    objects: wp.array(dtype=wp.int32),
    depth: wp.array3d(dtype=wp.float32),
    part_ids: wp.array3d(dtype=wp.uint8),
):
    """(view, tile row, tile column, lane): the nearest part at one pixel.

    The 32 threads that a GPU runs in step look through one tile of neighbouring pixels. Where surfaces of two parts
    coincide exactly, the part with the lower index is seen.
    """
    view, tile_row, tile_column, lane = wp.tid()
    row, column = tile_row * TILE_ROWS + lane // TILE_COLUMNS, tile_column * TILE_COLUMNS + lane % TILE_COLUMNS
    if row >= depth.shape[1] or column >= depth.shape[2]:
        return
    u, v = wp.float32(column) + 0.5, wp.float32(row) + 0.5
    number = objects[view]
    nearest, seen = wp.float32(_FAR), wp.uint8(BACKGROUND)
    for k in range(num_parts[number]):
        eye = eyes[view, k]
        if eye.near < nearest and u >= eye.low[0] and u <= eye.high[0] and v >= eye.low[1] and v <= eye.high[1]:
            hit = wp.mesh_query_ray(eye.mesh, eye.origin, eye.from_image * wp.vec3(u, v, 1.0), nearest)
            if hit.result:
                nearest, seen = wp.float32(hit.t), wp.uint8(k)
    part_ids[view, row, column] = seen
    depth[view, row, column] = wp.where(seen == BACKGROUND, 0.0, nearest * wp.float32(scales[number]))


@wp.kernel
def mark(part_ids: wp.array(dtype=wp.uint8), shown: wp.array(dtype=wp.int32)):
    """(pixel of all views): 1 where it shows a part."""
    i = wp.tid()
    shown[i] = wp.where(part_ids[i] == BACKGROUND, 0, 1)


@wp.kernel
def gather(part_ids: wp.array(dtype=wp.uint8), rank: wp.array(dtype=wp.int32), pixels: wp.array(dtype=wp.int32)):
    """(pixel of all views): the pixels that show a part, close together. ``rank`` counts them up to each pixel."""
    i = wp.tid()
    if part_ids[i] != BACKGROUND:
        pixels[rank[i] - 1] = i


@wp.func
def mix(x: wp.uint32) -> wp.uint32:
    """A hash of 32 bits, with the constants that Wellons found (hash-prospector, "lowbias32")."""
    x = (x ^ (x >> wp.uint32(16))) * _FACTOR_1
    x = (x ^ (x >> wp.uint32(15))) * _FACTOR_2
    return x ^ (x >> wp.uint32(16))


@wp.func
def permuted(x: wp.uint32, half: wp.uint32, key: wp.uint32) -> wp.uint32:
    """A random permutation of the numbers of ``2 * half`` bits: a Feistel network."""
    mask = (wp.uint32(1) << half) - wp.uint32(1)
    left, right = x >> half, x & mask
    for turn in range(6):
        left ^= mix(right ^ mix(key + wp.uint32(turn))) & mask
        left, right = right, left
    return (left << half) | right


@wp.func
def shuffled(i: wp.int32, count: wp.int32, key: wp.uint32) -> wp.int32:
    """Place of ``i`` in a random permutation of ``count`` numbers: one of more numbers, walked until it is back."""
    half = wp.uint32(3)
    while (wp.int64(1) << wp.int64(wp.uint32(2) * half)) < wp.int64(count):
        half += wp.uint32(1)
    x = permuted(wp.uint32(i), half, key)
    while x >= wp.uint32(count):
        x = permuted(x, half, key)
    return wp.int32(x)


@wp.kernel
def draw(
    depth: wp.array3d(dtype=wp.float32),
    part_ids: wp.array3d(dtype=wp.uint8),
    K: wp.array(dtype=wp.mat33d),
    rank: wp.array(dtype=wp.int32),
    pixels: wp.array(dtype=wp.int32),
    seed: wp.uint32,
    points: wp.array2d(dtype=wp.vec3),
    part: wp.array2d(dtype=wp.uint8),
):
    """(view, point): a pixel of the view that shows a part, all different while there are any left."""
    view, i = wp.tid()
    width = depth.shape[2]
    size = depth.shape[1] * width
    before = wp.int32(0)
    if view > 0:
        before = rank[view * size - 1]
    count = rank[(view + 1) * size - 1] - before
    part[view, i] = BACKGROUND
    if count == 0:
        return
    key = mix(seed + mix(wp.uint32(view)))
    choice = wp.int32(mix(key + wp.uint32(i)) % wp.uint32(count))
    if i < count:
        choice = shuffled(i, count, key)
    pixel = pixels[before + choice] - view * size
    row, column = pixel // width, pixel % width
    image = wp.vec3d(wp.float64(column) + wp.float64(0.5), wp.float64(row) + wp.float64(0.5), wp.float64(1.0))
    points[view, i] = wp.vec3(wp.inverse(K[view]) * image * wp.float64(depth[view, row, column]))
    part[view, i] = part_ids[view, row, column]
