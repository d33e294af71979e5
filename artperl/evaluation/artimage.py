"""Regenerated ArtImage: its five categories, seen as it sees them, objects that no estimator was trained on.

Objects and views are made here, so that figures are not to be mixed with published ones, which are of the original
images; :mod:`artperl.evaluation.artimage_files` reads those. Rows:

- ``procedural``: 40 objects of each category, seeds that streams, bases and validation never reach;
- ``real``: PartNet-Mobility objects of the frozen test half, weights that have never seen a real object;
- ``real_trained``: the same, weights that have learnt from the other half, too;
- ``procedural_sphere`` and ``real_sphere``: seen from all round.
"""

import hashlib
import json
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from artperl.core.part_order import sort_parts
from artperl.data.categories import ARTIMAGE, Parts, objects_of, opens_to_the_back
from artperl.evaluation.samples import NUM_POINTS, TEST_SEEDS, samples_of
from artsim.datasets.plan import SampleOptions
from artsim.errors import AssetError, ConfigError
from artsim.loading.urdf import load
from artsim.model.draws import ViewOptions, ViewPreset
from artsim.model.kinematics import KinematicTree
from artsim.model.objects import ArticulatedObject, Part
from artsim.observing.sample import Sample

SPLIT = Path(__file__).with_suffix(".json")
"""Real objects: ``{category: {"train" or "test": {"Folder/id": SHA-256 of the URDF file}}}``."""

Row = Literal["procedural", "real", "real_trained", "procedural_sphere", "real_sphere"]
ROWS: tuple[Row, ...] = ("procedural", "real", "real_trained", "procedural_sphere", "real_sphere")

OBJECTS, VIEWS = 40, 500
"""Procedural objects of each category; and the least number of views of a row."""


def row_objects(
    row: Row, category: str, partnet: Path | None = None, objects: int = OBJECTS
) -> list[ArticulatedObject]:
    """Test objects of one category: always the same ones. Empty where there is no real object.

    Parameters
    ----------
    row : Row
    category : str
        One of :data:`ARTIMAGE`.
    partnet : Path, optional
        Folder of real objects, for the rows that need them.
    objects : int
        Procedural ones.
    """
    if row.startswith("procedural"):
        return objects_of([category], objects, TEST_SEEDS)
    return real_objects(category, "test", partnet)


def row_samples(
    row: Row, tested: Sequence[ArticulatedObject], views: int = VIEWS, num_points: int = NUM_POINTS
) -> list[Sample]:
    """Views of a row's objects: always the same ones.

    Parameters
    ----------
    row : Row
    tested : sequence of ArticulatedObject
        As :func:`row_objects` gives them.
    views : int
        In all, at least.
    num_points : int
        Of a cloud: pixels of the object, drawn at random.
    """
    preset: ViewPreset = "sphere" if row.endswith("_sphere") else "artimage"
    options = SampleOptions(num_points=num_points, views=ViewOptions(preset=preset))
    return samples_of(tested, -(-views // len(tested)), options)


def real_objects(category: str, half: Literal["train", "test"], partnet: Path | None) -> list[ArticulatedObject]:
    """Real objects of one half of the frozen split, with the parts that the category has in ArtImage.

    Raises
    ------
    AssetError
        When one is missing, or is not the one that was split.
    """
    split = json.loads(SPLIT.read_text())
    if split[category][half] and partnet is None:
        raise AssetError("no folder of real objects is named", "partnet", "set ARTSIM_PARTNET_DIR")
    objects = []
    for name, digest in split[category][half].items():
        path = Path(partnet or ".", name, "mobility.urdf")
        if not path.is_file():
            raise AssetError("an object of the split is missing", path, "complete the folder")
        if hashlib.sha256(path.read_bytes()).hexdigest() != digest:
            raise AssetError("differs from the file that was split", path, "restore it")
        objects.append(restrict_joints(load(path), ARTIMAGE[category], category))
    return objects


def has_half(category: str, half: Literal["train", "test"]) -> bool:
    """Whether there are real objects of a category to learn from, or to test on."""
    return bool(json.loads(SPLIT.read_text())[category][half])


def real_train_objects(categories: Sequence[str]) -> list[ArticulatedObject]:
    """Real objects to learn from, in the folder that ``ARTSIM_PARTNET_DIR`` names.

    Raises
    ------
    ConfigError
        When there is none of these categories.
    """
    folder = os.environ.get("ARTSIM_PARTNET_DIR")
    partnet = Path(folder) if folder else None
    objects = [obj for c in categories if c in ARTIMAGE for obj in real_objects(c, "train", partnet)]
    if not objects:
        raise ConfigError("there is no real object to learn from", ", ".join(categories))
    return objects


def match_category(obj: ArticulatedObject, categories: Sequence[str], parts: Parts) -> ArticulatedObject:
    """An object of a file as an estimator of these categories and parts knows such objects.

    Files number their parts in any order, and may have some that a category does not have in ArtImage.
    """
    category = categories[0] if len(set(categories)) == 1 else ""
    if parts == "artimage" and category in ARTIMAGE:
        return restrict_joints(obj, ARTIMAGE[category], category)
    return sort_parts(obj)


def restrict_joints(obj: ArticulatedObject, joint_types: Sequence[str], category: str) -> ArticulatedObject:
    """The object as one of another category: parts that move otherwise, such as a dishwasher's buttons, stay at rest.

    Which of two temples or of three drawers comes first differs from file to file, and a file's table may have its
    drawers at the back. Here they come as in procedural objects: they open to the front (-x), from the top down, and
    from -y to +y where they are side by side.

    Parameters
    ----------
    obj : ArticulatedObject
    joint_types : sequence of str
        Kinds of joints that go on moving.
    category : str
        That the object is to have.
    """
    tree = obj.native_tree
    if "prismatic" in joint_types and opens_to_the_back(tree.types, [joint.axis for joint in tree.joints]):
        obj = half_turn(obj)
        tree = obj.native_tree
    owner = list(range(len(tree)))
    for k in range(1, len(tree)):
        if tree.types[k] not in joint_types:
            owner[k] = owner[int(tree.parents[k])]
    kept = [k for k, own in enumerate(owner) if own == k]
    number = {k: n for n, k in enumerate(kept)}
    joints = []
    for k in kept:
        joint = tree.joints[k]
        mimic = joint.mimic if joint.mimic is not None and joint.mimic.source in number else None
        mimic = None if mimic is None else replace(mimic, source=number[mimic.source])
        joints.append(replace(joint, parent=-1 if k == 0 else number[owner[joint.parent]], mimic=mimic))
    parts = tuple(_join([part for part, own in zip(obj.parts, owner, strict=True) if own == k]) for k in kept)
    # What the file calls its joints no longer fits.
    return sort_parts(replace(obj, category=category, parts=parts, native_tree=KinematicTree(joints), source_joints={}))


def half_turn(obj: ArticulatedObject) -> ArticulatedObject:
    """The object turned by half a turn about the vertical, without what is known of its parts but their surfaces."""
    half = np.array([-1.0, -1.0, 1.0])
    parts = tuple(replace(part, vertices=part.vertices * half, body=None) for part in obj.parts)
    joints = [
        replace(joint, axis=tuple(half * joint.axis), origin=tuple(half * joint.origin))
        for joint in obj.native_tree.joints
    ]
    T_base_rest = obj.T_base_rest @ np.diag([*half, 1.0])
    return replace(obj, parts=parts, native_tree=KinematicTree(joints), T_base_rest=T_base_rest)


def _join(parts: Sequence[Part]) -> Part:
    """One part of several; the first gives its name."""
    if len(parts) == 1:
        return parts[0]
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = [part.faces + start for part, start in zip(parts, starts, strict=False)]
    return replace(
        parts[0], vertices=np.concatenate([part.vertices for part in parts]),
        faces=np.concatenate(faces).astype(np.int32), body=None,
    )  # fmt: skip
