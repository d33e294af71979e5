"""Exported robots weigh, collide and hold as the object does."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from lxml import etree

from artsim.export import export
from artsim.families import make
from artsim.model.part_inertia import part_inertia
from artsim.model.robot import HELPER_SHARE, as_robot
from tests.conftest import valve


def test_the_file_weighs_what_the_object_does(tmp_path: Path) -> None:
    obj = valve()
    meta = export(obj, tmp_path)
    root = etree.parse(str(tmp_path / "mobility.urdf")).getroot()
    masses = {link.get("name"): float(link.find("inertial/mass").get("value")) for link in root.findall("link")}
    own = [part_inertia(obj, k).mass for k in range(len(obj))]
    assert sum(masses.values()) == pytest.approx(sum(own)) == meta["artsim"]["mass_kg"]
    assert masses["pipe"] == pytest.approx(8.0)
    assert masses["cap_thread"] == pytest.approx(HELPER_SHARE * own[2])


def test_collision_shapes_are_convex_and_cover_the_part(tmp_path: Path) -> None:
    obj = make("drawer", 3)
    robot = as_robot(obj)
    for link in robot.links:
        volumes = []
        body = obj.parts[link.part].body
        assert body is not None
        for shape, piece in zip(link.collision, body.pieces, strict=True):
            if hasattr(shape, "size"):
                np.testing.assert_allclose(piece[0].min(axis=0), shape.center - 0.5 * shape.size, atol=1e-12)
                np.testing.assert_allclose(piece[0].max(axis=0), shape.center + 0.5 * shape.size, atol=1e-12)
                volumes.append(np.prod(shape.size))
            else:
                triangles = shape.vertices[shape.faces]
                normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
                normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
                above = np.einsum("fvk,fk->fv", shape.vertices[None] - triangles[:, :1], normals)
                assert above.max() < 1e-6
                volumes.append(np.einsum("fi,fi->", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])) / 6)
        assert sum(volumes) * body.density >= 0.999 * link.inertia.mass


def test_joints_are_strong_enough_to_hold_what_they_carry() -> None:
    for joint in as_robot(make("laptop", 0)).joints:
        lid = part_inertia(make("laptop", 0), 1)
        arm = np.linalg.norm(np.cross(joint.axis, lid.center - make("laptop", 0).tree.origins[1]))
        assert joint.effort > 2 * lid.mass * 9.81 * arm
