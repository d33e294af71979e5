"""Mesh files of many formats, read by one function.

Files are untrusted. Readers count what a file declares before they expand it, open no other file but a glTF file's own
buffers, and say whatever does not arrive.
"""

from collections.abc import Callable

import numpy as np

from artsim.loading.mesh_files.dae import read_dae
from artsim.loading.mesh_files.gltf import read_gltf
from artsim.loading.mesh_files.msh import read_msh
from artsim.loading.mesh_files.obj import read_obj
from artsim.loading.mesh_files.ply import read_ply
from artsim.loading.mesh_files.stl import read_stl
from artsim.loading.mesh_files.surface import Bounds, Surface, UnusableMeshError

__all__ = ["FORMATS", "Bounds", "Surface", "UnusableMeshError", "read_mesh"]

Neighbour = Callable[[str], bytes]


def _alone(read: Callable[[bytes, Bounds], Surface]) -> Callable[[bytes, Bounds, Neighbour], Surface]:
    """A reader of files that name no others."""
    return lambda data, bounds, neighbour: read(data, bounds)


READERS: dict[str, Callable[[bytes, Bounds, Neighbour], Surface]] = {
    ".obj": _alone(read_obj),
    ".stl": _alone(read_stl),
    ".dae": _alone(read_dae),
    ".glb": read_gltf,
    ".gltf": read_gltf,
    ".ply": _alone(read_ply),
    ".msh": _alone(read_msh),
}
"""Readers of mesh files by the ending of their names, in small letters."""
FORMATS = tuple(READERS)


def no_neighbour(name: str) -> bytes:
    """For who reads a file without those beside it."""
    raise UnusableMeshError("names another file, which is not read here")


def read_mesh(data: bytes, kind: str, bounds: Bounds, neighbour: Neighbour = no_neighbour) -> Surface:
    """The surface that a mesh file describes.

    Parameters
    ----------
    data : bytes
        Content of the file.
    kind : str
        Its ending, such as ``.obj``, in small letters.
    bounds : Bounds
        What it may hold.
    neighbour : callable, optional
        Gives the bytes of a file that this one names.

    Raises
    ------
    UnusableMeshError
        When it cannot be read, and why. The message follows the file's name.
    AssetError
        When it is over the bounds or dangerous.
    """
    if kind not in READERS:
        raise UnusableMeshError(f"is of a kind that is not read ({', '.join(READERS)})")
    with np.errstate(all="ignore"):  # numbers out of range are found, counted and said at the end
        return READERS[kind](data, bounds, neighbour)
