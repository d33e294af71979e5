"""Gates of convex pieces: what they hold beyond a surface, and what they run into."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from artsim.families import make
from artsim.loading.decomposition import DecompositionOptions, closed_volume, convex_pieces, decompose, union_volume
from artsim.model.convex_bodies import convex_hull
from artsim.model.objects import ArticulatedObject, Body
from tests.artsim.checks.piece_gates import check_pieces, union
from tests.artsim.loading.test_decomposition import tray
from tests.conftest import installed, rigid


def hulls(obj: ArticulatedObject) -> ArticulatedObject:
    """The object with one convex hull as each part's body."""
    parts = [replace(part, body=Body((convex_hull(part.vertices, 1e-4),), 100.0)) for part in obj.parts]
    return replace(obj, parts=tuple(parts))


def test_own_pieces_pass_and_hulls_that_close_a_box_do_not(one_drawer: ArticulatedObject) -> None:
    own = check_pieces(one_drawer, one_drawer)
    assert own.free
    assert own.same_volume
    assert 0 in own.volume_errors
    closed = check_pieces(one_drawer, hulls(one_drawer))  # the body's hull fills where the drawer is
    assert not closed.free
    assert not closed.same_volume


def test_overlaps_that_surfaces_have_themselves_do_not_count() -> None:
    obj = make("laptop", 0)
    inside = obj.tree.origins[1] - obj.parts[1].vertices.mean(axis=0)
    stuck = replace(obj.parts[1], vertices=obj.parts[1].vertices + inside)  # the lid stands across the base
    crossing = replace(obj, parts=(obj.parts[0], stuck))
    assert check_pieces(crossing, hulls(crossing)).free


def test_what_is_closed_is_told_from_what_is_open() -> None:
    box = trimesh.creation.box((0.3, 0.2, 0.1))
    vertices, faces = np.asarray(box.vertices), np.asarray(box.faces, np.int32)
    assert closed_volume(vertices, faces) == pytest.approx(0.006)
    assert closed_volume(vertices, faces[:, ::-1]) == pytest.approx(0.006)  # inside out
    assert closed_volume(vertices, faces[:11]) is None
    sheet = trimesh.creation.box((0.3, 0.2, 1e-5))
    assert closed_volume(np.asarray(sheet.vertices), np.asarray(sheet.faces, np.int32)) is None


@pytest.mark.slow
def test_thin_walls_are_cut_until_they_hold_their_volume(tmp_path: Path) -> None:
    installed("coacd")
    options = DecompositionOptions(concavity=0.05, cache=tmp_path)  # more than the walls are thick
    vertices, faces = tray()
    obj = rigid(trimesh.Trimesh(vertices, faces))
    scaled = vertices / obj.diagonal
    volume = closed_volume(scaled, faces)
    assert volume is not None
    error = union_volume(convex_pieces(scaled, faces, options)) / volume - 1.0
    assert abs(error) < 0.05
    gates = check_pieces(obj, decompose(obj, options, progress=False))
    assert gates.free
    assert gates.volume_errors == {0: pytest.approx(error, abs=1e-6)}


def test_a_union_counts_what_pieces_share_once() -> None:
    box = trimesh.creation.box((1.0, 1.0, 1.0))
    piece = np.asarray(box.vertices), np.asarray(box.faces, np.int32)
    moved = piece[0] + (0.5, 0.0, 0.0), piece[1]
    assert union([piece, moved]).volume() == pytest.approx(1.5)
