"""``artsim.load``: a URDF file or a PartNet-Mobility folder becomes an :class:`ArticulatedObject`.

Three separate steps: the document is checked and parsed (``urdf_xml``), its meshes are read (``meshes``), and
here links are merged into rigid parts, joints are rewritten in the rest frame, and the rest state is chosen.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from artsim.errors import AssetError
from artsim.files import read_bounded
from artsim.kinematics import Array, Joint, KinematicTree, Mimic, transform_points
from artsim.meshes import LoadLimits, MeshReader, UnusableMeshError, merged
from artsim.object_file import load_object
from artsim.objects import ArticulatedObject, Part, Repair, content_sha256
from artsim.partnet import read_side_files
from artsim.rest import canonical_category, rest_state
from artsim.urdf_xml import parse_robot

if TYPE_CHECKING:
    import yourdfpy


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
        A URDF file, a folder that holds one (such as a PartNet-Mobility folder), or an ``.npz`` object file
        out of a generated dataset.
    category : str, optional
        Category whose rest state is wanted; by default what the side files say, else "unknown".
    package_roots : mapping, optional
        Folders of ``package://`` names. Meshes outside these and the asset's own folder are refused.
    limits : LoadLimits, optional
        Bounds on the size of the files.

    Returns
    -------
    ArticulatedObject
        In its rest frame; ``repairs`` lists what was mended.

    Raises
    ------
    AssetError
        Naming file, element and mend.
    """
    limits = limits or LoadLimits()
    file = find_urdf(Path(path))
    if file.suffix == ".npz":
        return load_object(file)
    data = read_bounded(file, limits.max_urdf_bytes, "URDF file")
    side = read_side_files(file.parent)
    robot, repairs = parse_robot(data, file, limits.max_links, side.helpers)
    roots = {name: Path(folder) for name, folder in (package_roots or {}).items()}
    reader = MeshReader(file.parent, roots, limits)

    repairs += side.repairs
    category = canonical_category(category or side.category or "unknown")
    bodies = _merge_fixed_links(robot, file, repairs)
    _read_geometry(bodies, robot, reader, file, repairs)
    bodies = _join_screws(_without_empty_leaves(bodies, repairs), side.helpers, repairs)
    bodies, exported = _in_order(bodies, side.parts, repairs)
    tree, source_joints = _tree(bodies, file)
    parts = [body.part(side.labels) for body in bodies]
    if side.num_movable is not None and len(tree) - 1 != side.num_movable:
        repairs.append(
            Repair("file", f"moves {len(tree) - 1} parts where its annotation lists {side.num_movable}: taken as it is")
        )
    # No rule holds for a category that nothing is known of: the zero of a file of our own needs no aligning.
    rest, reasons = rest_state(tree, parts, "unknown" if exported else category)
    repairs += reasons
    tree, parts, T_base_rest = _to_rest_frame(tree, parts, rest)
    return ArticulatedObject(
        object_id=_object_id(file, side.object_id),
        category=category,
        parts=tuple(parts),
        native_tree=tree,
        sha256=content_sha256([data, *side.contents, *reader.contents]),
        T_base_rest=T_base_rest,
        repairs=tuple(repairs),
        source=str(file),
        source_joints=source_joints,
    )


def find_urdf(path: Path) -> Path:
    """The URDF (or object) file that a path names: itself, or the one in a folder.

    Raises
    ------
    AssetError
        When there is none, or several to choose from.
    """
    if path.is_file():
        return path
    if not path.is_dir():
        raise AssetError("no such file or folder", path, "pass a URDF file or a folder that holds one")
    mobility = path / "mobility.urdf"
    if mobility.is_file():
        return mobility
    found = sorted(p for p in path.glob("*.urdf") if p.is_file())
    if len(found) == 1:
        return found[0]
    if not found:
        raise AssetError("the folder holds no URDF file", path, "pass a folder with a mobility.urdf or one *.urdf")
    raise AssetError(f"the folder holds {len(found)} URDF files", path, f"pass one of them, such as {found[0].name}")


def _object_id(file: Path, annotated: str | None) -> str:
    """PartNet-Mobility's own number is the folder's name; ``meta.json`` may carry an older one."""
    if file.stem != "mobility":
        return file.stem
    folder = file.resolve().parent.name
    return folder if folder.isdigit() or annotated is None else annotated


# --- links become rigid bodies ---------------------------------------------------------------------------------


@dataclass(eq=False)
class _Body:
    """Links that never move against each other, in the base link's frame at the file's zero state."""

    links: list[str]
    joint: yourdfpy.Joint | None  # the moving joint that carries the body; None for the root
    parent: _Body | None
    T_base_joint: Array
    T_base_link: dict[str, Array]
    vertices: Array
    faces: NDArray[np.int32]
    slide: yourdfpy.Joint | None = None  # screws: the prismatic joint merged into this one
    slide_rate: float = 0.0  # screws: value of the slide joint for each radian
    pitch: float = 0.0  # screws: metres along the turning axis for each radian

    def part(self, labels: Mapping[str, str]) -> Part:
        label = next((labels[link] for link in self.links if link in labels), None)
        solid = self.links[0] if label is None else next(link for link in self.links if link in labels)
        return Part(solid, label or solid, self.vertices, self.faces)


def _merge_fixed_links(robot: yourdfpy.Robot, file: Path, repairs: list[Repair]) -> list[_Body]:
    """Bodies of the tree, root first, parents before children, siblings in the file's order."""
    children: dict[str, list[yourdfpy.Joint]] = defaultdict(list)
    for joint in robot.joints:
        children[joint.parent].append(joint)
    root = _root_link(robot, children, file, repairs)

    def new_body(link: str, joint: yourdfpy.Joint | None, parent: _Body | None, T: Array) -> _Body:
        return _Body([link], joint, parent, T, {link: T}, np.zeros((0, 3)), np.zeros((0, 3), np.int32))

    bodies = [new_body(root, None, None, np.eye(4))]
    body_of = {root: bodies[0]}
    stack = [root]
    while stack:
        link = stack.pop()
        body = body_of[link]
        if body.links[0] == link and body is not bodies[0]:
            bodies.append(body)
        for joint in children[link]:
            T = body.T_base_link[link] @ (np.eye(4) if joint.origin is None else joint.origin)
            if joint.type == "fixed" or _places_root(joint, link, root, children, repairs):
                body.links.append(joint.child)
                body.T_base_link[joint.child] = T
                body_of[joint.child] = body
            elif joint.type == "floating":
                raise AssetError(
                    "a floating joint inside the object is not supported",
                    f"{file}: joint {joint.name!r}",
                    "split the file into one object per floating part",
                )
            else:
                body_of[joint.child] = new_body(joint.child, joint, body, T)
        stack += [joint.child for joint in reversed(children[link])]
    lost = [link.name for link in robot.links if link.name not in body_of]
    if lost:
        raise AssetError(f"links {', '.join(lost[:5])} form a cycle that hangs on nothing", file, "remove one joint")
    merged_links = [link for body in bodies for link in body.links[1:]]
    if merged_links:
        repairs.append(Repair("fixed joints", f"merged into their parent: {', '.join(merged_links)}"))
    return bodies


def _root_link(
    robot: yourdfpy.Robot, children: Mapping[str, list[yourdfpy.Joint]], file: Path, repairs: list[Repair]
) -> str:
    carried_by: dict[str, str] = {}
    for joint in robot.joints:
        if joint.child in carried_by:
            raise AssetError(
                f"link {joint.child!r} is carried by two joints, {carried_by[joint.child]!r} and {joint.name!r}",
                file,
                "closed chains are not trees: remove one of the joints",
            )
        carried_by[joint.child] = joint.name
    roots = [link for link in robot.links if link.name not in carried_by]
    if not roots:
        raise AssetError("every link has a parent: the joints form a cycle", file, "remove the joint that closes it")
    used = [r for r in roots if r.visuals or r.collisions or children.get(r.name)] or roots[:1]
    if len(used) > 1:
        names = ", ".join(r.name for r in used[:5])
        raise AssetError(f"{len(used)} links have no parent: {names}", file, "join them with a fixed joint")
    for stray in roots:
        if stray is not used[0]:
            repairs.append(Repair(f"link {stray.name!r}", "left out: no joint reaches it and it has no geometry"))
    return str(used[0].name)


def _places_root(
    joint: yourdfpy.Joint,
    link: str,
    root: str,
    children: Mapping[str, list[yourdfpy.Joint]],
    repairs: list[Repair],
) -> bool:
    """Whether a floating joint only places the whole object in its world: the object's own pose covers that."""
    if joint.type != "floating" or link != root or len(children[root]) != 1:
        return False
    repairs.append(Repair(f"joint {joint.name!r}", "floats the whole object: left to the object's pose"))
    return True


def _read_geometry(
    bodies: list[_Body], robot: yourdfpy.Robot, reader: MeshReader, file: Path, repairs: list[Repair]
) -> None:
    """Fill in every body's surface from its links' visuals (or collisions, when the file has no visual at all)."""
    links = {link.name: link for link in robot.links}
    use_collisions = not any(link.visuals for link in robot.links)
    if use_collisions:
        repairs.append(Repair("file", "has no <visual>: its collision geometry is shown"))
    for body in bodies:
        shapes = []
        for name in body.links:
            elements = links[name].collisions if use_collisions else links[name].visuals
            problems = []
            for element in elements:
                T_base_shape = body.T_base_link[name] @ (np.eye(4) if element.origin is None else element.origin)
                try:
                    vertices, faces = reader.shape(element.geometry)
                except UnusableMeshError as problem:
                    problems.append(str(problem))
                    continue
                shapes.append((vertices, faces, T_base_shape))
            repairs += [Repair(f"link {name!r}", f"{problem}: left out") for problem in problems]
            if problems and len(problems) == len(elements):
                raise AssetError(
                    f"none of the {len(elements)} meshes of link {name!r} can be used: {problems[0]}",
                    file,
                    "restore the mesh files; an object with an invisible part would give wrong data",
                )
        body.vertices, body.faces = merged(shapes)
    for name, count in reader.dropped_faces.items():
        repairs.append(Repair(f"mesh {name!r}", f"{count} triangles left out: not finite or out of range"))
    if not any(len(body.faces) for body in bodies):
        raise AssetError("no link has any geometry", file, "add <visual> elements")


def _without_empty_leaves(bodies: list[_Body], repairs: list[Repair]) -> list[_Body]:
    """Bodies without those that show nothing, carry nothing and drive nothing (tool frames, sensor frames)."""
    drivers = {body.joint.mimic.joint for body in bodies if body.joint is not None and body.joint.mimic is not None}
    kept = list(bodies)
    for body in reversed(bodies):  # children before parents
        if body.joint is None or len(body.faces) or body.joint.name in drivers:
            continue
        if not any(other.parent is body for other in kept):
            kept.remove(body)
            repairs.append(Repair(f"link {body.links[0]!r}", "left out: it moves, but shows and carries nothing"))
    return kept


def _join_screws(bodies: list[_Body], known: Collection[str], repairs: list[Repair]) -> list[_Body]:
    """One screw part in place of a helper link between a prismatic and a continuous joint on one axis.

    Helpers that the file's annotation knows of need no mention.
    """
    kept = list(bodies)
    for helper in bodies:
        carried = [b for b in bodies if b.parent is helper]
        if helper.joint is None or len(helper.faces) or len(carried) != 1:
            continue
        body = carried[0]
        by_type = {b.joint.type: b for b in (helper, body) if b.joint is not None}
        if set(by_type) != {"prismatic", "continuous"} or body.joint is None:
            continue
        turn, slide = by_type["continuous"], by_type["prismatic"]
        along = float(_axis(slide) @ _axis(turn))
        rate = _slide_rate(turn, slide)
        if abs(abs(along) - 1.0) > 1e-6 or rate == 0.0:
            continue
        others = [b.joint.mimic.joint for b in bodies if b not in (helper, body) and b.joint and b.joint.mimic]
        if slide.joint is None or turn.joint is None or slide.joint.name in others:
            continue
        pitch = rate * _stretch(slide.joint) * float(np.sign(along))
        body.links = body.links + helper.links
        if helper.links[0] not in known:
            repairs.append(
                Repair(
                    f"link {helper.links[0]!r}",
                    f"helper of a screw: joints {helper.joint.name!r} and {body.joint.name!r} joined into one of "
                    f"{pitch:.6g} m/rad",
                )
            )
        body.slide, body.slide_rate, body.pitch = slide.joint, rate, pitch
        body.T_base_joint, body.joint, body.parent = turn.T_base_joint, turn.joint, helper.parent
        kept.remove(helper)
    return kept


def _in_order(bodies: list[_Body], order: Sequence[str], repairs: list[Repair]) -> tuple[list[_Body], bool]:
    """Bodies in the order of a list of their links, and whether there was one that fits."""
    by_name = {body.links[0]: body for body in bodies}
    ordered = [by_name[name] for name in order if name in by_name]
    position = {body: i for i, body in enumerate(ordered)}
    fits = len(order) == len(position) == len(bodies) and all(
        (body.parent is None) == (i == 0) and (body.parent is None or position[body.parent] < i)
        for i, body in enumerate(ordered)
    )
    if order and not fits:
        repairs.append(Repair("meta.json", "its list of parts is not that of the file: ignored"))
    return (ordered, True) if fits else (bodies, False)


def _axis(body: _Body) -> Array:
    """Unit axis of a body's joint in the base link's frame."""
    axis = np.asarray(body.joint.axis, dtype=np.float64)  # type: ignore[union-attr]
    direction: Array = body.T_base_joint[:3, :3] @ (axis / np.linalg.norm(axis))
    return direction / np.linalg.norm(direction)


def _slide_rate(turn: _Body, slide: _Body) -> float:
    """Slide for each radian of turn: what a mimic relation says, else one turn for the whole slide."""
    assert turn.joint is not None
    assert slide.joint is not None
    if slide.joint.mimic is not None and slide.joint.mimic.joint == turn.joint.name:
        mimic = slide.joint.mimic
        return 0.0 if mimic.offset else float(1.0 if mimic.multiplier is None else mimic.multiplier)
    return float(slide.joint.limit.upper - slide.joint.limit.lower) / (2.0 * np.pi)


# --- bodies become a tree ---------------------------------------------------------------------------------------


def _tree(bodies: list[_Body], file: Path) -> tuple[KinematicTree, dict[str, tuple[int, float]]]:
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
            lower, upper = float(joint.limit.lower), float(joint.limit.upper)
        if body.slide is not None:
            kind = "screw"
            lower, upper = sorted(
                float(v) / body.slide_rate + 0.0 for v in (body.slide.limit.lower, body.slide.limit.upper)
            )
            source_joints[body.slide.name] = (k, body.slide_rate)
        # Simulators move a prismatic joint by its value times its axis, whatever the axis's length.
        lower, upper = lower * _stretch(joint), upper * _stretch(joint)
        source_joints[joint.name] = (k, 1.0 / _stretch(joint))
        joints.append(
            Joint(
                name=joint.name,
                type=kind,
                parent=position[id(body.parent)],
                axis=_triple(_axis(body)),
                origin=_triple(body.T_base_joint[:3, 3]),
                lower=lower,
                upper=upper,
                pitch=body.pitch,
                mimic=_mimic(joint, bodies, index, file),
            )
        )
    return KinematicTree(joints), source_joints


def _triple(vector: Array) -> tuple[float, float, float]:
    x, y, z = vector.tolist()
    return x, y, z


def _stretch(joint: yourdfpy.Joint) -> float:
    """Metres of travel for each unit of a prismatic joint's value; 1 for joints that turn."""
    return float(np.linalg.norm(joint.axis)) if joint.type == "prismatic" else 1.0


def _mimic(joint: yourdfpy.Joint, bodies: list[_Body], index: Mapping[str, int], file: Path) -> Mimic | None:
    if joint.mimic is None:
        return None
    source = index.get(joint.mimic.joint)
    if source is None:
        raise AssetError(
            f"mimics joint {joint.mimic.joint!r}, which does not exist or does not move",
            f"{file}: joint {joint.name!r}",
            "name a moving joint of the file",
        )
    multiplier = 1.0 if joint.mimic.multiplier is None else float(joint.mimic.multiplier)
    offset = 0.0 if joint.mimic.offset is None else float(joint.mimic.offset)
    unit = _stretch(joint)
    return Mimic(source, multiplier * unit / _stretch(bodies[source].joint), offset * unit)


def _to_rest_frame(tree: KinematicTree, parts: list[Part], rest: Array) -> tuple[KinematicTree, list[Part], Array]:
    """Pose everything at the rest state and move the origin to the centre of the whole object's box.

    Returns the tree, the parts and ``T_base_rest``.
    """
    rest = tree.complete_state(rest)
    T_base_part = tree.forward_kinematics(rest)
    axes, origins = tree.posed_joints(T_base_part)
    posed = [replace(p, vertices=transform_points(T, p.vertices)) for p, T in zip(parts, T_base_part, strict=True)]
    bounds = np.stack([p.bounds for p in posed if len(p.faces)])
    center = 0.5 * (bounds[:, 0].min(axis=0) + bounds[:, 1].max(axis=0))
    joints = [
        replace(joint, axis=_triple(a), origin=_triple(o - center), rest=float(r))
        for joint, a, o, r in zip(
            tree.joints, axes / np.linalg.norm(axes, axis=1, keepdims=True), origins, rest, strict=True
        )
    ]
    joints[0] = replace(joints[0], origin=(0.0, 0.0, 0.0))
    T_base_rest = np.eye(4)
    T_base_rest[:3, 3] = center
    return KinematicTree(joints), [replace(p, vertices=p.vertices - center) for p in posed], T_base_rest
