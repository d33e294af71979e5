"""Objects of other formats as links and joints of a URDF document, from where everything is at the zero of all joints.

MJCF and USD write frames, axes and anchors in many ways. Their readers leave it to the format's own library to work out
where bodies and joints stand in the world when every joint is 0. From that alone the links and joints are written: each
link's frame has the axes of the world, and its origin at the anchor of its joint.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from artsim.common.products import matmul
from artsim.errors import AssetError
from artsim.loading.joint_xml import settle_limits
from artsim.loading.scene_objects import WorldLink, chosen
from artsim.loading.urdf_document import UrdfJoint, UrdfLink, UrdfRobot
from artsim.loading.xml_values import Element
from artsim.model.inertia import Inertia, combine_inertias
from artsim.model.joints import LARGEST
from artsim.model.kinematics import Array
from artsim.model.objects import Repair
from artsim.model.transforms import compose_transform


def as_document(links: Sequence[WorldLink], file: Path, repairs: list[Repair], body: str | None = None) -> UrdfRobot:
    """Links and joints of an object.

    ``links`` and ``body`` are those of :func:`artsim.loading.scene_objects.chosen`. A world that shows nothing and
    holds or frees one link is left out: that link is the object's root.

    Raises
    ------
    AssetError
        When it holds several objects of which none is chosen, two links or two joints have the same name, or a number
        is not finite.
    """
    links = chosen(links, file, repairs, body)
    root = _root(links)
    if root > 0:
        links = [replace(links[root], parent=-1, joint=None), *_without(links, root)]
    _check_names([link.name for link in links], "bodies", file)
    _check_names([link.joint.name for link in links if link.joint is not None], "joints", file)
    origins = [np.zeros(3) if link.joint is None else link.joint.anchor for link in links]
    found, joints = [], []
    for k, link in enumerate(links):
        T_link_world = compose_transform(-origins[k])
        inertia = None if link.inertia is None else link.inertia.transformed(T_link_world)
        shapes, collision = (
            tuple(replace(shape, origin=matmul(T_link_world, shape.origin)) for shape in some)
            for some in (link.shapes, link.collision)
        )
        _check_finite(link, [origins[k], *(shape.origin for shape in (*shapes, *collision))], file)
        found.append(UrdfLink(link.name, shapes, collision=collision, inertia=inertia))
        if link.joint is not None:
            joints.append(_joint(link, links[link.parent].name, origins[k] - origins[link.parent], file, repairs))
    return UrdfRobot(tuple(found), tuple(joints), explicit=True, noun="body")


def _root(links: Sequence[WorldLink]) -> int:
    """The link that is the object's root: 0 for the world itself."""
    carried = [k for k, link in enumerate(links) if link.parent == 0]
    if len(carried) != 1 or links[0].shapes or links[0].collision:
        return 0
    joint = links[carried[0]].joint
    return carried[0] if joint is not None and joint.type in ("fixed", "floating") else 0


def _without(links: Sequence[WorldLink], root: int) -> list[WorldLink]:
    """The links that hang on the new root, which comes first: without the world and itself."""
    index = {root: 0}
    rest = [k for k in range(1, len(links)) if k != root]
    index |= {k: i for i, k in enumerate(rest, start=1)}
    return [replace(links[k], parent=index[links[k].parent]) for k in rest]


def _joint(link: WorldLink, parent: str, offset: Array, file: Path, repairs: list[Repair]) -> UrdfJoint:
    joint = link.joint
    assert joint is not None
    kind, lower, upper = joint.type, joint.lower, joint.upper
    if kind in ("revolute", "continuous", "prismatic"):
        element = Element(f"joint {joint.name!r}", file, repairs)
        if not (np.isfinite(joint.axis).all() and abs(np.linalg.norm(joint.axis) - 1.0) < 1e-6):
            raise element.error("has no axis", "give its axis a length")
        kind, lower, upper = settle_limits(kind, lower, upper, element)
    return UrdfJoint(
        joint.name,
        kind,
        parent,
        link.name,
        compose_transform(offset),
        joint.axis,
        lower,
        upper,
        joint.mimic,
        joint.dynamics,
    )


def _check_names(names: Sequence[str], plural: str, file: Path) -> None:
    seen: set[str] = set()
    for name in names:
        if name in seen:
            raise AssetError(f"two {plural} are called {name!r}", file, "give each its own name")
        seen.add(name)


def _check_finite(link: WorldLink, arrays: Sequence[Array], file: Path) -> None:
    inertia = link.inertia
    more = [] if inertia is None else [np.array(inertia.mass), inertia.center, inertia.tensor / LARGEST]
    if not all((np.abs(array) <= LARGEST).all() for array in (*arrays, *more)):
        raise AssetError(
            f"a position, size or mass is not finite, or over {LARGEST:g}",
            f"{file}: body {link.name!r}",
            "write metres and kilograms",
        )


def combined(inertias: Sequence[Inertia]) -> Inertia | None:
    """Several bodies as one; None where none has a mass."""
    solid = [inertia for inertia in inertias if inertia.mass > 0]
    return combine_inertias(solid) if solid else None
