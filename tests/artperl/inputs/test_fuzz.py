"""Damaged files of every kind end in points or in one readable error, whatever bytes they hold."""

from __future__ import annotations

import contextlib
import json
import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from artperl.inputs import InputOptions, read_cloud
from artperl.inputs.intrinsics import read_camera
from artperl.inputs.masks import read_mask
from artsim.errors import ArtsimError
from tests.artperl.inputs.test_clouds import _files
from tests.artperl.inputs.test_intrinsics import FORMATS
from tests.artperl.inputs.test_masks import _pictures

pytestmark = pytest.mark.slow

CASES = Path(__file__).parents[2] / "cases"


def _corpus(folder: Path) -> list[tuple[str, bytes]]:
    files = [*_files().items()]
    files += [(name, (text if isinstance(text, str) else json.dumps(text)).encode()) for name, text in FORMATS.items()]
    for name, picture in _pictures().items():
        picture.save(folder / name)
        files.append((name, (folder / name).read_bytes()))
    np.savez_compressed(folder / "c.npz", points=np.ones((9, 3)), depth=np.ones((9, 9)), mask=np.ones((9, 9), bool))
    return [*files, ("c.npz", (folder / "c.npz").read_bytes())]


@pytest.fixture(scope="module")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, bytes]]:
    return _corpus(tmp_path_factory.mktemp("corpus"))


_TOKENS = [
    b"nan",
    b"-1",
    b"99999999999",
    b"1e400",
    b"inf",
    b"\x00",
    b"\xff" * 4,
    b"null",
    b"[[",
    b"{}",
    b'"',
    b"\n",
    b" ",
    b"",
]


@settings(max_examples=600, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_no_damaged_file_ends_in_a_traceback(
    data: st.DataObject, corpus: list[tuple[str, bytes]], tmp_path: Path
) -> None:
    name, content = data.draw(st.sampled_from(corpus))
    damaged = bytearray(content)
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(damaged)))
        cut = data.draw(st.integers(0, 12) | st.integers(0, len(damaged)))
        damaged[at : at + cut] = data.draw(st.sampled_from(_TOKENS) | st.binary(max_size=8))
    path = tmp_path / name
    path.write_bytes(damaged)
    depth = InputOptions(intrinsics=CASES / "S01" / "cam.json")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for read in (read_cloud, read_camera, read_mask, lambda p: read_cloud(p, depth)):
            with contextlib.suppress(ArtsimError):
                read(path)
