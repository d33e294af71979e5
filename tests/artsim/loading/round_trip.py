"""What an object that was written and loaded must have in common with the one it was."""

from __future__ import annotations

import numpy as np

from artsim.model.objects import ArticulatedObject
from artsim.model.part_inertia import part_inertia
from artsim.model.robot import as_robot

CLOSE = 1e-6
"""Metres, radians, and shares of masses and moments."""
FAMILIES = ("drawer", "laptop", "globe", "bottle", "fan", "scissors", "storage_furniture", "valve")
"""Slides, hinges, continuous joints, screws, and parts that follow others."""


def assert_same_object(loaded: ArticulatedObject, obj: ArticulatedObject) -> None:
    """Tree, axes, origins, limits, meshes, pieces, masses and inertias agree, and nothing had to be mended."""
    assert [str(repair) for repair in loaded.repairs if not repair.note] == []
    assert (loaded.category, loaded.object_id) == (obj.category, obj.object_id)
    assert [part.name for part in loaded.parts] == [part.name for part in obj.parts]
    assert loaded.tree.types == obj.tree.types
    assert [joint.name for joint in loaded.tree.joints[1:]] == [joint.name for joint in obj.tree.joints[1:]]
    np.testing.assert_array_equal(loaded.tree.parents, obj.tree.parents)
    np.testing.assert_array_equal(loaded.tree.rest, obj.tree.rest)
    np.testing.assert_allclose(loaded.tree.axes, obj.tree.axes, atol=CLOSE)
    np.testing.assert_allclose(loaded.tree.origins, obj.tree.origins, atol=CLOSE)
    np.testing.assert_allclose(loaded.tree.limits, obj.tree.limits, rtol=CLOSE, atol=CLOSE)
    for own, other in zip(loaded.tree.joints, obj.tree.joints, strict=True):
        np.testing.assert_allclose(own.pitch, other.pitch, atol=CLOSE)
        assert (own.mimic is None) == (other.mimic is None)
        if own.mimic is not None and other.mimic is not None:
            assert own.mimic.source == other.mimic.source
            np.testing.assert_allclose(own.mimic.multiplier, other.mimic.multiplier, rtol=CLOSE)
            np.testing.assert_allclose(own.mimic.offset, other.mimic.offset, atol=CLOSE)
    for k, (own, other) in enumerate(zip(loaded.parts, obj.parts, strict=True)):
        np.testing.assert_array_equal(own.faces, other.faces)
        np.testing.assert_allclose(own.vertices, other.vertices * obj.scale, atol=CLOSE)
        assert own.body is not None
        assert other.body is not None
        assert len(own.body.pieces) == len(other.body.pieces)
        for piece, expected in zip(own.body.pieces, other.body.pieces, strict=True):
            for extreme in (np.min, np.max):
                np.testing.assert_allclose(
                    extreme(piece[0], axis=0), extreme(expected[0], axis=0) * obj.scale, atol=CLOSE
                )
        inertia, expected_inertia = part_inertia(loaded, k), part_inertia(obj, k)
        np.testing.assert_allclose(inertia.mass, expected_inertia.mass, rtol=CLOSE)
        np.testing.assert_allclose(inertia.center, expected_inertia.center, atol=CLOSE)
        np.testing.assert_allclose(
            inertia.tensor, expected_inertia.tensor, atol=CLOSE * np.abs(expected_inertia.tensor).max()
        )
    for joint, expected_joint in zip(as_robot(loaded).joints, as_robot(obj).joints, strict=True):
        for name in ("effort", "velocity", "damping", "friction"):
            np.testing.assert_allclose(getattr(joint, name), getattr(expected_joint, name), rtol=CLOSE)


def assert_same_geometry(loaded: ArticulatedObject, obj: ArticulatedObject) -> None:
    """Trees, triangles, masses and inertias agree, whatever names and repairs say."""
    assert loaded.tree.types == obj.tree.types
    np.testing.assert_allclose(loaded.tree.axes, obj.tree.axes, atol=CLOSE)
    np.testing.assert_allclose(loaded.tree.origins, obj.tree.origins, atol=CLOSE)
    np.testing.assert_allclose(loaded.tree.limits, obj.tree.limits, atol=CLOSE)
    for k, (own, other) in enumerate(zip(loaded.parts, obj.parts, strict=True)):
        np.testing.assert_allclose(own.vertices[own.faces], other.vertices[other.faces], atol=CLOSE)
        inertia, expected = part_inertia(loaded, k), part_inertia(obj, k)
        np.testing.assert_allclose(inertia.mass, expected.mass, rtol=CLOSE)
        np.testing.assert_allclose(inertia.center, expected.center, atol=CLOSE)
        np.testing.assert_allclose(inertia.tensor, expected.tensor, atol=CLOSE * np.abs(expected.tensor).max())
