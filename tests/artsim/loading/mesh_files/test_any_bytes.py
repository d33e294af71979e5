"""Whatever the bytes of a mesh file are, it is read or refused."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from artsim.errors import ArtsimError
from artsim.loading.mesh_files import Bounds
from artsim.loading.meshes import UnusableMeshError
from tests.artsim.loading.mesh_builders import CORNERS, POINTS, SQUARE, WEDGE_DAE, dae, gltf, triangles
from tests.conftest import CASES

CUBE = trimesh.creation.box()
MORPHED = json.loads(gltf(POINTS, CORNERS, POINTS))
MORPHED["meshes"][0] |= {"weights": [0.5]}
MORPHED["meshes"][0]["primitives"][0] |= {"targets": [{"POSITION": 2}], "mode": 5}
SEEDS = [
    (".obj", (CASES / "M01" / "m.obj").read_bytes()),
    (".obj", (SQUARE + "vt 0 0\nf 1/1 2/1 \\\n3/1 4/1\nl 1 2\nf -1//-1 -2//-1 -3//-1 # c\n").encode()),
    (".dae", dae(WEDGE_DAE, asset='<unit meter="0.01"/><up_axis>Z_UP</up_axis>').encode()),
    (".dae", (CASES / "hostile" / "dae_instance_bomb" / "b.dae").read_bytes()),
    (".glb", (CASES / "M04" / "m.glb").read_bytes()),
    (".glb", CUBE.export(file_type="glb")),
    (".gltf", json.dumps(MORPHED).encode()),
    (".ply", CUBE.export(file_type="ply")),
    (".ply", CUBE.export(file_type="ply", encoding="ascii")),
    (".stl", CUBE.export(file_type="stl")),
    (".stl", CUBE.export(file_type="stl_ascii").encode()),
]
WORDS = [b"0", b"-1", b"99999999999999999999", b"1e308", b"nan", b"inf", b"-", b"/", b'"', b"<", b"[]", b"null", b"\n",
         b" ", b"\\", b"#", b"f ", b"\xff", b"\0", b"4294967295", b"true", b"{}", b"0.5", b""]  # fmt: skip


def survives(data: bytes, kind: str) -> None:
    try:
        vertices, faces, _ = triangles(data, kind, Path(f"m{kind}"))
    except (UnusableMeshError, ArtsimError):
        return
    assert np.isfinite(vertices).all()
    assert faces.dtype == np.int32
    assert len(faces) == 0 or (faces.min() >= 0 and faces.max() < len(vertices))


@pytest.mark.slow
@settings(max_examples=1500, suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.sampled_from(SEEDS), data=st.data())
def test_damaged_files(seed: tuple[str, bytes], data: st.DataObject) -> None:
    kind, content = seed
    damaged = bytearray(content)
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(damaged)))
        how = data.draw(st.sampled_from(["cut", "insert", "replace", "number", "end"]))
        word = data.draw(st.sampled_from(WORDS))
        numbers = list(re.finditer(rb"-?\d+(\.\d+)?", damaged))
        if how == "number" and numbers:
            found = numbers[at % len(numbers)]
            damaged[found.start() : found.end()] = word
        elif how == "cut":
            del damaged[at : at + data.draw(st.integers(1, 20))]
        elif how == "end":
            del damaged[at:]
        else:
            damaged[at : at + (len(word) if how == "replace" else 0)] = word
    survives(bytes(damaged), kind)


@given(kind=st.sampled_from([k for k, _ in SEEDS]), content=st.binary(max_size=400))
def test_random_bytes(kind: str, content: bytes) -> None:
    survives(content, kind)


@given(st.sampled_from([".obj", ".stl", ".ply"]), st.text("vf0123456789-/.# \n\t\\", max_size=200))
def test_random_text(kind: str, content: str) -> None:
    survives(content.encode(), kind)


@pytest.mark.parametrize("count", [10**12, 10**400])
def test_counts_in_messages_stay_short(count: int) -> None:
    with pytest.raises(ArtsimError) as error:
        Bounds(Path("m.obj"), 5).check(count, "triangles")
    assert len(str(error.value)) < 300
