"""``artsim.load``: a file of joints and shapes, or its folder, becomes an :class:`ArticulatedObject`.

Separate steps: the document is checked and parsed (``documents``), links are merged into rigid bodies (``bodies``),
their meshes are read (``meshes``), and here joints are rewritten in the rest frame, and the rest state is chosen.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artsim.common.products import apply, matmul, norm, unit
from artsim.errors import AssetError
from artsim.families import make
from artsim.loading.bodies import (
    RigidBody,
    axis_in_base,
    in_order,
    join_screws,
    merge_fixed_links,
    without_empty_leaves,
)
from artsim.loading.described_bodies import with_described_bodies
from artsim.loading.details import named_faces, with_details
from artsim.loading.documents import read_document
from artsim.loading.family_source import FamilySource
from artsim.loading.mesh_files.surface import is_thin
from artsim.loading.meshes import LoadLimits, MeshReader, UnusableMeshError, check_range, merge_shapes
from artsim.loading.object_files import category_of_folder, find_urdf, is_params, max_bytes, object_id, read_urdf
from artsim.loading.packages import MissingFileError
from artsim.loading.partnet import read_side_files
from artsim.loading.rest_frame import rest_rotation
from artsim.loading.rest_state import canonical_category, rest_state
from artsim.loading.urdf_document import Shape, UrdfJoint, UrdfLink, UrdfRobot
from artsim.model.joints import Joint, Mimic
from artsim.model.kinematics import Array, KinematicTree
from artsim.model.object_file import load_object
from artsim.model.objects import ArticulatedObject, Part, Repair, content_sha256
from artsim.model.params import Params
from artsim.model.transforms import compose_transform, transform_points

_FAR = 20.0
"""Times the object's size that no slide goes: a cart on its track goes once, a drawer less."""


def load(
    path: str | Path,
    category: str | None = None,
    package_roots: Mapping[str, str | Path] | None = None,
    limits: LoadLimits | None = None,
    body: str | None = None,
) -> ArticulatedObject:
    """Load an articulated object.

    Parameters
    ----------
    path : str or Path
        A URDF, MJCF or USD file, a JSON file of joints (of PartNet-Mobility or Shape2Motion), the glTF file beside one,
        a folder that holds one of these, an ``.npz`` object file out of a generated dataset, or a procedural object: a
        JSON file of its parameters, or its name, such as ``laptop:3``.
    category : str, optional
        Category whose rest state and rest frame are wanted; by default what the side files say, else "unknown", for
        which both are as the file has them.
    package_roots : mapping, optional
        Folders of ``package://`` names. Meshes and included files outside these and the asset's own folder are refused.
    limits : LoadLimits, optional
        Bounds on the size of the files.
    body : str, optional
        Which object of an MJCF or USD scene: a body, with all that it carries, or ``world``. The error about a scene of
        several objects names them.

    Returns
    -------
    ArticulatedObject
        In its rest frame; ``repairs`` lists what was mended. Parts of MJCF and USD files have the bodies (collision
        geometry, mass and inertia) that these describe.

    Raises
    ------
    AssetError
        Naming file, element and mend.
    ConfigError
        When MuJoCo (MJCF) or usd-core (USD) is not installed.
    """
    limits = limits or LoadLimits()
    if not Path(path).exists() and (made := FamilySource.named(str(path))) is not None:
        return made.load()
    file = find_urdf(Path(path))
    if file.suffix == ".npz":
        return load_object(file)
    data = read_urdf(file, max_bytes(file, limits))
    if is_params(file, data):
        return make(Params.from_json(data.decode("utf-8", "replace"), str(file)))
    side = read_side_files(file)
    roots = _roots(package_roots or {})
    reader = MeshReader(file.parent, roots, limits)
    robot, repairs, contents = read_document(data, file, reader, side.helpers, body)

    repairs += side.repairs
    category = canonical_category(category or side.category or category_of_folder(file) or "unknown")
    bodies = merge_fixed_links(robot, file, repairs)
    _read_geometry(bodies, robot, reader, file, repairs)
    repairs += reader.paths.repairs
    helpers = (*side.helpers, *robot.helpers)
    bodies = join_screws(
        without_empty_leaves(bodies, repairs, robot.noun), helpers, repairs, guessed=not robot.explicit
    )
    bodies, exported = in_order(bodies, side.parts, repairs)
    tree, source_joints = _tree(bodies, file)
    parts = [body.part({**robot.labels, **side.labels}) for body in bodies]
    if side.num_movable is not None and len(tree) - 1 != side.num_movable:
        repairs.append(
            Repair("file", f"moves {len(tree) - 1} parts where its annotation lists {side.num_movable}: taken as it is")
        )
    # No rule holds for a category that nothing is known of: the zero of a file of our own needs no aligning.
    known = "unknown" if exported else category
    rest, reasons = rest_state(tree, parts, known)
    repairs += reasons
    T_base_part = tree.forward_kinematics(rest)
    tree, parts, T_base_rest, reasons = _to_rest_frame(tree, parts, rest, known)
    T_rest_part = matmul(np.linalg.inv(T_base_rest), T_base_part)
    parts = with_details(parts, bodies, robot.links, reader, T_rest_part)
    parts = with_described_bodies(parts, bodies, robot, reader, T_rest_part, file)
    repairs += reasons
    repairs += _far_slides(tree, parts, robot.explicit)
    return ArticulatedObject(
        object_id=object_id(file, side.object_id) + ("" if body is None else f"_{body}"),
        category=category,
        parts=tuple(parts),
        native_tree=tree,
        sha256=content_sha256([data, *contents, *side.contents, *reader.contents, *([body.encode()] if body else [])]),
        T_base_rest=T_base_rest,
        repairs=tuple(repairs),
        source=str(file),
        source_joints=source_joints,
    )


def _far_slides(tree: KinematicTree, parts: list[Part], explicit: bool) -> list[Repair]:
    """Slides that go so far that their limits look like millimetres."""
    bounds = np.stack([part.bounds for part in parts if len(part.faces)])
    size = float(norm(bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)))
    return [
        Repair(
            f"joint {joint.name!r}",
            f"goes from {joint.lower:g} to {joint.upper:g} m in an object of {size:.3g} m: its limits look like "
            "millimetres, and are taken as metres; if they are, "
            + (
                "divide both by 1000"
                if explicit
                else f'write lower="{joint.lower / 1000:.6g}" upper="{joint.upper / 1000:.6g}"'
            ),
        )
        for joint in tree.joints
        if joint.type == "prismatic" and joint.upper - joint.lower > _FAR * size
    ]


def _roots(declared: Mapping[str, str | Path]) -> dict[str, Path]:
    roots = {name: Path(folder).expanduser().absolute() for name, folder in declared.items()}
    for name, folder in roots.items():
        if not folder.is_dir():
            raise AssetError("no such folder", f"package root {name}={folder}", "name the folder of the package")
    return roots


def _read_geometry(
    bodies: list[RigidBody], robot: UrdfRobot, reader: MeshReader, file: Path, repairs: list[Repair]
) -> None:
    """Fill in every body's surface from the shapes of its links."""
    links = {link.name: link for link in robot.links}
    for body in bodies:
        surfaces, names = [], []
        unusable = []
        for name in body.links:
            found, problems = _surfaces(links[name], body.T_base_link[name], reader, file, robot.noun)
            surfaces += [surface for _, surface in found]
            names += [shape.name for shape, _ in found]
            unusable += [f"{robot.noun} {name!r}: {problem}" for problem in problems]
            repairs += [Repair(f"{robot.noun} {name!r}", f"{problem}: left out") for problem in problems]
        if unusable and not surfaces:
            raise AssetError(
                f"a part has no extent: {unusable[0]}", file, "give it a size above 0, or remove the empty shape"
            )
        body.vertices, body.faces = merge_shapes(surfaces)
        body.details = named_faces(names, [len(faces) for _, faces, _ in surfaces])
        check_range(body.vertices, f"{file}: {robot.noun} {body.links[0]!r}")
    repairs += reader.notes
    if not any(len(body.faces) for body in bodies):
        raise AssetError(f"no {robot.noun} has any geometry", file, f"give a {robot.noun} a visible shape")


def _surfaces(
    link: UrdfLink, T_base_link: Array, reader: MeshReader, file: Path, noun: str
) -> tuple[list[tuple[Shape, tuple[Array, NDArray[np.int32], Array]]], list[str]]:
    """Each shape of a link, its vertices, triangles and transform into the base frame, and why others are left out.

    Raises
    ------
    AssetError
        When the link has a mesh, or a geometry of a kind that is not read, and nothing of it is left.
    """
    surfaces = []
    problems: list[str] = [*link.unusable]
    fix = None
    for shape in link.shapes:
        try:
            vertices, faces = reader.shape(shape.geometry)
            check_range(vertices, f"{file}: {noun} {link.name!r}")
            if is_thin(vertices, faces):
                raise UnusableMeshError(f"{shape.geometry} has no extent: all of it lies on a line or in a point")
        except UnusableMeshError as problem:
            problems.append(str(problem))
            if isinstance(problem.__cause__, MissingFileError):
                fix = fix or problem.__cause__.fix
            continue
        surfaces.append((shape, (vertices, faces, matmul(T_base_link, shape.origin))))
    if problems and not surfaces:
        count = len(problems)
        raise AssetError(
            f"none of the {count} meshes of {noun} {link.name!r} can be used: {problems[0]}",
            file,
            fix or "restore the mesh files; an object with an invisible part would give wrong data",
        )
    return surfaces, [*problems, *link.empty]


def _tree(bodies: list[RigidBody], file: Path) -> tuple[KinematicTree, dict[str, tuple[int, float]]]:
    """Tree in the base link's frame with rest state 0, and where each of the file's joints went."""
    index = {body.joint.name: k for k, body in enumerate(bodies) if body.joint is not None}
    position = {id(body): k for k, body in enumerate(bodies)}
    joints = [Joint("root", "free", -1)]
    source_joints: dict[str, tuple[int, float]] = {}
    for k, body in enumerate(bodies[1:], start=1):
        joint = body.joint
        assert joint is not None
        assert body.parent is not None
        lower, upper = -np.inf, np.inf
        kind = joint.type
        if kind in ("revolute", "prismatic"):
            lower, upper = joint.lower, joint.upper
        if body.slide is not None:
            kind = "screw"
            lower, upper = sorted(v / body.slide_rate + 0.0 for v in (body.slide.lower, body.slide.upper))
            source_joints[body.slide.name] = (k, body.slide_rate)
        source_joints[joint.name] = (k, 1.0)
        joints.append(
            Joint(
                name=joint.name,
                type=kind,
                parent=position[id(body.parent)],
                axis=_triple(axis_in_base(body)),
                origin=_triple(body.T_base_joint[:3, 3]),
                lower=lower,
                upper=upper,
                pitch=body.pitch,
                mimic=_mimic(joint, index, file),
            )
        )
    return KinematicTree(joints), source_joints


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def _mimic(joint: UrdfJoint, index: Mapping[str, int], file: Path) -> Mimic | None:
    if joint.mimic is None:
        return None
    source = index.get(joint.mimic.joint)
    if source is None:
        raise AssetError(
            f"mimics joint {joint.mimic.joint!r}, which does not exist or does not move",
            f"{file}: joint {joint.name!r}",
            "name a moving joint of the file",
        )
    return Mimic(source, joint.mimic.multiplier, joint.mimic.offset)


def _to_rest_frame(
    tree: KinematicTree, parts: list[Part], rest: Array, category: str
) -> tuple[KinematicTree, list[Part], Array, list[Repair]]:
    """Pose everything at the rest state, turn it as its category lies, and move the origin to the centre of its box.

    Returns the tree, the parts, ``T_base_rest`` and the reason for a turn.
    """
    rest = tree.complete_state(rest)
    T_base_part = tree.forward_kinematics(rest)
    axes, origins = tree.posed_joints(T_base_part)
    posed = [replace(p, vertices=transform_points(T, p.vertices)) for p, T in zip(parts, T_base_part, strict=True)]
    joints = [
        replace(joint, axis=_triple(a), origin=_triple(o), rest=float(r))
        for joint, a, o, r in zip(tree.joints, unit(axes), origins, rest, strict=True)
    ]
    turn, reasons = rest_rotation(KinematicTree(joints), posed, rest, category)
    if turn is not None:
        posed = [replace(p, vertices=apply(turn, p.vertices)) for p in posed]
        joints = [
            replace(joint, axis=_triple(apply(turn, joint.axis)), origin=_triple(apply(turn, joint.origin)))
            for joint in joints
        ]
    bounds = np.stack([p.bounds for p in posed if len(p.faces)])
    center = 0.5 * (bounds[:, 0].min(axis=0) + bounds[:, 1].max(axis=0))
    joints = [replace(joint, origin=_triple(np.asarray(joint.origin) - center)) for joint in joints]
    joints[0] = replace(joints[0], origin=(0.0, 0.0, 0.0))
    T_base_rest = compose_transform(center) if turn is None else compose_transform(apply(turn.T, center), turn.T)
    return KinematicTree(joints), [replace(p, vertices=p.vertices - center) for p in posed], T_base_rest, reasons
