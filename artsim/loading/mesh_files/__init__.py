"""Mesh files of many formats, read by one function.

Files are untrusted. Readers count what a file declares before they expand it, open no other file but a glTF file's own
buffers, and say whatever does not arrive.
"""

from __future__ import annotations

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

FORMATS = (".obj", ".stl", ".dae", ".glb", ".gltf", ".ply", ".msh")
"""What mesh files may be called."""


def no_neighbour(name: str) -> bytes:
    """For who reads a file without those beside it."""
    raise UnusableMeshError("names another file, which is not read here")


def read_mesh(data: bytes, kind: str, bounds: Bounds, neighbour: Callable[[str], bytes] = no_neighbour) -> Surface:
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
    if kind not in FORMATS:
        raise UnusableMeshError(f"is of a kind that is not read ({', '.join(FORMATS)})")
    with np.errstate(all="ignore"):  # numbers out of range are found, counted and said at the end
        if kind == ".obj":
            return read_obj(data, bounds)
        if kind == ".stl":
            return read_stl(data, bounds)
        if kind == ".dae":
            return read_dae(data, bounds)
        if kind == ".ply":
            return read_ply(data, bounds)
        if kind == ".msh":
            return read_msh(data, bounds)
        return read_gltf(data, bounds, neighbour)
