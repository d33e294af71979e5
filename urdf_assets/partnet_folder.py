"""Objects written as PartNet-Mobility folders: Y-up meshes, an empty ``base`` link, joints without rotations."""

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from trimesh import Trimesh as Mesh

Array = NDArray[np.float64]
Vector = Sequence[float] | Array


@dataclass
class Link:
    """One part: its solids, and the joint that carries it (none for the root)."""

    name: str
    label: str
    solids: list[tuple[str, Mesh]]
    parent: str = "base"
    kind: str = "fixed"
    origin: Vector = (0, 0, 0)
    axis: Vector = (0, 0, 1)
    limits: tuple[float, float] = (0, 0)


@dataclass
class Model:
    """An object to be written."""

    category: str
    links: list[Link] = field(default_factory=list)


def y_up(vector: Vector) -> Array:
    """PartNet's mesh axes for a direction or point of the rest frame."""
    x, y, z = vector
    return np.array([-y, z, -x]) + 0.0


def numbers(vector: Vector) -> str:
    return " ".join(f"{v + 0.0:.6g}" for v in np.round(vector, 9))


def write(model: Model, folder: Path) -> None:
    """Write ``mobility.urdf``, meshes and side files."""
    meshes = folder / "textured_objs"
    meshes.mkdir(parents=True, exist_ok=True)
    lines = ['<?xml version="1.0" ?>', f'<robot name="artsim_{folder.name}">', '\t<link name="base"/>']
    origins = {link.name: np.array(link.origin, dtype=float) for link in model.links} | {"base": np.zeros(3)}
    count = 0
    for link in model.links:
        visuals, collisions = [], []
        for name, solid in link.solids:
            file = f"textured_objs/{count}.obj"
            count += 1
            (folder / file).write_text(obj_text(solid))
            shape = (
                f'<origin xyz="{numbers(y_up(-origins[link.name]))}"/><geometry><mesh filename="{file}"/></geometry>'
            )
            visuals.append(f'\t\t<visual name="{name}-{count}">{shape}</visual>')
            collisions.append(f"\t\t<collision>{shape}</collision>")
        lines += [f'\t<link name="{link.name}">', *visuals, *collisions, "\t</link>"]
        lines.append(f'\t<joint name="joint_{link.name.split("_")[1]}" type="{link.kind}">')
        if link.kind == "fixed":
            lines.append('\t\t<origin rpy="1.570796326794897 0 -1.570796326794897" xyz="0 0 0"/>')
        else:
            lines.append(f'\t\t<origin xyz="{numbers(y_up(origins[link.name] - origins[link.parent]))}"/>')
            lines.append(f'\t\t<axis xyz="{numbers(y_up(link.axis))}"/>')
            lines.append(f'\t\t<limit lower="{link.limits[0]:.9g}" upper="{link.limits[1]:.9g}"/>')
        lines += [f'\t\t<child link="{link.name}"/>', f'\t\t<parent link="{link.parent}"/>', "\t</joint>"]
    (folder / "mobility.urdf").write_text("\n".join([*lines, "</robot>", ""]))
    words = {"fixed": "static", "revolute": "hinge", "prismatic": "slider"}
    semantics = [f"{link.name} {words[link.kind]} {link.label}\n" for link in model.links]
    (folder / "semantics.txt").write_text("".join(semantics))
    (folder / "meta.json").write_text(json.dumps({"anno_id": folder.name, "model_cat": model.category}) + "\n")


def obj_text(solid: Mesh) -> str:
    lines = [f"v {numbers(y_up(vertex))}" for vertex in np.round(solid.vertices, 6)]
    lines += [f"f {a} {b} {c}" for a, b, c in (solid.faces + 1).tolist()]
    return "\n".join([*lines, ""])
