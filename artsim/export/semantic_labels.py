"""Semantic labels of USD files: what an object, its parts and its materials are, in words and as items of Wikidata."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from artsim.model.details import on_faces
from artsim.model.robot import Link, Robot

OBJECT = "Q488383"
"""The item of Wikidata for any object, for categories without one of their own."""
CATEGORIES = {
    "bottle": "Q80228", "box": "Q188075", "bucket": "Q47107", "camera": "Q15328", "cart": "Q15618781",
    "chair": "Q15026", "clock": "Q376", "coffee_machine": "Q211841", "cutter": "Q23769", "dishwasher": "Q186263",
    "dispenser": "Q27098499", "display": "Q5290", "door": "Q36794", "drawer": "Q14745", "eyeglasses": "Q37501",
    "fan": "Q6498398", "faucet": "Q656656", "folding_chair": "Q1744391", "folding_knife": "Q390383",
    "globe": "Q133792", "kettle": "Q107444", "keyboard": "Q250", "kitchen_pot": "Q60310748", "lamp": "Q1138737",
    "laptop": "Q3962", "lighter": "Q20459", "microwave": "Q127956", "mouse": "Q7987", "oven": "Q36539",
    "pen": "Q165447", "phone": "Q11035", "pliers": "Q13049940", "printer": "Q82", "refrigerator": "Q37828",
    "remote": "Q185091", "robot_arm": "Q11012", "safe": "Q471898", "scissors": "Q40847", "stapler": "Q489157",
    "storage_furniture": "Q2741056", "suitcase": "Q200814", "switch": "Q5320", "table": "Q14748",
    "toaster": "Q14890", "toilet": "Q7857", "trash_can": "Q216530", "usb": "Q1647694", "valve": "Q208443",
    "washing_machine": "Q124441", "window": "Q35473",
}  # fmt: skip
"""Items of Wikidata for categories; cart, drawer, robot_arm
have that of a broader class."""
PARTS = {
    "button": "Q870870", "door": "Q36794", "handle": "Q200266", "hinge": "Q244330", "lever": "Q40164",
    "glass": "Q11469", "knob": "Q200266",
    "lid": "Q2488579", "shelf": "Q45242859", "tray": "Q613972", "wheel": "Q446", "window": "Q35473",
}  # fmt: skip
"""Items of Wikidata for words of labels of parts."""
UNKNOWN_SUBSTANCE = "plastic"
"""Stands for a material of which nothing is known: labels must not be empty."""


def category_item(category: str) -> str:
    """The item of a category."""
    return CATEGORIES.get(category, OBJECT)


def part_item(label: str) -> str | None:
    """The item of a part's label, such as ``door_left``: of its last word that has one."""
    return next((PARTS[word] for word in reversed(label.split("_")) if word in PARTS), None)


def add_labels(stage: Any, robot: Robot, paths: Sequence[Any], substances: Mapping[Any, str]) -> None:
    """Labels of the whole, of each link, and of each material.

    Parameters
    ----------
    stage : pxr.Usd.Stage
    robot : Robot
    paths : sequence of pxr.Sdf.Path
        Of the links.
    substances : mapping
        Of materials, by the path of their prim.
    """
    category = robot.obj.category or "object"
    _label(stage.GetDefaultPrim(), "class", category)
    _label(stage.GetDefaultPrim(), "wikidata_qcode", category_item(category))
    for link, path in zip(robot.links, paths, strict=True):
        if link.part > 0:
            word = robot.obj.parts[link.part].label
            _label(stage.GetPrimAtPath(path), "class", word)
            if (item := part_item(word)) is not None:
                _label(stage.GetPrimAtPath(path), "wikidata_qcode", item)
        _label_details(stage, robot, link, path)
    for path, substance in substances.items():
        _label(stage.GetPrimAtPath(path), "material", substance or UNKNOWN_SUBSTANCE)


def _label_details(stage: Any, robot: Robot, link: Link, path: Any) -> None:
    """Labels of the frames of handles, knobs and panes, and of their faces of what is seen."""
    from pxr import UsdGeom

    if not link.details:
        return
    mesh, part = UsdGeom.Mesh(stage.GetPrimAtPath(path.AppendChild("visual"))), robot.obj.parts[link.part]
    points, index = np.asarray(mesh.GetPointsAttr().Get(), float), np.asarray(mesh.GetFaceVertexIndicesAttr().Get())
    middles = points[index.reshape(-1, 3)].mean(axis=1) + link.origin
    for number, detail in enumerate(link.details):
        prims = [stage.GetPrimAtPath(path.AppendChild(detail.name))]
        own = on_faces(middles, part.vertices * robot.obj.scale, part.faces[part.detail_of_face == number], _ON_FACE)
        if own.any():
            faces = np.flatnonzero(own).tolist()
            subset = UsdGeom.Subset.CreateGeomSubset(mesh, detail.name, UsdGeom.Tokens.face, faces, "semantics")
            prims.append(subset.GetPrim())
        for prim in prims:
            _label(prim, "class", detail.label)
            if (item := part_item(detail.label)) is not None:
                _label(prim, "wikidata_qcode", item)


_ON_FACE = 1e-6
"""Metres by which the middle of a face, in single precision, may miss the surface that it is of."""


def _label(prim: Any, taxonomy: str, word: str) -> None:
    from pxr import UsdSemantics

    UsdSemantics.LabelsAPI.Apply(prim, taxonomy).CreateLabelsAttr([word])
