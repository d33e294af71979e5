"""Bodies of loaded objects, where the file says what physics needs: convex collision geometry, and masses."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from lxml import etree

from artsim.common.products import matmul
from artsim.loading.bodies import RigidBody, merge_fixed_links
from artsim.loading.meshes import LoadLimits, MeshReader
from artsim.loading.object_files import find_urdf, read_urdf
from artsim.loading.partnet import read_side_files
from artsim.loading.urdf_xml import parse_robot, safe_xml
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject, Body, Mesh, Part, Repair
from artsim.model.transforms import transform_points


def read_bodies(
    obj: ArticulatedObject, path: str | Path, package_roots: Mapping[str, Path] | None = None
) -> ArticulatedObject:
    """The object with the bodies that its file gives its parts.

    The density is the mass that the file says over the volume of the part's surface.

    Parameters
    ----------
    obj : ArticulatedObject
        Loaded from ``path``, at rest at the file's zero.
    path : path
        A URDF file or its folder that passes the gates of its collision geometry and inertia
        (:mod:`artsim.checks.strict_urdf`).
    package_roots : mapping, optional
        As for :func:`artsim.load`, which says what is raised, too.
    """
    import trimesh

    file, limits = find_urdf(Path(path)), LoadLimits()
    root = safe_xml(read_urdf(file, limits.max_urdf_bytes), file)
    masses = {link.get("name"): float(link.find("inertial/mass").get("value")) for link in root.iter("link")
              if link.find("inertial/mass") is not None}  # fmt: skip
    for link in root.findall("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    side = read_side_files(file)
    repairs: list[Repair] = []
    robot, _ = parse_robot(etree.tostring(root), file, limits.max_links, side.helpers)
    bodies = merge_fixed_links(robot, file, repairs)
    names = {part.name for part in obj.parts}
    shapes = {link.name: link.shapes for link in robot.links}
    reader = MeshReader(file.parent, dict(package_roots or {}), limits)
    T_rest_base = np.linalg.inv(obj.T_base_rest)

    def pieces(body: RigidBody) -> list[Mesh]:
        found = []
        for link in body.links:
            for shape in shapes[link]:
                vertices, faces = reader.shape(shape.geometry)
                T: Array = matmul(T_rest_base, matmul(body.T_base_link[link], shape.origin))
                found.append((transform_points(T, vertices), faces))
        return found

    def with_body(part: Part) -> Part:
        body = next(body for body in bodies if part.name in body.links)
        volume = float(trimesh.Trimesh(part.vertices, part.faces, process=False).volume)
        links = list(body.links)
        if body.parent is not None and not names & set(
            body.parent.links
        ):  # a screw's helper, which is one part with it
            links += body.parent.links
        mass = sum(masses[link] for link in links if link in masses)
        return replace(part, body=Body(tuple(pieces(body)), mass / volume))

    return replace(obj, parts=tuple(with_body(part) for part in obj.parts))
