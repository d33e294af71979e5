"""Strictness: what a URDF file and a kinematic tree must say so that no simulator has to guess.

Both gates list problems; none means strict. Simulators forgive different omissions in different ways, which is why
files that leave something out (PartNet-Mobility's do) behave differently in each.
"""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from lxml import etree

from artsim.errors import ArtsimError
from artsim.loading.joint_xml import MOVING_TYPES
from artsim.loading.meshes import LoadLimits, MeshReader, UnusableMeshError
from artsim.loading.object_files import find_urdf, read_urdf
from artsim.loading.urdf_document import MeshFile
from artsim.loading.urdf_xml import safe_xml
from artsim.model.convex_bodies import is_convex
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject

TOLERANCE = 1e-6
"""By which an axis's length may differ from 1, and a mimic joint may leave its limits."""
_SHAPES = {"box": {"size": 3}, "cylinder": {"radius": 1, "length": 1}, "sphere": {"radius": 1}, "mesh": {}}
"""Geometries that every simulator reads: attribute -> count of its numbers. Capsules are not among them."""


def strict_urdf(path: str | Path, package_roots: Mapping[str, str | Path] | None = None) -> list[str]:
    """Problems of a URDF file.

    Strict means: one root link, and every other link carried by one joint; unique names; every link with a visual, a
    collision and an inertia of a possible body (a link between the two joints of a screw needs no shape); meshes that
    exist; every moving joint with a unit axis and with effort and velocity limits, and where it does not turn freely
    with position limits around 0; mimic relations that end.

    Parameters
    ----------
    path : str or Path
        URDF file or its folder.
    package_roots : mapping, optional
        As for :func:`artsim.load`.

    Returns
    -------
    list of str
        Each names an element and what is wrong with it.
    """
    try:
        file, root = _read(path)
    except ArtsimError as error:
        return [str(error)]
    if root.tag != "robot" or not root.get("name"):
        return [f"the top element <{root.tag}> is not a <robot> with a name"]
    links, joints = root.findall("link"), root.findall("joint")
    problems = _tree_problems(links, joints)
    helpers = _screw_helpers(joints)
    reader = MeshReader(file.parent, _paths(package_roots), LoadLimits())
    for link in links:
        problems += [f"link {link.get('name')!r}: {p}" for p in _link_problems(link, helpers, reader)]
    names = {joint.get("name"): joint for joint in joints}
    for joint in joints:
        problems += [f"joint {joint.get('name')!r}: {p}" for p in _joint_problems(joint, names)]
    return problems


def strict_inertia(path: str | Path) -> list[str]:
    """Problems of a URDF file's inertias: every link needs a mass, and the inertia of a possible body."""
    try:
        _, root = _read(path)
    except ArtsimError as error:
        return [str(error)]
    return [f"link {link.get('name')!r}: {p}" for link in root.findall("link") for p in _inertial_problems(link)]


def convex_collision_geometry(path: str | Path, package_roots: Mapping[str, str | Path] | None = None) -> list[str]:
    """Problems of a URDF file's collision geometry: every link needs some, of primitives and convex meshes."""
    try:
        file, root = _read(path)
    except ArtsimError as error:
        return [str(error)]
    helpers = _screw_helpers(root.findall("joint"))
    reader = MeshReader(file.parent, _paths(package_roots), LoadLimits())
    problems = []
    for link in root.findall("link"):
        shapes = link.findall("collision")
        found = [] if shapes or link.get("name") in helpers else ["has no <collision>"]
        found += [p for shape in shapes for p in _shape_problems(shape, reader) or _convexity_problems(shape, reader)]
        problems += [f"link {link.get('name')!r}: {p}" for p in found]
    return problems


def _convexity_problems(collision: etree._Element, reader: MeshReader) -> list[str]:
    mesh = collision.find("geometry/mesh")
    if mesh is None:
        return []
    name = mesh.get("filename") or ""
    try:
        vertices, faces = reader.shape(MeshFile(name))
    except (UnusableMeshError, ArtsimError) as problem:
        return [str(problem)]
    return [] if is_convex(vertices, faces) else [f"mesh {name.rpartition('/')[2]!r} is not convex"]


def _paths(package_roots: Mapping[str, str | Path] | None) -> dict[str, Path]:
    return {name: Path(folder) for name, folder in (package_roots or {}).items()}


def _read(path: str | Path) -> tuple[Path, etree._Element]:
    file = find_urdf(Path(path))
    return file, safe_xml(read_urdf(file, LoadLimits().max_urdf_bytes), file)


def _tree_problems(links: list[etree._Element], joints: list[etree._Element]) -> list[str]:
    problems = []
    for tag, elements in (("link", links), ("joint", joints)):
        for name, count in Counter(e.get("name") for e in elements).items():
            if not name or count > 1:
                problems.append(f"{tag} {name!r}: " + ("has no name" if not name else f"{count} of them"))
    names = {link.get("name") for link in links}
    carried: Counter[str | None] = Counter()
    for joint in joints:
        for end in ("parent", "child"):
            if _end(joint, end) not in names:
                problems.append(f"joint {joint.get('name')!r}: its {end} {_end(joint, end)!r} is no link")
        carried[_end(joint, "child")] += 1
    problems += [f"link {name!r}: carried by {count} joints" for name, count in carried.items() if count > 1]
    roots = [name for name in names if name not in carried]
    if len(roots) != 1:
        problems.append(f"{len(roots)} root links: {', '.join(sorted(map(str, roots))[:5])}")
    reached, added = set(roots), len(roots)
    while added:
        new = {_end(joint, "child") for joint in joints if _end(joint, "parent") in reached} - reached
        reached, added = reached | new, len(new)
    for name in sorted(map(str, names - reached)):
        problems.append(f"link {name!r}: hangs on a cycle")
    return problems


def _end(joint: etree._Element, end: str) -> str | None:
    element = joint.find(end)
    return None if element is None else element.get("link")


def _screw_helpers(joints: list[etree._Element]) -> set[str | None]:
    """Links between a continuous joint and a prismatic joint that follows it."""
    helpers = set()
    for first in joints:
        for second in joints:
            if _end(first, "child") is not None and _end(first, "child") == _end(second, "parent"):
                by_type = {joint.get("type"): joint for joint in (first, second)}
                if set(by_type) == {"continuous", "prismatic"}:
                    mimic = by_type["prismatic"].find("mimic")
                    if mimic is not None and mimic.get("joint") == by_type["continuous"].get("name"):
                        helpers.add(_end(first, "child"))
    return helpers


def _numbers(element: etree._Element | None, attribute: str, count: int) -> Array | None:
    """The finite numbers of an attribute, or None."""
    try:
        values = np.array([float(v) for v in (element.get(attribute) or "").split()])  # type: ignore[union-attr]
    except (ValueError, AttributeError):
        return None
    return values if len(values) == count and np.isfinite(values).all() else None


def _number(element: etree._Element | None, attribute: str) -> float | None:
    values = _numbers(element, attribute, 1)
    return None if values is None else float(values[0])


def _link_problems(link: etree._Element, helpers: set[str | None], reader: MeshReader) -> list[str]:
    problems = []
    for tag in ("visual", "collision"):
        shapes = link.findall(tag)
        if not shapes and link.get("name") not in helpers:
            problems.append(f"has no <{tag}>")
        for shape in shapes:
            problems += [f"<{tag}>: {p}" for p in [*_origin_problems(shape), *_shape_problems(shape, reader)]]
    return problems + _inertial_problems(link)


def _origin_problems(element: etree._Element) -> list[str]:
    origin = element.find("origin")
    if origin is None:
        return []
    wrong = [a for a in ("xyz", "rpy") if origin.get(a) is not None and _numbers(origin, a, 3) is None]
    return [f"{a}={origin.get(a)!r} of its origin is not three finite numbers" for a in wrong]


def _shape_problems(element: etree._Element, reader: MeshReader) -> list[str]:
    geometry = element.find("geometry")
    shape = None if geometry is None else next((s for s in geometry if s.tag in _SHAPES), None)
    if shape is None:
        return ["has no geometry that every simulator reads"]
    if shape.tag == "mesh":
        try:
            reader.resolve(shape.get("filename") or "")
        except (UnusableMeshError, ArtsimError) as problem:
            return [str(problem)]
        return []
    sizes = [_numbers(shape, attribute, count) for attribute, count in _SHAPES[shape.tag].items()]
    return [] if all(s is not None and (s > 0).all() for s in sizes) else [f"<{shape.tag}> has no size above 0"]


def _inertial_problems(link: etree._Element) -> list[str]:
    inertial = link.find("inertial")
    if inertial is None:
        return ["has no <inertial>"]
    problems = [f"<inertial>: {p}" for p in _origin_problems(inertial)]
    mass = _number(inertial.find("mass"), "value")
    if mass is None or mass <= 0:
        problems.append("has no mass above 0")
    entries = {a: _number(inertial.find("inertia"), a) for a in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
    xx, xy, xz, yy, yz, zz = (np.nan if v is None else v for v in entries.values())
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not np.isfinite(tensor).all():
        return [*problems, "its inertia is not six finite numbers"]
    moments = np.linalg.eigvalsh(tensor)
    if moments[0] <= 0:
        problems.append("its inertia is not positive definite")
    elif moments[2] > moments[:2].sum() * (1 + TOLERANCE):
        problems.append("its inertia is that of no possible body: one moment exceeds the sum of the others")
    return problems


def _joint_problems(joint: etree._Element, names: dict[str | None, etree._Element]) -> list[str]:
    kind = joint.get("type")
    problems = _origin_problems(joint)
    if kind == "fixed":
        return problems
    if kind not in MOVING_TYPES:
        return [*problems, f"type {kind!r} is not one of {', '.join(MOVING_TYPES)}, fixed"]
    axis = _numbers(joint.find("axis"), "xyz", 3)
    if axis is None:
        problems.append("has no axis")
    elif abs(np.linalg.norm(axis) - 1.0) > TOLERANCE:
        problems.append(f"its axis has length {np.linalg.norm(axis):.6g}")
    return problems + _limit_problems(joint, kind) + _mimic_problems(joint, names)


def _limit_problems(joint: etree._Element, kind: str) -> list[str]:
    limit = joint.find("limit")
    if limit is None:
        return ["has no limit"]
    problems = []
    for attribute in ("effort", "velocity"):
        value = _number(limit, attribute)
        if value is None or value <= 0:
            problems.append(f"has no {attribute} limit above 0")
    lower, upper = _number(limit, "lower"), _number(limit, "upper")
    if kind == "continuous":
        if limit.get("lower") is not None or limit.get("upper") is not None:
            problems.append("turns freely, but has position limits")
    elif lower is None or upper is None:
        problems.append("has no lower and upper limit")
    elif not lower <= 0 <= upper:
        problems.append(f"0 is outside its limits [{lower:g}, {upper:g}]")
    elif lower == upper:
        problems.append("its limits let it not move")
    return problems


def _mimic_problems(joint: etree._Element, names: dict[str | None, etree._Element]) -> list[str]:
    mimic, seen = joint.find("mimic"), {joint.get("name")}
    if mimic is None:
        return []
    wrong = [a for a in ("multiplier", "offset") if mimic.get(a) is not None and _number(mimic, a) is None]
    problems = [f"{a}={mimic.get(a)!r} of its mimic is not a finite number" for a in wrong]
    while mimic is not None:
        source = mimic.get("joint")
        if source not in names:
            return [*problems, f"mimics {source!r}, which is no joint"]
        if source in seen:
            return [*problems, "mimic relations form a loop"]
        seen.add(source)
        mimic = names[source].find("mimic")
    return problems


def strict_kinematics(obj: ArticulatedObject) -> list[str]:
    """Problems of an object's kinematic tree.

    Strict means: a single root and no cycles (parents come before children), all numbers finite, unit axes, q = 0 and
    the rest state within limits, joints that turn freely ``continuous`` and no others, every joint able to move, screws
    with a pitch, and mimic joints that stay within their limits wherever their source may go.

    Returns
    -------
    list of str
        Each names a joint and what is wrong with it.
    """
    tree = obj.tree
    problems = []
    if [k for k, joint in enumerate(tree.joints) if joint.parent < 0] != [0]:
        problems.append("not a single root")
    for k, joint in enumerate(tree.joints[1:], start=1):
        where = f"joint {joint.name!r}: "
        lower, upper = tree.limits[k]
        if not 0 <= joint.parent < k:
            problems.append(f"{where}its parent does not come before it")
        if not np.isfinite([*joint.axis, *joint.origin, joint.rest, joint.pitch]).all():
            problems.append(f"{where}axis, origin, rest state or pitch is not finite")
        if abs(np.linalg.norm(joint.axis) - 1.0) > TOLERANCE:
            problems.append(f"{where}its axis has length {np.linalg.norm(joint.axis):.6g}")
        if joint.type == "continuous":
            if np.isfinite(lower) or np.isfinite(upper):
                problems.append(f"{where}turns freely, but has limits")
        elif not (np.isfinite(lower) and np.isfinite(upper)):
            problems.append(f"{where}is {joint.type} without limits")
        elif lower == upper:
            problems.append(f"{where}its limits let it not move")
        if not (lower <= 0 <= upper and lower <= joint.rest <= upper):
            problems.append(f"{where}0 or its rest state is outside its limits [{lower:g}, {upper:g}]")
        if joint.type == "screw" and joint.pitch == 0:
            problems.append(f"{where}is a screw without a pitch")
        if joint.mimic is not None:
            problems += [where + p for p in _reach_problems(obj, k)]
    return problems


def _reach_problems(obj: ArticulatedObject, k: int) -> list[str]:
    """Whether joint k, which follows another, leaves its limits."""
    tree = obj.tree
    mimic = tree.joints[k].mimic
    assert mimic is not None
    source, own = tree.limits[mimic.source], tree.limits[k]
    if np.isinf(source).any():
        return [] if np.isinf(own).all() else ["follows a joint that turns freely, but has limits"]
    reach = np.sort(mimic.multiplier * source + mimic.offset)
    if reach[0] < own[0] - TOLERANCE or reach[1] > own[1] + TOLERANCE:
        return [f"is carried to [{reach[0]:g}, {reach[1]:g}], beyond its limits [{own[0]:g}, {own[1]:g}]"]
    return []
