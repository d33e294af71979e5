"""Rest states: every instance of a category is aligned at the same state, whatever its file's zero."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st

import artsim
from artsim.loading.rest_state import canonical_category, rest_state
from artsim.loading.sources import find_sources
from artsim.model.joints import Joint
from artsim.model.kinematics import KinematicTree
from artsim.model.objects import ArticulatedObject
from artsim.model.transforms import transform_points
from tests.conftest import ASSETS, solid


def real(partnet_dir: Path, category: str) -> Iterator[ArticulatedObject]:
    return (artsim.load(source.path) for source in find_sources([partnet_dir / category]))


def normal(obj: ArticulatedObject, k: int) -> np.ndarray:
    """Direction of least extent of a part's surface, by its area-weighted second moments."""
    mesh = obj.part_mesh(k)
    points = trimesh.sample.sample_surface(mesh, 3000, seed=0)[0]
    return np.linalg.eigh(np.cov(points.T))[1][:, 0]


@pytest.mark.slow
def test_a_closed_laptops_lid_lies_on_its_base(partnet_dir: Path) -> None:
    for obj in real(partnet_dir, "Laptop"):
        low, high = obj.part_bounds[:, 0], obj.part_bounds[:, 1]
        base, lid = 0, int(np.argmax(np.ptp(obj.part_bounds[1:], axis=1).prod(axis=1))) + 1
        tilt = np.rad2deg(np.arccos(min(1.0, abs(normal(obj, lid)[2]))))
        assert tilt < 6, f"{obj.object_id}: lid tilted by {tilt:.1f} deg"
        assert obj.part_mesh(lid).centroid[2] > obj.part_mesh(base).centroid[2]  # weighted by area
        shared = np.minimum(high[lid], high[base]) - np.maximum(low[lid], low[base])
        smaller = np.minimum(obj.box_size[lid], obj.box_size[base])
        assert (shared[:2] > 0.8 * smaller[:2]).all(), f"{obj.object_id}: lid beside its base"
        opened = obj.tree.rest.copy()
        lower, upper = obj.tree.limits[lid]
        opened[lid] += 1.4 if upper - opened[lid] > opened[lid] - lower else -1.4
        raised = transform_points(obj.tree.forward_kinematics(opened)[lid], obj.parts[lid].vertices)
        assert np.ptp(raised[:, 2]) > 2 * (obj.bounds[1, 2] - obj.bounds[0, 2])
        assert raised[:, 0].max() > high[base, 0] - 0.35 * obj.box_size[base, 0]  # hinged at the back: front is -X


@pytest.mark.slow
def test_a_closed_box_is_shut(partnet_dir: Path) -> None:
    for obj in real(partnet_dir, "Box"):
        body = obj.part_bounds[0]
        for k in obj.tree.free_joints:
            flap = obj.part_bounds[k]
            middle = flap.mean(axis=0)
            assert (middle[:2] > body[0, :2]).all(), obj.object_id
            assert (middle[:2] < body[1, :2]).all(), obj.object_id
            assert middle[2] > body.mean(axis=0)[2], obj.object_id
        footprint = np.prod(np.ptp(obj.bounds, axis=0)[:2]) / np.prod(np.ptp(body, axis=0)[:2])
        assert footprint < 1.35, f"{obj.object_id}: a flap stands out"


def test_a_drawer_at_rest_is_inside_its_cabinet(partnet_dir: Path) -> None:
    for obj in real(partnet_dir, "StorageFurniture"):
        for k in obj.tree.free_joints:
            if obj.tree.types[k] == "prismatic" and "drawer" in obj.parts[k].label:
                opened = obj.tree.rest.copy()
                opened[k] = obj.tree.limits[k, 1]
                slide = obj.tree.forward_kinematics(opened)[k, :3, 3]
                assert slide[0] <= 0, f"{obj.object_id}: a drawer opens backwards"  # front is -X


def test_open_eyeglasses_have_parallel_legs_behind_the_frame(partnet_dir: Path) -> None:
    for obj in real(partnet_dir, "Eyeglasses"):
        size, center = obj.box_size, obj.box_center
        for leg in (1, 2):
            assert size[leg, 0] > 3 * size[leg, 1]
            assert center[leg, 0] > center[0, 0]


def test_a_closed_knife_is_short(partnet_dir: Path) -> None:
    for obj in real(partnet_dir, "Knife"):
        lengths = []
        for q in np.linspace(*obj.tree.limits[1], 9):
            T = obj.tree.forward_kinematics([0.0, q])
            corners = [transform_points(T[i], p.vertices) for i, p in enumerate(obj.parts)]
            lengths.append(np.linalg.norm(np.ptp(np.concatenate(corners), axis=0)))
        assert obj.diagonal < 1.02 * min(lengths), obj.object_id


def test_a_buckets_handle_is_upright_whatever_its_files_zero_is(partnet_dir: Path) -> None:
    turned = 0
    for obj in real(partnet_dir, "Bucket"):
        for k in obj.tree.free_joints:
            rim = obj.part_bounds[0, 1, 2]
            handle = obj.parts[k].vertices - np.array(obj.tree.joints[k].origin)
            across = handle - np.outer(handle @ obj.tree.axes[k], obj.tree.axes[k])
            top = across[np.argmax(np.linalg.norm(across, axis=1))]
            assert top[2] > 0.97 * np.linalg.norm(top), obj.object_id
            assert obj.part_bounds[k, 1, 2] > rim, obj.object_id
            turned += any("its handle is upright there" in repair.what for repair in obj.repairs)
    assert turned >= 6


@pytest.mark.slow
def test_rest_states_lie_within_the_limits(partnet_dir: Path) -> None:
    for category in ("Laptop", "Box", "Stapler", "Suitcase", "Knife", "Bucket"):
        for obj in real(partnet_dir, category):
            for k in obj.tree.free_joints:
                assert obj.tree.limits[k, 0] <= obj.tree.rest[k] <= obj.tree.limits[k, 1]


@given(st.floats(0.0, 1.9), st.sampled_from([-1.0, 1.0]), st.floats(0.0, 0.2))
def test_a_laptop_is_closed_at_rest_wherever_its_zero_is(zero: float, sign: float, beyond: float) -> None:
    """Two plates on a hinge whose file zero stands open by any angle, about either axis direction."""
    base = trimesh.creation.box(bounds=[[-0.15, -0.2, 0.0], [0.15, 0.2, 0.02]])
    lid = trimesh.creation.box(bounds=[[-0.15, -0.2, 0.022], [0.15, 0.2, 0.032]])
    hinge = (0.15, 0.0, 0.021)
    lid.apply_transform(trimesh.transformations.rotation_matrix(zero, [0, 1, 0], hinge))
    ends = sorted([sign * (-zero - beyond), sign * (2.0 - zero)])
    joint = Joint("hinge", "revolute", 0, (0.0, sign, 0.0), hinge, ends[0], ends[1])
    tree = KinematicTree([Joint("root", "free", -1), joint])
    rest, reasons = rest_state(tree, [solid("base", base), solid("lid", lid)], "laptop")
    assert np.rad2deg(abs(rest[1] + sign * zero)) < 1.0
    assert len(reasons) == (rest[1] != 0.0)


def test_our_own_laptop_is_closed_at_rest() -> None:
    obj = artsim.load(ASSETS / "laptop")
    assert np.rad2deg(obj.tree.rest[1]) == pytest.approx(-90, abs=0.5)
    assert any("a laptop is closed there" in repair.what for repair in obj.repairs)


def test_category_names_have_one_spelling() -> None:
    for name in ("StorageFurniture", "storage furniture", "storage-furniture", "Storage_Furniture"):
        assert canonical_category(name) == "storage_furniture"
