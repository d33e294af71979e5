"""Things that fell are at rest, none in another: PyBullet, which knows nothing of it, leaves them where they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from artsim.errors import ConfigError
from artsim.model.convex_bodies import add_bodies
from artsim.model.draws import StateOptions
from artsim.model.transforms import transform_points
from artsim.renderers.scene import Scene, Thing
from artsim.scenes import SceneOptions, make_scene
from artsim.scenes.placement import are_apart
from tests.conftest import installed

SEEDS = (0, 1)
OPTIONS = SceneOptions(
    ("box", "stapler", "scissors", "drawer"), distractors=2, diagonal=(0.18, 0.38), settle=True, states=StateOptions(),
)  # fmt: skip


@pytest.fixture(scope="module")
def scenes() -> list[Scene]:
    return [make_scene(OPTIONS, seed) for seed in SEEDS]


def things(scene: Scene) -> list[Thing]:
    return [*scene.instances, *scene.distractors]


@pytest.mark.slow
def test_nothing_is_in_another_or_in_the_table(scenes: list[Scene]) -> None:
    for scene in scenes:
        own = things(scene)
        assert all(thing.vertices[:, 2].min() > -1e-4 for thing in own)
        for i, one in enumerate(own):
            assert all(are_apart(one, other, 1e-5) for other in own[:i])


@pytest.mark.slow
def test_some_lie_on_others_and_not_all_as_they_were_made(scenes: list[Scene]) -> None:
    own = [thing for scene in scenes for thing in things(scene)]
    assert any(thing.vertices[:, 2].min() > 0.005 for thing in own)
    upright = np.array([thing.T_world_object[2, 2] for thing in own])
    assert (upright < 0.9).any()
    np.testing.assert_allclose([np.linalg.det(thing.T_world_object) for thing in own], 1.0, atol=1e-6)


@pytest.mark.slow
def test_another_engine_leaves_them_where_they_are(scenes: list[Scene], tmp_path: Path) -> None:
    pybullet = installed("pybullet")
    client = pybullet.connect(pybullet.DIRECT)
    try:
        moved = [
            distance for scene in scenes for distance in _after_a_second(pybullet, client, things(scene), tmp_path)
        ]
    finally:
        pybullet.disconnect(client)
    # Its contacts are thicker: a pile of things that lean may give way. What has not settled falls by decimetres.
    assert np.median(moved) < 0.03
    assert np.mean(np.array(moved) < 0.2) > 0.7


def _after_a_second(pybullet, client: int, own: list[Thing], folder: Path) -> list[float]:  # type: ignore[no-untyped-def]
    """Metres that each moves."""
    pybullet.resetSimulation(client)
    pybullet.setGravity(0, 0, -9.81, physicsClientId=client)
    plane = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=client)
    ground = pybullet.createMultiBody(0, plane, physicsClientId=client)
    bodies = []
    for thing in own:
        poses = thing.obj.tree.forward_kinematics(thing.q)
        pieces, masses = [], []
        for k, part in enumerate(add_bodies(thing.obj).parts):
            assert part.body is not None
            for points, faces in part.body.pieces:
                hull = trimesh.Trimesh(transform_points(poses[k], thing.obj.scale * points), faces).convex_hull
                pieces.append(hull)
                masses.append(part.body.density * hull.volume)
        middle = np.average([hull.center_mass for hull in pieces], axis=0, weights=masses)
        file = folder / f"{len(bodies)}.obj"
        file.write_text(_groups(pieces, middle))  # a hull of each group
        shape = pybullet.createCollisionShape(pybullet.GEOM_MESH, fileName=str(file), physicsClientId=client)
        T = thing.T_world_object
        q = Rotation.from_matrix(T[:3, :3]).as_quat().tolist()
        body = pybullet.createMultiBody(
            float(sum(masses)), shape, -1, transform_points(T, middle[None])[0].tolist(), q, physicsClientId=client
        )
        bodies.append(body)
    for body in (ground, *bodies):  # PyBullet multiplies what two surfaces have: 0.7 in all, and some for rolling
        pybullet.changeDynamics(
            body, -1, lateralFriction=0.84, rollingFriction=0.03, spinningFriction=0.1, collisionMargin=0.0,
            physicsClientId=client,
        )  # fmt: skip
    before = [pybullet.getBasePositionAndOrientation(body, physicsClientId=client)[0] for body in bodies]
    for _ in range(240):
        pybullet.stepSimulation(client)
    after = [pybullet.getBasePositionAndOrientation(body, physicsClientId=client)[0] for body in bodies]
    return [float(np.linalg.norm(np.subtract(a, b))) for a, b in zip(after, before, strict=True)]


def _groups(pieces: list[trimesh.Trimesh], middle: np.ndarray) -> str:
    """A Wavefront file with a group for each piece, about their middle."""
    lines, first = [], 1
    for n, hull in enumerate(pieces):
        lines += [f"o piece_{n}", *("v {} {} {}".format(*p) for p in (hull.vertices - middle).tolist())]
        lines += ["f {} {} {}".format(*f) for f in (hull.faces + first).tolist()]
        first += len(hull.vertices)
    return "\n".join(lines) + "\n"


def test_a_seed_decides_where_things_come_to_rest(scenes: list[Scene]) -> None:
    again = make_scene(OPTIONS, SEEDS[0])
    for one, other in zip(things(again), things(scenes[0]), strict=True):
        np.testing.assert_array_equal(one.T_world_object, other.T_world_object)


def test_what_is_bolted_down_does_not_fall() -> None:
    with pytest.raises(ConfigError, match="does not fall"):
        SceneOptions(settle=True, bolted=True)
