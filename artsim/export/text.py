"""How numbers and meshes are written."""

from collections.abc import Iterable

from artsim.model.robot import MeshShape


def number(value: float) -> str:
    """The shortest text that reads back as the same number; never -0."""
    return repr(float(value) + 0.0)


def numbers(values: Iterable[float]) -> str:
    """Several numbers."""
    return " ".join(map(number, values))


def obj_text(mesh: MeshShape) -> str:
    """A mesh as Wavefront OBJ, to the nanometre."""
    vertices = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in mesh.vertices.tolist()]
    faces = [f"f {a} {b} {c}" for a, b, c in (mesh.faces + 1).tolist()]
    return "\n".join([*vertices, *faces, ""])
