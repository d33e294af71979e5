"""Rest frames: files of a category that lie otherwise than the others are turned."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

import artsim
from artsim.export import export
from artsim.loading.sources import find_sources
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import transform_points

_OPEN = 0.6
"""Radians that PartNet-Mobility's scissors are open at their files' zero, half of it to either side of Y."""
_URDF = """<robot name="partnet_scissors">
<link name="base"/>
<link name="link_0"><visual><geometry><mesh filename="0.obj"/></geometry></visual></link>
<joint name="joint_0" type="fixed">
  <origin rpy="1.570796326794897 0 -1.570796326794897" xyz="0 0 0"/><parent link="base"/><child link="link_0"/>
</joint>
<link name="link_1"><visual><geometry><mesh filename="1.obj"/></geometry></visual></link>
<joint name="joint_1" type="revolute">
  <origin xyz="0 0 0"/><axis xyz="0 {up} 0"/><limit lower="{low}" upper="{high}"/>
  <parent link="link_0"/><child link="link_1"/>
</joint>
</robot>
"""


def about_z(angle: float) -> np.ndarray:
    return trimesh.transformations.rotation_matrix(angle, [0, 0, 1])


def write_as_partnet(obj: ArticulatedObject, folder: Path, other_root: bool = False, lean: float = 0.0) -> None:
    """Our own scissors as PartNet-Mobility has them: half open at zero, pivot at the origin, meshes with Y up."""
    pivot = np.array(obj.tree.joints[1].origin)
    for k, part in enumerate(reversed(obj.parts) if other_root else obj.parts):
        half = (_OPEN if (k == 1) != other_root else -_OPEN) / 2
        x, y, z = transform_points(about_z(half + lean), part.vertices - pivot).T
        # rpy (pi/2, 0, -pi/2) of the base takes (x, y, z) of a mesh to (-z, -x, y).
        trimesh.Trimesh(np.column_stack([-y, z, -x]), part.faces, process=False).export(folder / f"{k}.obj")
    up, low, high = (-1, -_OPEN, 0) if other_root else (1, -_OPEN, 0)
    (folder / "mobility.urdf").write_text(_URDF.format(up=up, low=low, high=high))
    (folder / "meta.json").write_text('{"anno_id": "1", "model_cat": "Scissors"}')


def lean_of(obj: ArticulatedObject) -> float:
    """Degrees between Y and the line from the pivot to the middle of both points."""
    pivot = np.array(obj.tree.joints[1].origin)
    tips = [max(part.vertices - pivot, key=lambda p: p[1])[:2] for part in obj.parts]
    x, y = sum(tip / np.linalg.norm(tip) for tip in tips)
    return float(np.degrees(np.arctan2(x, y)))


@pytest.mark.parametrize("seed", range(6))
def test_scissors_as_partnet_has_them_lie_as_the_family_does(seed: int, tmp_path: Path) -> None:
    family = artsim.make("scissors", seed)
    write_as_partnet(family, tmp_path)
    untouched = artsim.load(tmp_path, category="unknown")
    assert abs(lean_of(untouched)) < 1.5
    assert not [repair for repair in untouched.repairs if repair.where == "rest frame"]
    obj = artsim.load(tmp_path)
    (note,) = [repair for repair in obj.repairs if repair.where == "rest frame"]
    assert note.note
    assert "turned by 1" in note.what
    assert abs(lean_of(obj)) < 0.2
    assert obj.tree.rest[1] == pytest.approx(-_OPEN, abs=0.02)
    assert obj.tree.axes[1] == pytest.approx([0, 0, 1], abs=1e-9)
    np.testing.assert_allclose(obj.box_center, family.box_center, atol=0.02 * family.diagonal)
    np.testing.assert_allclose(obj.box_size, family.box_size, atol=0.03 * family.diagonal)


@pytest.mark.parametrize("lean", [0.0, 1.7, -2.5])
@pytest.mark.parametrize("other_root", [False, True])
def test_scissors_lie_alike_however_the_file_turned_them_and_whichever_blade_is_its_root(
    other_root: bool, lean: float, tmp_path: Path
) -> None:
    write_as_partnet(artsim.make("scissors", 3), tmp_path, other_root, lean)
    obj = artsim.load(tmp_path)
    assert abs(lean_of(obj)) < 0.2
    assert obj.box_center[0, 0] < 0 < obj.box_center[1, 0]  # the root's ring is towards -X
    assert obj.box_size[:, 1].min() > 2 * obj.box_size[:, 0].max()
    points = np.concatenate([part.vertices for part in obj.parts])
    ahead = points[points[:, 1] > 0.3 * points[:, 1].max()]
    behind = points[points[:, 1] < 0.3 * points[:, 1].min()]
    assert np.ptp(ahead[:, 0]) < np.ptp(behind[:, 0])
    assert obj.tree.axes[1] == pytest.approx([0, 0, 1], abs=1e-9)


def test_the_base_links_frame_of_turned_scissors_stays_that_of_the_file(tmp_path: Path) -> None:
    write_as_partnet(artsim.make("scissors", 1), tmp_path, other_root=True, lean=0.4)
    turned, plain = artsim.load(tmp_path), artsim.load(tmp_path, category="unknown")
    for q in ([0.0, 0.0], [0.0, -0.3]):
        ours, files = (
            [obj.T_base_rest @ T for T in obj.tree.forward_kinematics(np.array(q))] for obj in (turned, plain)
        )
        for k in range(2):
            np.testing.assert_allclose(
                transform_points(ours[k], turned.parts[k].vertices),
                transform_points(files[k], plain.parts[k].vertices), atol=1e-9,
            )  # fmt: skip


def test_what_artsim_wrote_itself_is_never_turned(tmp_path: Path) -> None:
    family = artsim.make("scissors", 0)
    export(family, tmp_path / "own")
    obj = artsim.load(tmp_path / "own")
    assert not [repair for repair in obj.repairs if repair.where == "rest frame"]
    np.testing.assert_allclose(obj.box_center, family.box_center, atol=1e-6)


@pytest.mark.slow
def test_real_objects_of_other_categories_lie_as_their_files_have_them(partnet_dir: Path) -> None:
    for source in find_sources([partnet_dir / name for name in ("Stapler", "Knife", "Suitcase", "Switch")]):
        obj = artsim.load(source.path)
        np.testing.assert_array_equal(obj.T_base_rest[:3, :3], np.eye(3))
