"""Physics of USD prims: mass, centre and inertia of a body, and what drives and opposes a joint.

What a body's MassAPI leaves unsaid follows from its collision geometry.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from artsim.common.products import apply, matmul
from artsim.loading.usd_values import number, rotation, vectors
from artsim.loading.zero_pose import combined
from artsim.model.convex_bodies import convex_hull
from artsim.model.inertia import Inertia
from artsim.model.kinematics import Array
from artsim.model.objects import JointDynamics, Mesh

_WATER = 1000.0
"""kg/m^3: UsdPhysics has this density where nothing else is said."""
_THIN = 1e-4


def read_inertia(
    prim: Any, T_body_prim: Array, solid: Sequence[Mesh], meters: float, kilograms: float
) -> Inertia | None:
    """Inertia of a body in its own rigid frame; None where nothing says anything of it.

    Parameters
    ----------
    prim : Usd.Prim
    T_body_prim : (4, 4) float
        Carries the prim's own coordinates, scale included, to the body's frame.
    solid : sequence of Mesh
        Its collision geometry, in the body's frame.
    meters, kilograms : float
        Of one unit of the stage.
    """
    from pxr import UsdPhysics

    api = UsdPhysics.MassAPI(prim)
    mass, density = (_positive(attribute) for attribute in (api.GetMassAttr(), api.GetDensityAttr()))
    mass *= kilograms
    density *= kilograms / meters**3
    found = _of_shapes(solid, density or _WATER)
    if found is None and mass == 0.0:
        return None
    if found is None:  # a point, unless more is said
        found = Inertia(mass, np.zeros(3), np.zeros((3, 3)))
    if mass > 0.0 and found.mass > 0.0:
        found = found.share(mass / found.mass)
    center, tensor = found.center, found.tensor
    given = vectors(api.GetCenterOfMassAttr())
    if len(given) and np.isfinite(given).all():
        center = apply(T_body_prim[:3, :3], given[0]) + T_body_prim[:3, 3]
    moments = vectors(api.GetDiagonalInertiaAttr()).ravel()
    if (moments > 0).any() and np.isfinite(moments).all():
        axes = rotation(api.GetPrincipalAxesAttr())
        tensor = matmul(matmul(axes, np.diag(moments * kilograms * meters**2)), axes.T)
    return Inertia(found.mass, center, tensor)


def read_dynamics(prim: Any, axis: str, meters: float, kilograms: float) -> JointDynamics:
    """What a joint's drive and PhysX's attributes say of one of its axes; parameters as of :func:`read_inertia`.

    The axis is called linear or angular, or in a generic joint ``transX`` and so on. A drive without stiffness damps,
    and so does one that is a spring, as artsim writes them; with other stiffness, its damping belongs to a controller.
    """
    from pxr import UsdPhysics

    slides = axis.startswith(("linear", "trans"))
    speed = meters if slides else np.pi / 180.0
    force = kilograms * meters * (1.0 if slides else meters)
    spring, hold, over = (_finite(prim.GetAttribute(f"artsim:{name}"), 1.0) for name in ("spring", "hold", "holdOver"))
    effort = damping = None
    drive = UsdPhysics.DriveAPI.Get(prim, axis)
    if drive and prim.HasAPI(UsdPhysics.DriveAPI, axis):
        effort = _finite(drive.GetMaxForceAttr(), force)
        if spring or not number(drive.GetStiffnessAttr(), 0.0):
            damping = _finite(drive.GetDampingAttr(), force / speed)
    friction = _finite(prim.GetAttribute(f"physxJointAxis:{axis}:staticFrictionEffort"), force)
    velocity = _finite(prim.GetAttribute("physxJoint:maxJointVelocity"), speed)
    return JointDynamics(effort, velocity, damping, friction, spring=spring, hold=hold, hold_over=over)


def _finite(attribute: Any, unit: float) -> float | None:
    value = number(attribute, -1.0)
    return value * unit if np.isfinite(value) and value >= 0 else None


def _positive(attribute: Any) -> float:
    value = number(attribute, 0.0)
    return value if np.isfinite(value) and value > 0 else 0.0


def _of_shapes(solid: Sequence[Mesh], density: float) -> Inertia | None:
    import trimesh

    inertias = []
    for vertices, faces in solid:
        mesh = trimesh.Trimesh(vertices, faces, process=False)
        with np.errstate(divide="ignore", invalid="ignore"):  # without a volume, which is what is asked
            closed = mesh.is_volume and mesh.volume > 0
        if not closed:
            mesh = trimesh.Trimesh(*convex_hull(vertices, _THIN), process=False)
        mesh.density = density
        inertias.append(Inertia(float(mesh.mass), np.asarray(mesh.center_mass), np.asarray(mesh.moment_inertia)))
    return combined(inertias)
