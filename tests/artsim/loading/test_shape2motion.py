"""Objects in the layout of Shape2Motion are those that were written there, but for limits, of which it knows none."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

import artsim
from artsim.errors import AssetError
from artsim.loading.sources import find_sources
from artsim.model.objects import ArticulatedObject

CLOSE = 1e-6
"""Metres."""


def write_shape2motion(obj: ArticulatedObject, folder: Path) -> Path:
    """``motion_attributes.json`` and ``part_objs``; its joints have no limits."""
    (folder / "part_objs").mkdir(parents=True)
    kinds = {"free": "none", "revolute": "rotation", "continuous": "rotation", "prismatic": "translation"}
    nodes: list[dict[str, Any]] = []
    for k, (part, joint) in enumerate(zip(obj.parts, obj.tree.joints, strict=True)):
        name = f"dof_rootd_Aa{k:03d}_{'r' if joint.type != 'prismatic' else 't'}" if k else "dof_rootd"
        nodes.append({"dof_name": name, "motion_type": kinds[joint.type], "children": []})
        nodes[k] |= {"center": list(joint.origin), "direction": list(joint.axis) if k else [1, 0, 0]}
        if k:
            nodes[joint.parent]["children"].append(nodes[k])
        trimesh.Trimesh(part.vertices, part.faces, process=False).export(
            folder / "part_objs" / f"{name if k else 'none_motion'}.obj", digits=12
        )
    (folder / "motion_attributes.json").write_text(json.dumps(nodes[0]))
    return folder / "motion_attributes.json"


@pytest.mark.parametrize(("category", "seed"), [("storage_furniture", 3), ("laptop", 0)])
def test_shape2motion_comes_back_without_limits(category: str, seed: int, tmp_path: Path) -> None:
    obj = artsim.make(category, seed)
    write_shape2motion(obj, tmp_path / category / "0003")
    (source,) = find_sources([tmp_path])
    loaded = source.load()
    assert (loaded.category, loaded.object_id) == (category, "0003")
    told = "\n".join(map(str, loaded.repairs))
    for own, joint in zip(loaded.tree.joints[1:], obj.tree.joints[1:], strict=True):
        turns = joint.type == "revolute"
        assert own.type == ("continuous" if turns else "prismatic")
        assert f"{own.name!r}: {'does not say how far it turns' if turns else 'limits -inf and inf mean'}" in told
    np.testing.assert_allclose(loaded.tree.axes, obj.tree.axes, atol=CLOSE)
    np.testing.assert_allclose(loaded.tree.origins, obj.tree.origins, atol=CLOSE)
    for part, other in zip(loaded.parts, obj.parts, strict=True):
        np.testing.assert_allclose(part.vertices[part.faces], other.vertices[other.faces], atol=CLOSE)


def test_a_tree_of_shape2motion_that_is_wrong_is_refused(tmp_path: Path) -> None:
    file = write_shape2motion(artsim.make("drawer", 0), tmp_path / "drawer" / "1")
    good = json.loads(file.read_text())
    for change, said in (
        ({"motion_type": "spiral"}, "not supported"),
        ({"center": None}, "no list of 3 numbers"),
        ({"dof_name": ""}, "no text"),
        ({"children": 3}, "no list"),
    ):
        bad = json.loads(json.dumps(good))
        bad["children"][0] |= change
        file.write_text(json.dumps(bad))
        with pytest.raises(AssetError, match=said):
            artsim.load(file)
