"""Finishes of an exported object: its surfaces by material, with normals and places on textures, and the materials."""

import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image as Picture

from artsim.export.text import number
from artsim.model.appearance import Material, patches
from artsim.model.appearance.finishes import draw_coats
from artsim.model.kinematics import Array
from artsim.model.robot import Robot

MATERIALS_FILE = "materials.mtl"
"""Lies beside the meshes, with the pictures of its textures."""


@dataclass(frozen=True, eq=False)
class Look:
    """What of a link's surface is of one material."""

    name: str
    """Of its mesh, where it has a file of its own."""
    material: str
    """Key of :attr:`Finish.materials`."""
    vertices: Array
    normals: Array
    """(N, 3) float. Rest frame, metres."""
    uv: Array
    """(N, 2) float. Places on the texture, from its lower left corner, the whole being 1 wide and high; it repeats
    beyond."""
    faces: NDArray[np.int32]
    """(F, 3) int."""


@dataclass(frozen=True, eq=False)
class Finish:
    """Looks of each link, by the link's name, and the materials by theirs."""

    looks: Mapping[str, tuple[Look, ...]]
    materials: Mapping[str, Material]

    @property
    def pictures(self) -> dict[str, bytes]:
        """PNG files of the textures, by name."""
        return {f"{name}.png": _png(m.texture) for name, m in self.materials.items() if m.texture is not None}


NO_FINISH = Finish({}, {})


def draw_finish(robot: Robot) -> Finish:
    """Finishes for an object, as the renderers draw them for its category; the same object has the same.

    Parameters
    ----------
    robot : Robot
    """
    obj = robot.obj
    rng = np.random.default_rng(int(obj.sha256[:16] or "0", 16))
    names: dict[int, str] = {}
    materials: dict[str, Material] = {}
    looks: dict[str, tuple[Look, ...]] = {}
    coats = draw_coats(obj, rng)
    for link in robot.links:
        if link.part < 0 or link.visual is None:
            continue
        part, found = obj.parts[link.part], []
        for count, patch in enumerate(patches(part, coats[link.part], obj.scale, part.body is not None)):
            name = names.setdefault(id(patch.material), f"material{len(names)}")
            materials[name] = patch.material
            rows = np.concatenate([patch.vertices * obj.scale, patch.normals, patch.uv], axis=1).astype(np.float64)
            rows, index = np.unique(np.round(rows, 7), axis=0, return_inverse=True)
            faces = index.reshape(-1, 3).astype(np.int32)
            apart = (faces != np.roll(faces, 1, axis=1)).all(axis=1)  # rounding may join corners of slivers
            places, normals, uv = rows[:, :3], rows[:, 3:6], rows[:, 6:]
            found.append(Look(f"{link.name}-look{count}", name, places, normals, uv, faces[apart]))
        looks[link.name] = tuple(found)
    return Finish(looks, materials)


def looks_text(looks: Sequence[Look]) -> str:
    """Surfaces of several materials as one Wavefront OBJ file."""
    lines, first = [f"mtllib {MATERIALS_FILE}"], 1
    for look in looks:
        lines += [f"v {x:.7f} {y:.7f} {z:.7f}" for x, y, z in look.vertices.tolist()]
        lines += [f"vt {u:.6f} {v:.6f}" for u, v in look.uv.tolist()]
        lines += [f"vn {x:.5f} {y:.5f} {z:.5f}" for x, y, z in look.normals.tolist()]
        lines.append(f"usemtl {look.material}")
        lines += [f"f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}" for a, b, c in (look.faces + first).tolist()]
        first += len(look.vertices)
    return "\n".join([*lines, ""])


def materials_text(materials: Mapping[str, Material]) -> str:
    """Materials as a Wavefront MTL file, with the extensions for physically based rendering."""
    lines: list[str] = []
    for name, material in materials.items():
        colour = (1.0, 1.0, 1.0) if material.texture is not None else material.colour
        lines += [f"newmtl {name}", f"Kd {_row(colour)}", f"Ks {_row([0.2 * material.specular] * 3)}"]
        lines += [f"Ns {number(round(2.0 / max(material.roughness, 0.05) ** 4, 1))}", "illum 2"]
        lines += [f"Pr {number(material.roughness)}", f"Pm {number(material.metallic)}"]
        lines += [f"Ke {_row(material.emission * np.asarray(material.colour))}"] if material.emission else []
        lines += [f"map_Kd {name}.png"] if material.texture is not None else []
        lines.append("")
    return "\n".join(lines)


def _row(values: Iterable[float]) -> str:
    return " ".join(f"{float(value):.6g}" for value in values)


def _png(image: NDArray[np.uint8]) -> bytes:
    buffer = io.BytesIO()
    Picture.fromarray(image).save(buffer, format="png", optimize=True)
    return buffer.getvalue()
