"""Finishes and coats fit their parts and come from chance alone."""

from __future__ import annotations

import numpy as np
import pytest

from artsim import make
from artsim.making.solids import box, cylinder
from artsim.model.appearance import Coat, Material
from artsim.model.appearance.finishes import FINISHES, draw_coats, draw_material, piece_of_face, repaint_coats

MATT = Material((0.6, 0.4, 0.2), roughness=1.0, specular=0.0)


def test_every_face_knows_the_piece_that_it_lies_on() -> None:
    body, knob = box((0, 0, 0), (1, 1, 1)), cylinder((0.5, 0.5, 0.9), (0.5, 0.5, 1.2), 0.1)
    vertices, faces = (body + knob).union()
    number = piece_of_face(vertices, faces, (body + knob).piece_meshes())
    middles = vertices[faces].mean(axis=1)
    assert (number == ((middles[:, 2] > 1.0 + 1e-9) | (np.hypot(*(middles[:, :2] - 0.5).T) < 0.1) & (
        middles[:, 2] > 0.5))).mean() == 1.0  # fmt: skip


def test_laptops_have_dark_keys_and_a_lit_screen() -> None:
    obj = make("laptop", 0)
    base, lid = draw_coats(obj, np.random.default_rng(0))
    assert max(base.materials[1].colour) < 0.15
    keys = base.material_of_face == 1
    assert 0.2 < keys.mean() < 1.0
    assert (obj.parts[0].vertices[obj.parts[0].faces[keys]][..., 2] > obj.parts[0].bounds[0, 2]).all()
    shown = lid.material_of_face == 2
    assert lid.materials[2].emission > 0
    assert lid.uv is not None
    assert np.isfinite(lid.uv[shown]).all()
    assert lid.uv[shown].min() == pytest.approx(0.0)
    assert lid.uv[shown].max() == pytest.approx(1.0)


@pytest.mark.slow
@pytest.mark.parametrize("category", ["drawer", "scissors", "globe", "random_tree", "kitchen_pot"])
def test_coats_fit_their_parts_and_come_from_chance_alone(category: str) -> None:
    obj = make(category, 1)
    first, again, other = (draw_coats(obj, np.random.default_rng(seed)) for seed in (0, 0, 9))
    for part, coat, same in zip(obj.parts, first, again, strict=True):
        assert len(coat.material_of_face) == len(part.faces)
        assert coat.material_of_face.max(initial=0) < len(coat.materials)
        assert [m.colour for m in coat.materials] == [m.colour for m in same.materials]
    assert [m.colour for c in first for m in c.materials] != [m.colour for c in other for m in c.materials]


def test_every_finish_makes_a_material() -> None:
    for name in FINISHES:
        material = draw_material(name, np.random.default_rng(0))
        assert all(0.0 <= value <= 1.0 for value in (*material.colour, material.roughness, material.metallic))
    coats = (Coat((MATT, MATT), np.zeros(1, np.int64)),)
    (new,) = repaint_coats(coats, np.random.default_rng(0))
    assert new.materials[0] is new.materials[1]
    assert new.materials[0].colour != MATT.colour
