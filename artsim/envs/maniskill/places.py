"""Where things are: objects on the ground, handles on their parts, the robot before them, and who looks on."""

import numpy as np

from artsim.envs.maniskill.goal import LEAST_OPEN, MOST_OPEN, Goal
from artsim.envs.maniskill.robots import FLOATING, ROBOTS
from artsim.model.camera import look_at_transform
from artsim.model.draws import bounding_sphere, farther_ends
from artsim.model.joints import ROTATING
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.physics.episode import most_open_state

_FACING_DOWN = (0.0, 0.0, 0.0, 0.0, np.pi, 0.0, 0.04, 0.04)  # of a floating hand
SLICE = 0.1
"""Share of a part's reach that its handle lies in."""
ONLOOKER_FOV = 0.8
"""Vertical field of view of the camera that shows everything, radians."""
_NEAR, _FAR = 0.18, 0.38  # metres between an arm's hand as it begins and the handles
_CLEARANCE = 0.12  # metres between an object and what stands before it at first
_FINGERS = 0.11  # metres from a hand to the tips of its fingers
_RUN_UP = 0.15  # metres between a hand that is to push and what it pushes


def T_world_object(obj: ArticulatedObject) -> Array:
    """(4, 4) pose of an object that stands on the ground, or, where a joint goes below its foot, just above it."""
    T = np.eye(4)
    T[2, 3] = -min(_least(obj, q, 2) for q in (obj.tree.rest, most_open_state(obj)))
    return T


def handle(obj: ArticulatedObject, k: int) -> Array:
    """Where to take hold of part k to move its joint: the middle of what lies farthest from a hinge's axis, or farthest
    along the way that a slide opens. Of a knob, which is equally far on all sides, it is the side that faces the robot.

    Returns
    -------
    (3,) float
        Rest frame, at rest, metres.
    """
    joint, part = obj.tree.joints[k], obj.parts[k]
    axis, origin = np.asarray(joint.axis), np.asarray(joint.origin)
    if len(part.faces) == 0:
        return origin
    points = part.vertices[np.unique(part.faces)] * obj.scale
    if joint.type in ROTATING:
        arm = points - origin
        arm -= (arm @ axis)[:, None] * axis
        far = np.linalg.norm(arm, axis=1)
        end = far >= (1.0 - SLICE) * far.max()
        facing = arm[end][np.argmin(points[end, 0])]
        there = points[end & (arm @ facing > 0.5 * far * np.linalg.norm(facing))]
    else:
        far = points @ axis * (1.0 if farther_ends(obj)[k] >= joint.rest else -1.0)
        there = points[far >= far.max() - SLICE * (far.max() - far.min())]
    middle: Array = 0.5 * (there.min(axis=0) + there.max(axis=0)) if len(there) else origin
    return middle


def robot_start(obj: ArticulatedObject, robot: str, goal: Goal) -> tuple[Array, Array]:
    """Where a robot begins: an arm on the ground before the object; a floating hand before the handles, or, where
    there is one joint to close, on that side of its handle from which it pushes.

    Returns
    -------
    position : (3,) float
        Of its base, world frame.
    qpos : (D,) float
    """
    up = T_world_object(obj)[:3, 3]
    free = [int(k) for k in obj.tree.free_joints]
    handles = np.mean([handle(obj, k) for k in free], axis=0) + up
    closed = float(obj.bounds[0, 0])
    opened = min(closed, _least(obj, most_open_state(obj), 0))
    start = ROBOTS[robot]
    if robot != FLOATING:
        x = np.clip(opened - _CLEARANCE, handles[0] - _FAR, handles[0] - _NEAR)
        free_until = closed if goal == "open" else opened  # joints that open begin closed
        hand = min(x, free_until - _CLEARANCE)
        return np.array([hand - start.reach, handles[1], 0.0]), np.array(start.qpos)
    if goal == "close" and len(free) == 1:
        at, way = _push(obj, free[0])
        tip = np.maximum(at - _RUN_UP * way + up, [-np.inf, -np.inf, 0.05])
    else:
        tip = np.array([(closed if goal == "open" else opened) - _CLEARANCE, handles[1], max(handles[2], 0.1)])
        way = np.eye(3)[0]
    if way[0] > 0.5:
        return tip - [_FINGERS, 0.0, 0.0], np.array(start.qpos)
    return tip + [0.0, 0.0, _FINGERS], np.array(_FACING_DOWN)


def _push(obj: ArticulatedObject, k: int) -> tuple[Array, Array]:
    """(3,) where part k's handle is when all joints are open as far as they are at first, on average, and (3,) the unit
    direction in which it moves when its joint closes; rest frame."""
    rest, far = obj.tree.rest, farther_ends(obj)
    q = obj.tree.complete_state(rest + 0.5 * (LEAST_OPEN + MOST_OPEN) * (far - rest))
    less = q.copy()
    less[k] -= 1e-3 * (far[k] - rest[k])
    point = np.append(handle(obj, k), 1.0)
    at, then = (obj.tree.forward_kinematics(state)[k, :3] @ point for state in (q, less))
    return at, (then - at) / max(float(np.linalg.norm(then - at)), 1e-12)


def onlooker(obj: ArticulatedObject, robot: str, stand: Array) -> Array:
    """(4, 4) ``T_world_camera`` that shows an object and a robot with its base at ``stand`` (3,), from the front and
    the object's right side."""
    center, radius = bounding_sphere(obj, most_open_state(obj))
    center = center + T_world_object(obj)[:3, 3]
    low, high = center - radius, center + radius
    if robot in ROBOTS:
        x, y, height = ROBOTS[robot].room
        low = np.minimum(low, stand - [x, y, 0.0])
        high = np.maximum(high, stand + [x, y, height if robot != FLOATING else 0.0])
    low[2] = 0.0
    middle, reach = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    away = np.array([-0.35, -0.8, 0.45])
    return look_at_transform(middle + away / np.linalg.norm(away) * reach / np.sin(0.5 * ONLOOKER_FOV), middle)


def _least(obj: ArticulatedObject, q: Array, axis: int) -> float:
    """Smallest coordinate along an axis of the boxes of the posed parts, metres."""
    T = obj.tree.forward_kinematics(q)
    reach = 0.5 * (np.abs(T[:, axis, :3]) * obj.box_size).sum(axis=1)
    at = (T[:, axis, :3] * obj.box_center).sum(axis=1) + T[:, axis, 3]
    return float((at - reach)[obj.has_surface].min())
