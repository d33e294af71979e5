"""The URDF files of AKB-48 are made for Unity: meshes have other axes than frames."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh

import artsim

CLOSE = 1e-6
"""Metres and radians."""


def test_akb48_has_meshes_in_the_axes_of_unity(tmp_path: Path) -> None:
    obj = artsim.make("laptop", 0)
    folder = tmp_path / "laptop" / "01b24b02"
    folder.mkdir(parents=True)
    links, joints = [], []
    for k, (part, joint) in enumerate(zip(obj.parts, obj.tree.joints, strict=True)):
        x, y, z = part.vertices.T  # of the object; a mesh file of Unity's has (y, z, x)
        trimesh.Trimesh(np.stack([y, z, x], axis=1), part.faces, process=False).export(
            folder / f"part{k}.obj", digits=12
        )
        origin = np.array(joint.origin)
        back = " ".join(map(repr, (-origin).tolist()))
        links.append(
            f'<link name="part{k}"><visual><origin xyz="{back}"/><geometry>'
            f'<mesh filename="package://part{k}.obj"/></geometry></visual></link>'
        )
        if k:
            at, axis = (
                " ".join(map(repr, map(float, values)))
                for values in (origin - obj.tree.origins[joint.parent], joint.axis)
            )
            joints.append(
                f'<joint name="joint{k}" type="revolute"><parent link="part{joint.parent}"/><child link="part{k}"/>'
                f'<origin xyz="{at}"/><axis xyz="{axis}"/>'
                f'<limit lower="{joint.lower!r}" upper="{joint.upper!r}"/></joint>'
            )
    (folder / "motion_unity.urdf").write_text(f'<robot name="l">{"".join(links)}{"".join(joints)}</robot>')
    loaded = artsim.load(folder, category="unknown")
    assert loaded.object_id == "01b24b02"
    np.testing.assert_allclose(loaded.tree.axes, obj.tree.axes, atol=CLOSE)
    np.testing.assert_allclose(loaded.tree.origins, obj.tree.origins, atol=CLOSE)
    np.testing.assert_allclose(loaded.tree.limits, obj.tree.limits, atol=CLOSE)
    for part, other in zip(loaded.parts, obj.parts, strict=True):
        np.testing.assert_allclose(part.vertices[part.faces], other.vertices[other.faces], atol=CLOSE)
