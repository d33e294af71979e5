"""Files of shape bases."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path

import pytest
import torch

from artperl.retrieval.shape_base_file import read_shape_base, write_shape_base
from artsim.errors import DatasetError
from tests.artperl.worlds import small_base


def test_a_base_comes_back_from_its_file(tmp_path: Path) -> None:
    base = small_base("laptop", "drawer", objects=3)
    write_shape_base(base, tmp_path / "base.npz")
    back = read_shape_base(tmp_path / "base.npz")
    assert (back.object_ids, back.categories, back.trees) == (base.object_ids, base.categories, base.trees)
    assert base.embeddings is not None
    assert back.embeddings is not None
    torch.testing.assert_close(back.embeddings, base.embeddings)
    torch.testing.assert_close(back.shapes.points, base.shapes.points, atol=2.5e-4, rtol=0.0)
    torch.testing.assert_close(back.shapes.normals, base.shapes.normals, atol=8e-3, rtol=0.0)
    for field in fields(base.shapes.trees):
        torch.testing.assert_close(getattr(back.shapes.trees, field.name), getattr(base.shapes.trees, field.name))


@pytest.mark.parametrize("name", ["broken.npz", "missing.npz"])
def test_what_is_no_base_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "broken.npz").write_bytes(b"not a base")
    with pytest.raises(DatasetError, match="shape base"):
        read_shape_base(tmp_path / name)
