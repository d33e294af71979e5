"""Colours and pictures of object files are shown."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import artsim
from artsim import make
from artsim.loading.painted import painted_coats
from artsim.loading.sources import find_sources
from artsim.model.appearance import Coat

OBJ = """mtllib look.mtl
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1
usemtl red\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4
usemtl picture\nf 1/1 2/2 5/3
"""


URDF = """<robot name="thing"><link name="base">
<visual><geometry><mesh filename="thing.obj"/></geometry></visual>
</link></robot>"""


def painted(folder: Path, materials: str) -> tuple[Coat, ...] | None:
    (folder / "thing.obj").write_text(OBJ)
    (folder / "look.mtl").write_text(materials)
    (folder / "thing.urdf").write_text(URDF)
    return painted_coats(artsim.load(folder / "thing.urdf"))


def test_colours_and_pictures_of_wavefront_files_are_shown(tmp_path: Path) -> None:
    Image.fromarray(np.full((4, 4, 3), (10, 200, 30), np.uint8)).save(tmp_path / "green.png")
    coats = painted(tmp_path, "newmtl red\nKd 1 0 0\nnewmtl picture\nKd 1 1 1\nmap_Kd green.png\n")
    assert coats is not None
    (coat,) = coats
    looks = [coat.materials[number] for number in coat.material_of_face]
    assert sorted(look.texture is not None for look in looks) == [False, False, True]
    assert [look.colour for look in looks if look.texture is None] == [(1.0, 0.0, 0.0)] * 2
    textured = next(i for i, look in enumerate(looks) if look.texture is not None)
    texture = looks[textured].texture
    assert texture is not None
    assert (texture == (10, 200, 30)).all()
    assert coat.uv is not None
    assert coat.uv[textured] == pytest.approx(np.array([(0, 0), (1, 0), (1, 1)]))


@pytest.mark.parametrize("name", ["nowhere.png", "../../secret.png", "/etc/passwd", "broken.png"])
def test_pictures_that_are_missing_broken_or_outside_leave_the_plain_colour(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"
    folder.mkdir(parents=True)
    Image.fromarray(np.zeros((4, 4, 3), np.uint8)).save(tmp_path / "secret.png")
    (folder / "broken.png").write_bytes(b"\x89PNG no picture")
    coats = painted(folder, f"newmtl red\nKd 1 0 0\nnewmtl picture\nKd 0 0 1\nmap_Kd {name}\n")
    assert coats is not None
    assert {material.colour for material in coats[0].materials} == {(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)}
    assert all(material.texture is None for material in coats[0].materials)


def test_objects_without_colours_of_their_own_say_so(tmp_path: Path, box_laptop: Path) -> None:
    assert painted_coats(artsim.load(box_laptop)) is None
    assert painted_coats(make("laptop", 0)) is None


@pytest.mark.parametrize("category", ["Laptop", "Box", "StorageFurniture", "Faucet"])
def test_real_objects_bring_their_own_looks(category: str, partnet_dir: Path) -> None:
    obj = find_sources([partnet_dir / category])[0].load()
    coats = painted_coats(obj)
    assert coats is not None
    for part, coat in zip(obj.parts, coats, strict=True):
        assert len(coat.material_of_face) == len(part.faces)
        assert coat.uv is not None
        assert coat.uv.shape == (len(part.faces), 3, 2)
