"""``artsim.load``: a URDF, MJCF or USD file or a PartNet-Mobility folder becomes an :class:`ArticulatedObject`.

Separate steps: the document is checked and parsed (``urdf_xml``, ``mjcf``, ``usd``), links are merged into rigid bodies
(``bodies``), their meshes are read (``meshes``), and here joints are rewritten in the rest frame, and the rest state is
chosen.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from artsim.common.files import read_bounded
from artsim.common.products import apply, matmul, norm, unit
from artsim.errors import AssetError
from artsim.loading.bodies import (
    RigidBody,
    axis_in_base,
    in_order,
    join_screws,
    merge_fixed_links,
    without_empty_leaves,
)
from artsim.loading.described_bodies import with_described_bodies
from artsim.loading.meshes import LoadLimits, MeshReader, UnusableMeshError, check_shapes, merge_shapes
from artsim.loading.mjcf_xml import is_mjcf
from artsim.loading.packages import MissingFileError
from artsim.loading.partnet import GAPARTNET, read_side_files
from artsim.loading.rest_frame import rest_rotation
from artsim.loading.rest_state import canonical_category, rest_state
from artsim.loading.urdf_document import UrdfJoint, UrdfLink, UrdfRobot
from artsim.loading.urdf_xml import parse_robot
from artsim.loading.usd_layers import SUFFIXES
from artsim.loading.xml_repair import xacro_error
from artsim.model.kinematics import Array, Joint, KinematicTree, Mimic, transform_points
from artsim.model.object_file import load_object
from artsim.model.objects import ArticulatedObject, Part, Repair, content_sha256

OTHER_FILES = ("mobility.xml", "mobility.usda", "mobility.usdc", "mobility.usd")
"""Names of an object's file, in a folder without a URDF file, in MJCF and in USD."""

_FAR = 20.0
"""Times the object's size that no slide goes: a cart on its track goes once, a drawer less."""
_THIN = 1e-6
"""Share of its length by which a surface is a line: squares of less are lost in double precision."""
_NOTHING = 1e-9
"""Metres below which a whole shape is a point: an atom is a tenth of it."""


def load(
    path: str | Path,
    category: str | None = None,
    package_roots: Mapping[str, str | Path] | None = None,
    limits: LoadLimits | None = None,
) -> ArticulatedObject:
    """Load an articulated object.

    Parameters
    ----------
    path : str or Path
        A URDF, MJCF or USD file, a folder that holds one (such as a PartNet-Mobility folder), or an ``.npz`` object
        file out of a generated dataset.
    category : str, optional
        Category whose rest state and rest frame are wanted; by default what the side files say, else "unknown", for
        which both are as the file has them.
    package_roots : mapping, optional
        Folders of ``package://`` names. Meshes outside these and the asset's own folder are refused.
    limits : LoadLimits, optional
        Bounds on the size of the files.

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
    file = find_urdf(Path(path))
    if file.suffix == ".npz":
        return load_object(file)
    data = read_urdf(file, max_bytes(file, limits))
    side = read_side_files(file)
    roots = _roots(package_roots or {})
    reader = MeshReader(file.parent, roots, limits)
    robot, repairs, contents = _read_document(data, file, reader, side.helpers)

    repairs += side.repairs
    category = canonical_category(category or side.category or "unknown")
    bodies = merge_fixed_links(robot, file, repairs)
    _read_geometry(bodies, robot, reader, file, repairs)
    repairs += reader.paths.repairs
    bodies = join_screws(without_empty_leaves(bodies, repairs), side.helpers, repairs, guessed=not robot.explicit)
    bodies, exported = in_order(bodies, side.parts, repairs)
    tree, source_joints = _tree(bodies, file)
    parts = [body.part(side.labels) for body in bodies]
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
    parts = with_described_bodies(parts, bodies, robot, reader, matmul(np.linalg.inv(T_base_rest), T_base_part))
    repairs += reasons
    repairs += _far_slides(tree, parts)
    return ArticulatedObject(
        object_id=_object_id(file, side.object_id),
        category=category,
        parts=tuple(parts),
        native_tree=tree,
        sha256=content_sha256([data, *contents, *side.contents, *reader.contents]),
        T_base_rest=T_base_rest,
        repairs=tuple(repairs),
        source=str(file),
        source_joints=source_joints,
    )


def _read_document(
    data: bytes, file: Path, reader: MeshReader, helpers: Sequence[str]
) -> tuple[UrdfRobot, list[Repair], list[bytes]]:
    """Links and joints of a file of any format, what was mended, and what other files it is made of."""
    limits = reader.limits
    if file.suffix.lower() in SUFFIXES:
        from artsim.loading.usd import read_usd

        return read_usd(file, limits)
    if is_mjcf(data, file):
        from artsim.loading.mjcf import read_mjcf

        return read_mjcf(data, file, reader, limits)
    check_shapes(data, file, limits)
    return *parse_robot(data, file, limits.max_links, helpers), []


def max_bytes(file: Path, limits: LoadLimits) -> int:
    """Size that an object's file may have: that of USD holds its meshes."""
    return limits.max_mesh_bytes if file.suffix.lower() in SUFFIXES else limits.max_urdf_bytes


def _far_slides(tree: KinematicTree, parts: list[Part]) -> list[Repair]:
    """Slides that go so far that their limits look like millimetres."""
    bounds = np.stack([part.bounds for part in parts if len(part.faces)])
    size = float(norm(bounds[:, 1].max(axis=0) - bounds[:, 0].min(axis=0)))
    return [
        Repair(
            f"joint {joint.name!r}",
            f"goes from {joint.lower:g} to {joint.upper:g} m in an object of {size:.3g} m: its limits look like "
            f'millimetres, and are taken as metres; if they are, write lower="{joint.lower / 1000:.6g}" '
            f'upper="{joint.upper / 1000:.6g}"',
        )
        for joint in tree.joints
        if joint.type == "prismatic" and joint.upper - joint.lower > _FAR * size
    ]


def read_urdf(file: Path, max_bytes: int) -> bytes:
    """The content of an object's file, which lies in its folder once links are followed.

    The folder itself may be reached through links: then its meshes are there, too.

    Raises
    ------
    AssetError
        When it cannot be read, is too large, or is a link that leads out of its folder.
    """
    what = "URDF file" if file.suffix == ".urdf" else "object's file"
    if file.is_symlink() and not file.resolve().is_relative_to(file.parent.resolve()):
        raise AssetError(
            f"the {what} is a link that leads out of its folder", file, f"pass the file itself: {file.resolve()}"
        )
    return read_bounded(file, max_bytes, what)


def is_urdf(file: Path) -> bool:
    """Whether an object's file is URDF, and not MJCF, USD or an object file.

    Raises
    ------
    AssetError
        When it cannot be read.
    """
    if file.suffix.lower() in (".npz", *SUFFIXES):
        return False
    return not is_mjcf(read_urdf(file, LoadLimits().max_urdf_bytes), file)


def find_urdf(path: Path) -> Path:
    """The file that a path names: itself, or the URDF file in a folder; without one, its MJCF or USD file.

    Raises
    ------
    AssetError
        When there is none, or several to choose from.
    """
    try:
        if path.is_file():
            return path
        found_folder = path.is_dir()
    except OSError:  # a name that is too long for the system
        found_folder = False
    if not found_folder:
        raise AssetError("no such file or folder", path, "pass a URDF, MJCF or USD file, or a folder that holds one")
    for mobility in (path / "mobility.urdf", path / GAPARTNET):
        if mobility.is_file():
            return mobility
    found = sorted(p for p in path.glob("*.urdf") if p.is_file())
    if len(found) == 1:
        return found[0]
    if not found:
        other = next((path / name for name in OTHER_FILES if (path / name).is_file()), None)
        if other is not None:
            return other
        macros = sorted(path.glob("*.xacro"))
        if macros:
            raise xacro_error("the folder holds no URDF file, but macros", macros[0])
        raise AssetError("the folder holds no URDF file", path, "pass a folder with a mobility.urdf or one *.urdf")
    raise AssetError(f"the folder holds {len(found)} URDF files", path, f"pass one of them, such as {found[0].name}")


def _roots(declared: Mapping[str, str | Path]) -> dict[str, Path]:
    roots = {name: Path(folder).expanduser().absolute() for name, folder in declared.items()}
    for name, folder in roots.items():
        if not folder.is_dir():
            raise AssetError("no such folder", f"package root {name}={folder}", "name the folder of the package")
    return roots


def _object_id(file: Path, annotated: str | None) -> str:
    """PartNet-Mobility's own number is the folder's name; ``meta.json`` may carry an older one."""
    if file.stem != "mobility" and file.name != GAPARTNET:
        return _encodable(file.stem)
    folder = file.resolve().parent.name
    return _encodable(folder) if folder.isdigit() or annotated is None else annotated


def _encodable(name: str) -> str:
    """A file's name as text that can be written; names of files may be any bytes."""
    return name.encode("utf-8", "replace").decode("utf-8")


def _read_geometry(
    bodies: list[RigidBody], robot: UrdfRobot, reader: MeshReader, file: Path, repairs: list[Repair]
) -> None:
    """Fill in every body's surface from the shapes of its links."""
    links = {link.name: link for link in robot.links}
    for body in bodies:
        surfaces = []
        unusable = []
        for name in body.links:
            found, problems = _surfaces(links[name], body.T_base_link[name], reader, file)
            surfaces += found
            unusable += [f"link {name!r}: {problem}" for problem in problems]
            repairs += [Repair(f"link {name!r}", f"{problem}: left out") for problem in problems]
        if unusable and not surfaces:
            raise AssetError(
                f"a part has no extent: {unusable[0]}", file, "give it a size above 0, or remove the empty shape"
            )
        body.vertices, body.faces = merge_shapes(surfaces)
        _check_range(body.vertices, f"{file}: link {body.links[0]!r}")
    repairs += reader.notes
    if not any(len(body.faces) for body in bodies):
        raise AssetError("no link has any geometry", file, "give a link a visible shape")


def _surfaces(
    link: UrdfLink, T_base_link: Array, reader: MeshReader, file: Path
) -> tuple[list[tuple[Array, NDArray[np.int32], Array]], list[str]]:
    """Vertices, triangles and transform into the base frame of each shape of a link, and why others are left out.

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
            _check_range(vertices, f"{file}: link {link.name!r}")
            if _is_thin(vertices, faces):
                raise UnusableMeshError(f"{shape.geometry} has no extent: all of it lies on a line or in a point")
        except UnusableMeshError as problem:
            problems.append(str(problem))
            if isinstance(problem.__cause__, MissingFileError):
                fix = fix or problem.__cause__.fix
            continue
        surfaces.append((vertices, faces, matmul(T_base_link, shape.origin)))
    if problems and not surfaces:
        count = len(problems)
        raise AssetError(
            f"none of the {count} meshes of link {link.name!r} can be used: {problems[0]}",
            file,
            fix or "restore the mesh files; an object with an invisible part would give wrong data",
        )
    return surfaces, [*problems, *link.empty]


_LARGEST = 1e6
"""Metres, or units of a file in millimetres: squares and products of much larger coordinates overflow."""


def _check_range(vertices: Array, where: str) -> None:
    """Refuse coordinates that nothing can be computed with.

    Raises
    ------
    AssetError
    """
    if not (np.abs(vertices) <= _LARGEST).all():
        raise AssetError(
            f"a coordinate is not finite, or over {_LARGEST:g}", where, "write sizes, origins and meshes in metres"
        )


def _is_thin(vertices: Array, faces: NDArray[np.int32]) -> bool:
    """Whether a surface is a point or a line; one that is flat is not."""
    used = vertices  # readers leave none out
    if len(used) < 3:
        return True
    from_middle = used - used.mean(axis=0)
    # Second moments, smallest first: their roots are the extents along the principal axes.
    extents = np.sqrt(np.linalg.eigvalsh(from_middle.T @ from_middle).clip(0.0))
    return bool(extents[1] <= _THIN * extents[2] or extents[2] < _NOTHING)


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
    T_base_rest = np.eye(4)
    if turn is not None:
        T_base_rest[:3, :3] = turn.T
        posed = [replace(p, vertices=apply(turn, p.vertices)) for p in posed]
        joints = [
            replace(joint, axis=_triple(apply(turn, joint.axis)), origin=_triple(apply(turn, joint.origin)))
            for joint in joints
        ]
    bounds = np.stack([p.bounds for p in posed if len(p.faces)])
    center = 0.5 * (bounds[:, 0].min(axis=0) + bounds[:, 1].max(axis=0))
    joints = [replace(joint, origin=_triple(np.asarray(joint.origin) - center)) for joint in joints]
    joints[0] = replace(joints[0], origin=(0.0, 0.0, 0.0))
    T_base_rest[:3, 3] = apply(T_base_rest[:3, :3], center)
    return KinematicTree(joints), [replace(p, vertices=p.vertices - center) for p in posed], T_base_rest, reasons
