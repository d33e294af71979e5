"""Triangles to cast rays at: Embree's, or Warp's where Embree has no wheel, which is Linux on ARM."""

import os
from functools import cache
from importlib.util import find_spec
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

RAY_LIBRARY = "embreex" if find_spec("embreex") else "warp-lang"
"""Distribution that casts the rays of this machine."""


class RayScene(Protocol):
    """One static acceleration structure.

    It says which face a ray meets. How far that is, libraries work out in another last bit on each kind of processor.
    """

    def run(self, origins: NDArray[np.float32], directions: NDArray[np.float32]) -> NDArray[Any]:
        """(N,) int32 first face that rays (N, 3), (N, 3) meet; -1 for none."""


def ray_scene(vertices: NDArray[np.floating[Any]], faces: NDArray[np.integer[Any]]) -> RayScene:
    """The scene of a mesh of vertices (V, 3) and faces (F, 3).

    Raises
    ------
    RenderError
        When neither library is installed.
    """
    return embree_scene(vertices, faces) if RAY_LIBRARY == "embreex" else WarpScene(vertices, faces)


def embree_scene(vertices: NDArray[np.floating[Any]], faces: NDArray[np.integer[Any]]) -> RayScene:
    """A scene of Embree.

    Its `robust` mode costs a third more and changes no pixel in ten million on real objects.
    """
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene: RayScene = EmbreeScene(embree_device(os.getpid()))
    TriangleMesh(scene, vertices.astype(np.float32), faces)
    return scene


@cache
def embree_device(process: int) -> Any:
    """The device of all scenes of a process: Embree crashes at about the thousandth, and some survive no fork."""
    from embreex.rtcore import EmbreeDevice

    return EmbreeDevice()


class WarpScene:
    """A scene of NVIDIA Warp on the CPU."""

    def __init__(self, vertices: NDArray[np.floating[Any]], faces: NDArray[np.integer[Any]]):
        from artsim.renderers.warp import import_warp

        self._wp = import_warp()
        self._mesh = self._wp.Mesh(
            self._wp.array(vertices.astype(np.float32), dtype=self._wp.vec3, device="cpu"),
            self._wp.array(faces.astype(np.int32).ravel(), dtype=self._wp.int32, device="cpu"),
            bvh_constructor="sah",  # slower to build than others, faster to look through
        )

    def run(self, origins: NDArray[np.float32], directions: NDArray[np.float32]) -> NDArray[Any]:
        """See :meth:`RayScene.run`."""
        from artsim.renderers.warp_ray_kernels import first_hits

        wp, face = self._wp, np.empty(len(directions), np.int32)
        rays = [np.ascontiguousarray(each, dtype=np.float32) for each in (origins, directions)]
        given = [wp.array(each, dtype=wp.vec3, device="cpu", copy=False) for each in rays]
        found = wp.array(face, dtype=wp.int32, device="cpu", copy=False)
        wp.launch(first_hits, dim=len(directions), inputs=[self._mesh.id, *given], outputs=[found], device="cpu")
        return face
