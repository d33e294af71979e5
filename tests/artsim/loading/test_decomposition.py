"""Convex pieces fill what a surface encloses and leave open what is open: things can be put into loaded drawers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold, OpType

from artsim.common.extras import import_pybullet
from artsim.errors import ArtsimError
from artsim.families import make
from artsim.loading.decomposition import DecompositionOptions, connected_surfaces, convex_pieces, decompose, hollow
from artsim.model.objects import Mesh
from artsim.physics import PhysicsOptions, Simulation
from artsim.physics.bullet_body import BulletBody
from tests.conftest import installed


def tray() -> Mesh:
    """A closed tray, 0.6 wide, with walls of 0.03."""
    outside = Manifold.cube((0.6, 0.6, 0.25), True)
    inside = Manifold.cube((0.54, 0.54, 0.25), True).translate((0.0, 0.0, 0.03))
    mesh = (outside - inside).to_mesh()
    return np.asarray(mesh.vert_properties[:, :3], np.float64), np.asarray(mesh.tri_verts, np.int32)


def volume(pieces: tuple[Mesh, ...]) -> float:
    return float(Manifold.batch_boolean([Manifold.hull_points(corners) for corners, _ in pieces], OpType.Add).volume())


def test_surfaces_that_share_no_corner_are_apart_and_convex_ones_are_kept() -> None:
    boxes = [trimesh.creation.box((0.1, 0.2, 0.3)), trimesh.creation.box((0.1, 0.1, 0.1))]
    boxes[1].apply_translation((0.5, 0.0, 0.0))
    both = trimesh.util.concatenate(boxes)
    # Faces with corners of their own, as many files have them, are joined by place.
    vertices, faces = both.vertices[both.faces].reshape(-1, 3), np.arange(72, dtype=np.int32).reshape(-1, 3)
    assert sorted(map(len, connected_surfaces(vertices, faces))) == [12, 12]
    pieces = convex_pieces(vertices, faces)
    assert len(pieces) == 2
    assert volume(pieces) == pytest.approx(both.volume)


def test_hollow_is_how_far_the_hull_is_from_the_surface() -> None:
    assert hollow(*tray()) == pytest.approx(0.22, abs=0.01)
    box = trimesh.creation.box((1.0, 0.2, 0.1))
    assert hollow(np.asarray(box.vertices), np.asarray(box.faces)) < 0.02  # as far as places on it are apart
    assert hollow(np.eye(3), np.array([[0, 1, 2]])) == 0.0


@pytest.mark.slow
def test_a_tray_is_cut_into_its_walls_and_kept_in_the_cache(tmp_path: Path) -> None:
    installed("coacd")
    options = DecompositionOptions(cache=tmp_path)
    vertices, faces = tray()
    pieces = convex_pieces(vertices, faces, options)
    assert len(pieces) > 1
    assert volume(pieces) == pytest.approx(trimesh.Trimesh(vertices, faces).volume, rel=0.05)
    for corners, triangles in pieces:
        planes = trimesh.Trimesh(corners, triangles).convex_hull
        assert not planes.contains([[0.0, 0.0, 0.05]]).any()
    (file,) = tmp_path.iterdir()
    again = convex_pieces(vertices, faces, options)
    assert all(
        np.array_equal(a, b) for one, other in zip(pieces, again, strict=True) for a, b in zip(one, other, strict=True)
    )
    file.write_bytes(b"damaged")
    assert len(convex_pieces(vertices, faces, options)) == len(pieces)


@pytest.mark.slow
def test_a_box_stays_in_an_opened_drawer_that_was_loaded(tmp_path: Path) -> None:
    installed("coacd")
    bullet = import_pybullet()
    made = next(obj for obj in (make("drawer", seed) for seed in range(100)) if len(obj) == 2)
    # As if the drawer had been loaded from a file that tells of surfaces only.
    loaded = replace(made, parts=(made.parts[0], replace(made.parts[1], body=None)))
    obj = decompose(loaded, DecompositionOptions(0.06, 16, tmp_path), progress=False)
    simulation = Simulation(obj, PhysicsOptions(engine="pybullet"))
    assert isinstance(simulation.body, BulletBody)
    opened = obj.tree.limits[:, 1].copy()
    simulation.reset(opened)
    T = obj.tree.forward_kinematics(opened)[1]
    middle = T[:3, :3] @ obj.box_center[1] + T[:3, 3]
    half = 0.06 * float(obj.box_size[1].min())
    client = {"physicsClientId": simulation.body.client}
    shape = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=[half] * 3, **client)
    box = bullet.createMultiBody(0.05 / simulation.body.mass_unit, shape, basePosition=middle.tolist(), **client)
    for _ in range(40):
        simulation.step([0.0])
    at = np.array(bullet.getBasePositionAndOrientation(box, **client)[0])
    inside = np.abs(np.linalg.inv(T)[:3, :3] @ (at - T[:3, 3]) - obj.box_center[1])
    assert np.all(inside < 0.5 * obj.box_size[1])
    assert at[2] < middle[2] + half  # it lies, and does not stand on a hull


def test_parts_with_bodies_are_left_alone() -> None:
    obj = make("laptop", 0)
    assert decompose(obj, progress=False).parts == obj.parts


@pytest.mark.parametrize("options", [{"concavity": 0.0}, {"most_pieces": 0}])
def test_options_that_make_no_sense_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(ArtsimError):
        DecompositionOptions(**options)  # type: ignore[arg-type]
