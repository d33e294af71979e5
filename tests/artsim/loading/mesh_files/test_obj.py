"""Wavefront files mean what the format says, whoever wrote them."""

from __future__ import annotations

import time

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

from artsim.loading.mesh_files.obj import read_painted
from artsim.loading.mesh_files.surface import Bounds, UnusableMeshError
from tests.artsim.loading.mesh_builders import NOTCHED, SQUARE, area, read


@pytest.mark.parametrize(
    "text",
    [
        SQUARE + "f 1 2 3 4\n",
        SQUARE + "f 1 2 3\nf 1 3 4",
        SQUARE + "f -4 -3 -2 -1\nv 9 9 9\n",
        SQUARE + "f 1//1 2//1 3//1 4//1\n",
        SQUARE + "vt 0 0\nf 1/1 2/1 3/1 4/1\n",
        SQUARE + "vt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1 4/1/1\n",
        (SQUARE + "f 1 2 3 4\n").replace("\n", "\r\n"),
        (SQUARE + "f 1 2 3 4\n").replace("\n", "\r"),
        (SQUARE + "f 1 2 3 4\n").replace(" ", "\t"),
        "\ufeff" + SQUARE + "f 1 2 3 4\n",
        (" \t " + SQUARE + "f 1 2 3 4\n").replace("\n", "\n \t"),
        SQUARE + "f 1 2 \\\n3 4\n",
        SQUARE + "f 1 2 \\\r\n3 4\n",
        "# f 1 2 3\n" + SQUARE + "f 1 2 3 4 # f 5 6 7\n",
        "f 1 2 3 4\n" + SQUARE,
        "v 0 0 0 1\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0 1 0 0 1\nv 0 1 0\nf 1 2 3 4\n",
        SQUARE + "mtllib gone.mtl\nusemtl gone\ng a b\no c\ns off\nf 1 2 3 4\n",
        SQUARE + "mtllib ../../etc/passwd\nf 1 2 3 4",
        SQUARE.replace(" 0 0\n", " 0e0 +0.\n", 1) + "f +1 2 3 4\n",
    ],
)
def test_a_square_is_a_square_however_it_is_written(text: str) -> None:
    vertices, faces, said = read(text, ".obj")
    assert said == ""
    assert len(faces) == 2
    assert area(vertices, faces) == pytest.approx(1.0)
    assert np.cross(*(vertices[faces][0, 1:] - vertices[faces][0, 0]))[2] > 0  # as wound in the file


def test_utf_16_is_read() -> None:
    vertices, faces, _ = read((SQUARE + "f 1 2 3 4\n").encode("utf-16"), ".obj")
    assert area(vertices, faces) == pytest.approx(1.0)


def test_relative_numbers_count_back_from_their_own_row() -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\nf -9 -8 -7\n"
    vertices, faces, said = read(text, ".obj")
    assert vertices[faces][:, 0, 0].tolist() == [0, 5]
    assert said == "1 faces left out: not finite, or of vertices that are missing"


@pytest.mark.parametrize("turn", range(5))
@pytest.mark.parametrize("order", [1, -1])
def test_concave_polygons_keep_their_notch(turn: int, order: int) -> None:
    corners = np.roll([1, 2, 3, 4, 5], turn)[::order]
    vertices, faces, said = read(NOTCHED + f"f {' '.join(map(str, corners))}\n", ".obj")
    assert said == ""
    assert area(vertices, faces) == pytest.approx(10.0)
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    assert (np.sign(np.cross(b - a, c - a)[:, 2]) == order).all()


@pytest.mark.parametrize("turn", range(4))
def test_concave_quadrilaterals_are_divided_inside(turn: int) -> None:
    text = "v 0 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\n" + f"f {' '.join(map(str, np.roll([1, 2, 3, 4], turn)))}\n"
    vertices, faces, _ = read(text, ".obj")
    assert area(vertices, faces) == pytest.approx(4.0)


@given(
    radii=st.lists(st.floats(0.2, 1.0), min_size=3, max_size=24),
    seed=st.integers(0, 2**32 - 1),
    size=st.sampled_from([1e-6, 1.0, 1e4]),
)
def test_any_simple_polygon_keeps_its_area_in_any_plane(radii: list[float], seed: int, size: float) -> None:
    """Stars about a point: their area is a sum of triangles."""
    rng = np.random.default_rng(seed)
    angles = np.arange(len(radii)) * 2 * np.pi / len(radii)
    flat = np.stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(len(radii))], axis=1)
    wanted = 0.5 * abs((flat[:, 0] * np.roll(flat[:, 1], -1) - flat[:, 1] * np.roll(flat[:, 0], -1)).sum())
    turn = trimesh.transformations.random_rotation_matrix(rng.random(3))[:3, :3]
    placed = np.roll(flat @ turn.T + rng.normal(size=3), int(rng.integers(len(radii))), axis=0) * size
    text = "".join(f"v {x:.17g} {y:.17g} {z:.17g}\n" for x, y, z in placed)
    vertices, faces, said = read(text + f"f {' '.join(map(str, range(1, len(radii) + 1)))}\n", ".obj")
    assert len(faces) == len(radii) - 2
    assert area(vertices, faces) == pytest.approx(wanted * size**2, rel=1e-6)
    assert said == ""


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("f 1 2 9\n", "1 faces left out: not finite, or of vertices that are missing"),
        ("f 0 1 2\n", "1 faces left out: not finite, or of vertices that are missing"),
        ("f 1 two 3\n", "1 faces left out: not finite, or of vertices that are missing"),
        ("f 1 2\nf\n", "2 faces left out: fewer than three corners"),
        ("v nan 0 0\nf 1 2 5\n", "1 faces left out: not finite, or of vertices that are missing"),
        ("v 1 2\nf 1 2 5\n", "1 faces left out: not finite, or of vertices that are missing"),
        ("l 1 2 3\nl 1 2\n", "2 lines left out"),
        ("p 1\n", "1 points left out"),
        ("vp 0.1\ncstype bezier\ncurv 0 1 1 2\nsurf 0 1 0 1 1 2 3 4\nend\n", "rows that begin with 'surf' left out"),
        ("F 1 2 3\n", "1 rows that begin with 'F' left out"),
        ("fo 1 2 3\n", "1 rows that begin with 'fo' left out"),
        ("call other.obj\n", "1 rows that begin with 'call' left out"),
        ("f 1 3 2 4\n", ""),
    ],
)
def test_what_is_lost_is_said(rows: str, said: str) -> None:
    vertices, faces, notes = read(SQUARE + "f 1 2 3 4\n" + rows, ".obj")
    assert said in notes
    assert area(vertices, faces) == pytest.approx(1.0) or "1 3 2 4" in rows


def test_control_characters_of_a_file_do_not_reach_the_terminal() -> None:
    _, _, said = read(SQUARE + "f 1 2 3\n\x1b[31mred 1\n", ".obj")
    assert "\x1b" not in said
    assert "left out" in said


def test_a_file_of_words_is_no_mesh() -> None:
    with pytest.raises(UnusableMeshError, match="words where numbers belong"):
        read("v a b c\n" * 30_000, ".obj")


def test_looks_follow_the_faces_through_polygons_that_are_left_out() -> None:
    text = (
        SQUARE + "vt 0 0\nvt 1 0\nvt 1 1 0\nvt 0 1\nmtllib a b.mtl\nf 1 2 3\nusemtl red\nf 1 2\nf 1/1 2/2 3/-2/ 4/4\n"
    )
    painted = read_painted(text.encode() + b"usemtl blue\nf 1//1 3 4\n", Bounds("m.obj", 100))  # type: ignore[arg-type]
    assert painted.libraries == ["a b.mtl"]
    assert [painted.materials[k] for k in painted.material_of_face] == ["", "red", "red", "blue"]
    place = painted.surface.vertices[painted.surface.faces][..., :2]
    assert np.array_equal(painted.uv[1:3], place[1:3])
    assert np.isnan(painted.uv[[0, 3]]).all()


def test_a_hundred_thousand_faces_take_less_than_half_a_second() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=6)
    text = sphere.export(file_type="obj", include_normals=True)
    times = []
    for _ in range(2):
        start = time.process_time()
        _, faces, said = read(text, ".obj")
        times.append(time.process_time() - start)
    assert len(faces) == len(sphere.faces)
    assert said == ""
    assert min(times) < 0.5


@pytest.mark.parametrize(
    "corners",
    ["1/1/1 2/2/2 3/3/3", "1//1 2//2 3//3", "1/1 2/2 3/3", "1/2/ 2/2/ 3/1/", "1/1/1 2//2 3/3", "-3/1/1 -2/2/2 -1/3/3",
     "1/1/1  2/2/2 3/3/3 ", "1/1.0/1 2/x/2 3/3/3", "1/ 2/2 3/3"],
)  # fmt: skip
def test_the_first_number_of_a_corner_names_its_vertex_however_it_goes_on(corners: str) -> None:
    text = f"v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nf {corners}\n"
    _, faces, said = read(text, ".obj")
    assert faces.tolist() == [[0, 1, 2]]
    assert said == ""


@pytest.mark.parametrize("corners", ["/1/1 2/2/2 3/3/3", "/1/1 /2/2 /3/3", "1/1/1 2/2/2 //3"])
def test_a_corner_without_a_vertex_is_none(corners: str) -> None:
    with pytest.raises(UnusableMeshError):
        read(f"v 0 0 0\nv 1 0 0\nv 0 1 0\nf {corners}\n", ".obj")
