"""USD with UsdPhysics: rigid bodies, joints and colliders of a stage become links and joints.

========================================  =============================================================================
The stage                                 is read as
========================================  =============================================================================
metersPerUnit, kilogramsPerUnit, upAxis   metres, kilograms, Z up
a prim with RigidBodyAPI                  a link; what hangs on none of them is part of the world
static shapes below and wider             the ground that the object stands on, and no part of it
revolute, prismatic, fixed joints         the same; without limits: continuous, and 1 m either way
a generic joint                           the axes that its limits leave free, one after another, or fixed
spherical joint                           two swings within its cone, then the turn about its axis
several joints of the same two bodies     a chain of links without mass; the body is its last
shapes of purpose default and render      shown; purpose guide and proxy, and what is invisible, is not
shapes with CollisionAPI                  collision geometry; with ``convexHull``, their hull
mass, density, centre, inertia            as they are written; the rest from the collision geometry
what :mod:`~artsim.loading.usd_mimics`    mimic
names
distance joints, loops                    an error
========================================  =============================================================================

The zero of a joint is where its two frames meet, wherever the bodies stand in the stage.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from artsim.common.extras import require_extra
from artsim.errors import AssetError
from artsim.loading import primitives
from artsim.loading.meshes import LoadLimits
from artsim.loading.reader_process import Reader, read_apart
from artsim.loading.scene_objects import WorldLink
from artsim.loading.urdf_document import InlineMesh, MimicRelation, Shape, UrdfJoint, UrdfLink, UrdfRobot
from artsim.loading.usd_bodies import StageReader
from artsim.loading.usd_joints import read_joints
from artsim.loading.usd_layers import open_stage, unreadable
from artsim.loading.usd_tree import read_links
from artsim.loading.zero_pose import as_document
from artsim.model.inertia import Inertia
from artsim.model.kinematics import Array
from artsim.model.objects import JointDynamics, Repair
from artsim.model.transforms import compose_transform


def read_usd(file: Path, limits: LoadLimits, body: str | None = None) -> tuple[UrdfRobot, list[Repair], list[bytes]]:
    """Links and joints of a USD file, as :func:`artsim.loading.documents.read_document` gives them."""
    with require_extra("USD files"):
        import pxr  # noqa: F401
    found: tuple[UrdfRobot, list[Repair], list[bytes]] = read_apart(READER, file, limits, body)
    return found


def _read(
    file: Path, limits: LoadLimits, body: str | None, holds: Callable[[int], None]
) -> tuple[UrdfRobot, list[Repair], list[bytes]]:
    from pxr import Tf

    try:
        stage, contents = open_stage(file, limits, holds)
        repairs = [Repair("file", f"is composed without what USD refuses: {e}") for e in stage.GetCompositionErrors()]
        reader = StageReader(stage, file, limits, repairs)
        links = read_links(reader, read_joints(reader))
    except (Tf.ErrorException, UnicodeDecodeError) as error:  # values are read when they are asked for
        raise unreadable(file, error) from error
    _show_something(links, file, repairs)
    return as_document(links, file, repairs, body), repairs, contents


def _prepare() -> None:
    """Let usd-core load its plugins, which it does for its first stage."""
    from pxr import Usd, UsdGeom, UsdPhysics

    stage = Usd.Stage.CreateInMemory()
    UsdGeom.Cube(UsdPhysics.Scene.Define(stage, "/scene").GetPrim()).GetSizeAttr().Get()


READER = Reader(
    f"{__name__}:READER", _read, _prepare, "usd-core",
    (UrdfRobot, UrdfLink, UrdfJoint, Shape, InlineMesh, MimicRelation, JointDynamics, Inertia, Repair),
)  # fmt: skip


def _show_something(links: list[WorldLink], file: Path, repairs: list[Repair]) -> None:
    """Where nothing is to be seen, show what collides; without any, boxes of the bodies' inertia, as MuJoCo does."""
    if any(link.shapes for link in links):
        return
    if any(link.collision for link in links):
        repairs.append(Repair("file", "has nothing to be seen: its collision geometry is shown"))
        for link in links:
            link.shapes = list(link.collision)
        return
    for link in links:
        if link.inertia is not None and link.inertia.mass > 0:
            T_world_box, size = _box_of(link.inertia)
            if size.min() > 0:
                link.shapes = [Shape(InlineMesh(link.name, *primitives.box(size)), T_world_box)]
    if not any(link.shapes for link in links):
        raise AssetError(
            "no prim of the object is a surface, and no body has a mass and an inertia",
            file,
            "give a prim with PhysicsRigidBodyAPI a visible Mesh, Cube, Sphere, Cylinder, Capsule or Cone",
        )
    repairs.append(Repair("file", "has no shapes: boxes of the same mass and inertia as its bodies are shown"))


def _box_of(inertia: Inertia) -> tuple[Array, Array]:
    """Pose (4, 4) and sides (3,) of the box, full and of one density, that has a mass and an inertia; 0: none has."""
    moments, axes = inertia.principal()
    squares = 6.0 / inertia.mass * (moments.sum() - 2.0 * moments)
    return compose_transform(inertia.center, axes), np.sqrt(squares.clip(0.0))
