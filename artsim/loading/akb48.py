"""AKB-48 (Liu et al., A Real-World Articulated Object Knowledge Base, CVPR 2022): ``motion_unity.urdf``.

The URDF file is for Unity's importer of URDF files: frames, origins and axes are URDF's, but meshes have the axes that
Unity's exporter gives them. The coordinates (x, y, z) of a mesh are (y, z, x) of its link.
"""

from dataclasses import replace

import numpy as np

from artsim.common.products import matmul
from artsim.loading.urdf_document import MeshFile, Shape, UrdfRobot
from artsim.model.objects import Repair

T_LINK_MESH = np.array([[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""Maps the axes of a mesh to those of the frame that its ``<origin>`` places."""


def with_meshes_of_unity(robot: UrdfRobot, repairs: list[Repair]) -> UrdfRobot:
    """The document with its meshes turned from Unity's axes to URDF's.

    Parameters
    ----------
    robot : UrdfRobot
    repairs : list of Repair
        Added to.
    """

    def turned(shape: Shape) -> Shape:
        is_file = isinstance(shape.geometry, MeshFile)
        return replace(shape, origin=matmul(shape.origin, T_LINK_MESH)) if is_file else shape

    links = [replace(link, shapes=tuple(map(turned, link.shapes))) for link in robot.links]
    repairs.append(Repair("meshes", "turned from Unity's axes to URDF's, as in AKB-48", note=True))
    return replace(robot, links=tuple(links))
