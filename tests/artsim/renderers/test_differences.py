"""The agreement report tells a wrong part from a pixel's rounding."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

import artsim
from artsim import Camera
from artsim.model.frame import BACKGROUND, Frame
from artsim.model.joints import Joint
from artsim.model.kinematics import KinematicTree
from artsim.model.objects import ArticulatedObject
from artsim.renderers import render
from tests.agreement import CLASSES, LIMITS, Agreement, Scene, classify, grazing, slivers
from tests.conftest import ASSETS, rigid, solid


def cabinet() -> Scene:
    obj = artsim.load(ASSETS / "cabinet").with_diagonal(1.0)
    return obj, obj.tree.rest + [0, 0.1, 0.2, 0.05], Camera.look_at([-1.5, 0.4, 0.8], [0, 0, 0], 320, 240)


def compared(scene: Scene, rays: Frame, other: Frame) -> Agreement:
    agreement = Agreement()
    agreement.add(scene, rays, other)
    return agreement


def test_a_wrong_part_or_depth_in_the_middle_of_a_surface_is_unexplained() -> None:
    scene = cabinet()
    rays = render(*scene)
    ids, depth = rays.part_ids.copy(), rays.depth.copy()
    whole = classify(scene, rays, rays)["unexplained"] & (ids != BACKGROUND)
    row, column = np.argwhere(whole)[whole.sum() // 2]
    spot = np.s_[row - 1 : row + 2, column - 1 : column + 2]
    assert whole[spot].all()
    depth[spot] += 0.005
    agreement = compared(scene, rays, Frame(depth, ids))
    assert agreement.depth_off.total() == 9
    wrong = np.where(np.indices(ids.shape)[1] < 160, 0, ids).astype(np.uint8)
    wrong[ids == BACKGROUND] = BACKGROUND
    agreement = compared(scene, rays, replace(rays, part_ids=wrong))
    assert agreement.ids_differ["unexplained"] > 1000
    assert not agreement.agrees(LIMITS["pybullet"])


def test_a_picture_moved_by_a_pixel_differs_at_edges_alone() -> None:
    scene = cabinet()
    rays = render(*scene)
    agreement = compared(scene, rays, Frame(np.roll(rays.depth, 1, axis=1), np.roll(rays.part_ids, 1, axis=1)))
    assert agreement.ids_differ["silhouette"] > 100
    assert agreement.ids_differ["edge"] > 10
    assert agreement.ids_differ["unexplained"] == agreement.ids_differ["coincident surfaces"] == 0


def test_which_of_two_equal_surfaces_is_seen_is_chance() -> None:
    tree = KinematicTree([Joint("root", "free", -1), Joint("turn", "continuous", 0, lower=-np.inf, upper=np.inf)])
    box = trimesh.creation.box((1, 1, 1))
    scene = ArticulatedObject("o", "c", (solid("a", box), solid("b", box)), tree, "0" * 64), np.zeros(2), cabinet()[2]
    rays = render(*scene)
    swapped = np.where(rays.part_ids == 0, 1, rays.part_ids).astype(np.uint8)
    agreement = compared(scene, rays, replace(rays, part_ids=swapped))
    assert agreement.ids_differ["coincident surfaces"] == agreement.object_pixels == (rays.part_ids == 0).sum()


def test_every_pixel_is_of_one_class() -> None:
    scene = cabinet()
    masks = classify(scene, render(*scene), render(*scene))
    assert list(masks) == list(CLASSES)
    assert (np.sum(list(masks.values()), axis=0) == 1).all()


@pytest.mark.parametrize("angle", [0.0, 0.2, 0.6, np.pi / 4, 1.1])
def test_what_is_thinner_than_three_pixels_is_a_sliver(angle: float) -> None:
    rows, columns = np.indices((80, 80)) - 40.0
    across = rows * np.cos(angle) + columns * np.sin(angle)

    def shown(mask: np.ndarray) -> Frame:
        return Frame(mask.astype(np.float32), np.where(mask, 0, BACKGROUND).astype(np.uint8))

    line = np.abs(across) < 0.7
    inner = np.s_[10:-10, 10:-10]
    assert (slivers(shown(line)) & line)[inner].sum() == line[inner].sum()
    assert not slivers(shown(across > 0.1))[inner].any(), "a straight border is none"


@pytest.mark.parametrize(("tilt", "grazes"), [(60.0, False), (77.0, False), (83.0, True)])
def test_surfaces_seen_at_more_than_80_degrees_graze(tilt: float, grazes: bool) -> None:
    plate = trimesh.creation.box((4, 4, 1e-3))
    angle = np.deg2rad(tilt)
    camera = Camera.look_at([-3 * np.sin(angle), 0, 3 * np.cos(angle)], [0, 0, 0], 320, 240, fov_y=0.02)
    frame = render(rigid(plate), [0.0], camera)
    assert (grazing(frame, camera)[100:140, 140:180] == grazes).all()
