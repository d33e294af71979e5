"""What a part weighs, and how it resists being turned."""

import numpy as np

from artsim.errors import AssetError
from artsim.model.inertia import Inertia
from artsim.model.objects import ArticulatedObject


def part_inertia(obj: ArticulatedObject, k: int) -> Inertia:
    """Mass, centre of mass and inertia tensor of part k, at rest, at the object's scale.

    They are those that its source file says. Without, they are those of its body's solid, else of the solid that the
    part's surface encloses (integrals over a polyhedron in closed form), filled with its body's density.

    Raises
    ------
    AssetError
        When nothing says what the part is made of, or its surface encloses no solid.
    """
    import trimesh

    part = obj.parts[k]
    where = f"{obj.category} {obj.object_id}: part {part.name!r}"
    if part.body is None:
        raise AssetError("has no body, so no density", where, "pass a loaded object through artsim.export.prepare")
    if part.body.inertia is not None:
        return part.body.inertia.scaled(obj.scale)
    vertices, faces = part.body.solid or (part.vertices, part.faces)
    triangles = (vertices * obj.scale)[faces]
    with np.errstate(divide="ignore", invalid="ignore"):  # without a volume, which is looked at below
        found = trimesh.triangles.mass_properties(triangles, density=part.body.density, skip_inertia=False)
    inertia = Inertia(float(found.mass), np.asarray(found.center_mass), np.asarray(found.inertia))
    moments = np.linalg.eigvalsh(inertia.tensor) if np.isfinite(inertia.tensor).all() else np.zeros(3)
    # Moments of any real body are positive, and none is larger than the sum of the other two.
    if not (inertia.mass > 0 and moments[0] > 0 and moments[2] <= moments[:2].sum() * (1 + 1e-9)):
        raise AssetError(
            f"its surface encloses no solid (mass {inertia.mass:.3g} kg)", where, "build it as a union of closed solids"
        )
    return inertia
