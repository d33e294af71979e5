""""""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import artsim
from artsim.errors import AssetError
from artsim.loading.urdf import load
from tests.conftest import ASSETS


def test_an_object_file_reads_back_the_same(tmp_path: Path) -> None:
    from artsim.model.object_file import load_object, save_object

    obj = load(ASSETS / "cabinet")
    save_object(obj, tmp_path / "cabinet.npz")
    again = load_object(tmp_path / "cabinet.npz")
    assert again.native_tree == obj.native_tree
    assert again.sha256 == obj.sha256
    assert again.repairs == obj.repairs
    assert all(np.array_equal(a.vertices, b.vertices) for a, b in zip(obj.parts, again.parts, strict=True))


def resaved(path: Path, **changes: Any) -> Path:
    """An object file with other arrays, or, for what is no array, another header."""
    from artsim.model.object_file import save_object

    save_object(artsim.load(ASSETS / "laptop"), path)
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files}
    header = json.loads(arrays["header"].tobytes())
    for name, change in changes.items():
        if name in arrays:
            arrays[name] = change(arrays[name])
        else:
            header[name] = change(header[name])
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    np.savez(path, **arrays)
    return path


def _joint(**changes: Any) -> Callable[[dict[str, Any]], dict[str, Any]]:
    return lambda tree: {"joints": [tree["joints"][0], tree["joints"][1] | changes, *tree["joints"][2:]]}


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"tree": _joint(parent=1)}, "a parent must come before its children"),
        ({"tree": _joint(parent=-5)}, "no number of a joint"),
        ({"tree": _joint(parent=True)}, "no number of a joint"),
        ({"tree": _joint(mimic=[1, 1.0, 0.0])}, "form a loop"),
        ({"tree": _joint(mimic=[1, 1.0])}, "not three values"),
        ({"tree": _joint(axis=[0.0, 0.0, 2.0])}, "not a unit vector"),
        ({"tree": _joint(axis=[1e308, 1e308, 1e308])}, "no number in range"),
        ({"tree": _joint(rest=None)}, "no number in range"),
        ({"tree": _joint(lower="a")}, "no number in range"),
        ({"tree": lambda tree: {"joints": tree["joints"] * 1000}}, "no list of joints"),
        ({"tree": lambda tree: tree["joints"]}, "no list of joints"),
        ({"names": lambda names: names * 2}, "not 2 texts"),
        ({"names": lambda names: [None] * len(names)}, "not 2 texts"),
        ({"scale": lambda scale: -1.0}, "scale is -1"),
        ({"scale": lambda scale: "1"}, "not numbers of shape"),
        ({"T_base_rest": lambda T: T[:3]}, "not numbers of shape"),
        ({"object_id": lambda name: "\ud800"}, "surrogates not allowed"),
        ({"repairs": lambda repairs: [["a"]]}, "not 2 texts"),
        ({"source_joints": lambda joints: {"a": [9, 1.0]}}, "source joint a"),
        ({"format": lambda form: 2}, "its format is 2"),
        ({"vertices": lambda v: v * np.nan}, "not finite"),
        ({"vertices": lambda v: v * 0}, "no extent"),
        ({"vertices": lambda v: v[:-1]}, "add up to"),
        ({"vertices": lambda v: v.astype("U8")}, "vertices are <U8"),
        ({"faces": lambda f: f - 1}, "corner that does not exist"),
        ({"faces": lambda f: f + 10_000}, "corner that does not exist"),
        ({"faces": lambda f: f[:0]}, "no triangle"),
        ({"faces": lambda f: f.astype(np.float64)}, "faces are float64"),
        ({"face_counts": lambda c: c[::-1]}, "does not exist"),
        ({"vertex_counts": lambda c: -c}, "do not fit"),
        ({"vertex_counts": lambda c: np.array([2**62, 2**62], np.int64)}, "add up to"),
    ],
)  # fmt: skip
def test_a_damaged_object_file_is_refused(changes: dict[str, Any], text: str, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=text) as caught:
        artsim.load(resaved(tmp_path / "o.npz", **changes))
    assert "Fix: generate it again" in str(caught.value)
