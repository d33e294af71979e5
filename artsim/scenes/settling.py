"""Things let fall onto a support and onto each other: they come to rest as MuJoCo's physics has it."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from artsim.common.extras import import_mujoco
from artsim.common.products import apply, matmul, norm
from artsim.model.appearance import Coat
from artsim.model.convex_bodies import add_bodies, convex_hull
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import rotation_about, transform_points
from artsim.renderers.scene import Thing
from artsim.scenes.placement import Area, resting_rotation

Placeable = tuple[ArticulatedObject, Array, tuple[Coat, ...]]

_STEP = 0.002  # seconds: contacts of things of some centimetres need no less
_MARGIN = 0.0005  # metres on each side from which surfaces push each other: they rest 1 mm apart, and do not cross
_SLOWEST, _FASTEST = 0.002, 0.8  # metres a second: what is slower is at rest; nothing falls faster, as if let down
_TURNING, _SPINNING = 0.02, 12.0  # the same in radians a second
_QUIET = 0.4  # seconds that all must be at rest for
_LONGEST = 6.0  # seconds after the last one has fallen: what still rolls then is drawn again
_FRICTION = (0.7, 0.01, 0.001)  # of wood and plastic: sliding, twisting, rolling
_UPRIGHT = 0.5  # share of things that are let fall as they stand; the others fall in any attitude
_CLUSTER = 0.35  # of the area's sides: what falls there lands on what fell before
_ROOM = 0.03  # metres by which things may reach beyond the area
_THIN = 2e-3  # of its diagonal: what a convex piece is thick at least
_LIGHTEST = 1e-3  # kilogrammes


def settle(solids: Sequence[Placeable], area: Area, rng: np.random.Generator) -> list[Thing] | None:
    """All things where they come to rest, their joints held; None where one falls off or does not come to rest.

    The result depends on MuJoCo's version, and is the same for the same one on processors of one kind.

    Parameters
    ----------
    solids : sequence of (ArticulatedObject, (K,) float, tuple of Coat)
        Objects, their joint states, their coats.
    area : Area
        What they fall onto. It goes on beyond its borders, but things must come to rest within.
    rng : numpy Generator

    Raises
    ------
    ConfigError
        When MuJoCo is not installed.
    """
    mujoco = import_mujoco("physics", extra="envs")

    spec = mujoco.MjSpec()
    spec.option.timestep = _STEP
    spec.option.cone, spec.option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, 20.0  # what rubs hardly creeps
    ground = spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_PLANE, size=[10.0, 10.0, 0.1])
    ground.pos = [0.0, 0.0, area.height]
    _rub(ground)
    for number, (obj, q, _) in enumerate(solids):
        _add(mujoco, spec, f"thing{number}", obj, q)
    model = spec.compile()
    data = mujoco.MjData(model)
    top = _let_fall(mujoco, data, solids, area, rng)
    if not _run(mujoco, model, data, (top - area.height) / _FASTEST + _LONGEST):
        return None
    things = []
    for number, (obj, q, coats) in enumerate(solids):
        place = data.qpos[7 * number : 7 * number + 7]
        T, rotation = np.eye(4), np.empty(9)
        mujoco.mju_quat2Mat(rotation, place[3:])
        T[:3, :3], T[:3, 3] = rotation.reshape(3, 3), place[:3]
        things.append(Thing(obj, q, T, coats))
    low, high = np.asarray(area.low) - _ROOM, np.asarray(area.high) + _ROOM
    inside = all(((thing.vertices[:, :2] >= low) & (thing.vertices[:, :2] <= high)).all() for thing in things)
    return things if inside else None


def _add(mujoco: Any, spec: Any, name: str, obj: ArticulatedObject, q: Array) -> None:
    """A body that moves freely, of the convex pieces of an object in a state."""
    bodied, poses = add_bodies(obj), obj.tree.forward_kinematics(q)
    thing = spec.worldbody.add_body(name=name)
    thing.add_freejoint()
    for k, part in enumerate(bodied.parts):
        assert part.body is not None
        for n, (points, _) in enumerate(part.body.pieces):
            posed = transform_points(poses[k], obj.scale * points)
            vertices, faces = convex_hull(posed, _THIN * obj.diagonal)
            mesh = spec.add_mesh(name=f"{name}_{k}_{n}", inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL)
            mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
            geom = thing.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name)
            geom.mass = max(part.body.density * _volume(vertices, faces), _LIGHTEST)
            _rub(geom)


def _rub(geom: Any) -> None:
    """Contacts that are stiff, and rub."""
    geom.friction, geom.condim = list(_FRICTION), 6
    geom.margin, geom.solref, geom.solimp = _MARGIN, [0.006, 1.0], [0.95, 0.99, 0.001, 0.5, 2.0]


def _volume(vertices: Array, faces: Any) -> float:
    a, b, c = (vertices[faces[:, i]] - vertices[0] for i in range(3))
    return abs(float((a * np.cross(b, c)).sum())) / 6.0


def _let_fall(mujoco: Any, data: Any, solids: Sequence[Placeable], area: Area, rng: np.random.Generator) -> float:
    """Put all things above each other, the largest lowest; the height of the last."""
    middle, half = 0.5 * (np.add(area.low, area.high)), 0.5 * _CLUSTER * np.subtract(area.high, area.low)
    floor = area.height
    for number in sorted(range(len(solids)), key=lambda n: -solids[n][0].diagonal):
        obj, q, _ = solids[number]
        turn = rotation_about((0.0, 0.0, 1.0), rng.uniform(-np.pi, np.pi))
        if rng.random() < _UPRIGHT:
            rotation = matmul(turn, resting_rotation(obj))
        else:
            direction = rng.normal(size=3)
            rotation = matmul(turn, rotation_about(direction / norm(direction), rng.uniform(0.0, np.pi)))
        posed = apply(rotation, Thing(obj, q, np.eye(4), ()).vertices)
        low, high = posed.min(axis=0), posed.max(axis=0)
        place = data.qpos[7 * number : 7 * number + 7]
        place[:2] = middle + rng.uniform(-1.0, 1.0, 2) * half - 0.5 * (low + high)[:2]
        place[2] = floor + 0.01 - low[2]
        mujoco.mju_mat2Quat(place[3:], np.ascontiguousarray(rotation).ravel())
        floor = place[2] + high[2]
    return float(floor)


def _run(mujoco: Any, model: Any, data: Any, seconds: float) -> bool:
    """Let time pass until all are at rest; whether they came to rest."""
    speeds = data.qvel.reshape(-1, 6)
    quiet = 0
    for _ in range(round(seconds / _STEP)):
        mujoco.mj_step(model, data)
        for part, most in ((speeds[:, :3], _FASTEST), (speeds[:, 3:], _SPINNING)):
            fast = norm(part)[:, None]
            part *= np.minimum(most / np.maximum(fast, most), 1.0)
        slow = (norm(speeds[:, :3]) < _SLOWEST).all() and (norm(speeds[:, 3:]) < _TURNING).all()
        quiet = quiet + 1 if slow else 0
        if quiet * _STEP > _QUIET:
            return True
    return False
