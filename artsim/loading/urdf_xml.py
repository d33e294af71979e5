"""From the bytes of a URDF file to a checked :class:`~artsim.loading.urdf_document.UrdfRobot`.

The file is untrusted: no document type, no entities, bounded size, every number finite. What can be mended is mended
and recorded; what cannot raises an error that names the element.
"""

from collections import Counter
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
from lxml import etree

from artsim.errors import AssetError
from artsim.loading.joint_xml import read_joint
from artsim.loading.urdf_document import Box, Capsule, Cylinder, Geometry, MeshFile, Shape, Sphere, UrdfLink, UrdfRobot
from artsim.loading.xml_repair import readable_xml, use_plain_names
from artsim.loading.xml_values import Element
from artsim.model.details import label_of_visual
from artsim.model.objects import Repair

SHAPES = ("box", "cylinder", "capsule", "sphere", "mesh")


def safe_xml(data: bytes, where: Path, huge_tree: bool = False) -> etree._Element:
    """Parse XML without entities, document types, network or, unless they are allowed, huge nodes.

    Raises
    ------
    AssetError
        When the file is empty, not well formed, or declares a document type.
    """
    if not data.strip():
        raise AssetError("the file is empty", where, "write or download it again")
    parser = etree.XMLParser(
        resolve_entities=False,
        no_network=True,
        load_dtd=False,
        huge_tree=huge_tree,
        remove_comments=True,
        remove_pis=True,
    )
    try:
        root = etree.fromstring(data, parser)
    except (etree.XMLSyntaxError, ValueError, LookupError) as error:
        raise AssetError(f"not well-formed XML ({error})", where, "correct the element at that line") from error
    if root.getroottree().docinfo.doctype:
        raise AssetError("declares a document type, which could hide entities", where, "remove the <!DOCTYPE ...>")
    return root


def parse_robot(
    data: bytes, where: Path, max_links: int, shapeless: Collection[str] = ()
) -> tuple[UrdfRobot, list[Repair]]:
    """Read, check and mend a URDF document.

    Parameters
    ----------
    data : bytes
        Content of the URDF file.
    where : Path
        Its path, for messages.
    max_links : int
        Limit on the number of links.
    shapeless : collection of str
        Links that are known to have no geometry.

    Returns
    -------
    robot : UrdfRobot
    repairs : list of Repair

    Raises
    ------
    AssetError
        Naming the file and the element that cannot be used.
    """
    data, repairs = readable_xml(data, where)
    root = safe_xml(data, where)
    repairs += use_plain_names(root, where)
    if not root.get("name"):
        repairs.append(Repair("<robot>", f"has no name: called {where.stem!r}"))
    links, joints = root.findall("link"), root.findall("joint")
    if not links:
        raise AssetError("has no <link>", where, "pass a URDF file that describes an object")
    if len(links) > max_links:
        raise AssetError(f"{len(links)} links are over the limit of {max_links}", where, "raise LoadLimits.max_links")
    _check_names(links, "link", where)
    _check_names(joints, "joint", where)
    shown = "visual" if any(link.find("visual/geometry") is not None for link in links) else "collision"
    if shown == "collision" and any(link.find("collision/geometry") is not None for link in links):
        repairs.append(Repair("file", "has no <visual>: its collision geometry is shown"))
    read = tuple(_read_link(link, shown, where, repairs) for link in links)
    names = {link.name for link in read}
    robot = UrdfRobot(read, tuple(read_joint(joint, names, where, repairs) for joint in joints))
    _summarise_missing(links, shapeless, repairs)
    return robot, repairs


def _check_names(elements: Sequence[etree._Element], tag: str, where: Path) -> None:
    counts = Counter(e.get("name") for e in elements)
    for name, count in counts.items():
        if not name:
            raise AssetError(f"a <{tag}> has no name", where, "name it")
        if count > 1:
            raise AssetError(f"{count} {tag}s are called {name!r}", where, "give each its own name")


def _read_link(link: etree._Element, shown: str, file: Path, repairs: list[Repair]) -> UrdfLink:
    """A link with the shapes that it shows, its ``<visual>`` or ``<collision>`` elements; inertia is not read."""
    element = Element(f"link {link.get('name')!r}", file, repairs)
    if link.find("origin") is not None or link.find("pose") is not None:
        element.say("an <origin> of the link itself is not URDF, and is not read")
    shapes, unusable, empty = [], [], []
    for found in link.findall(shown):
        try:
            shape = _read_shape(found, element)
        except EmptyShapeError as problem:
            empty.append(str(problem))
            continue
        except UnusableShapeError as problem:
            unusable.append(str(problem))
            continue
        if shape is not None:
            shapes.append(shape)
    named = [found for found in link.findall("collision") if label_of_visual(found.get("name") or "") is not None]
    details = [] if shown == "collision" else [_read_shape(found, element) for found in named]
    kept = tuple(shape for shape in details if shape is not None)
    return UrdfLink(str(link.get("name")), tuple(shapes), tuple(unusable), tuple(empty), kept)


class UnusableShapeError(Exception):
    """One shape cannot be used, and why; the loader leaves it out and says so."""


class EmptyShapeError(UnusableShapeError):
    """A shape has no extent: files mark frames with boxes of size 0, which nobody misses where more is seen."""


def _read_shape(visual: etree._Element, element: Element) -> Shape | None:
    """A shape; None where the element has none."""
    geometry = element.child(visual, "geometry")
    shapes = [] if geometry is None else [s for s in geometry if isinstance(s.tag, str) and s.tag != "origin"]
    if geometry is None or not shapes:
        element.say(f"<{visual.tag}> left out: it has no geometry")
        return None
    if geometry.find("origin") is not None:
        element.say("an <origin> inside <geometry> is not URDF, and is not read")
    shape = next((s for s in shapes if etree.QName(s).localname in SHAPES), shapes[0])
    kind = etree.QName(shape).localname
    if len(shapes) > 1:
        element.say(f"<{visual.tag}> has {len(shapes)} geometries: its first <{kind}> counts")
    if kind not in SHAPES:
        raise UnusableShapeError(f"geometry <{kind}> is not one of {', '.join(SHAPES)}")
    return Shape(_read_geometry(shape, kind, element), element.origin(visual), visual.get("name") or "")


def _read_geometry(shape: etree._Element, kind: str, element: Element) -> Geometry:
    if kind == "mesh":
        return _read_mesh(shape, element)
    if kind == "box":
        size = element.finite(shape, "size", 3, own=True)
        if (size < 0).any() or (size > 0).sum() < 2:  # a flat one is a surface
            raise EmptyShapeError(f"<box> of size {' '.join(f'{s:g}' for s in size)} has no extent")
        return Box(size)
    radius = float(element.finite(shape, "radius", 1)[0])
    length = 0.0 if kind == "sphere" else float(element.finite(shape, "length", 1)[0])
    if not (radius > 0 and length >= 0):
        raise EmptyShapeError(f"<{kind}> of radius {radius:g} and length {length:g} has no extent")
    if kind == "sphere":
        return Sphere(radius)
    if kind == "capsule" and length > 0:
        return Capsule(radius, length)
    return Cylinder(radius, length) if kind == "cylinder" else Sphere(radius)


def _read_mesh(mesh: etree._Element, element: Element) -> MeshFile:
    names = [element.text(mesh, name) for name in ("filename", "uri", "url")]
    filename = next((name for name in [*names, (mesh.text or "").strip()] if name and name.strip()), None)
    if filename is None:
        raise UnusableShapeError("its mesh has no filename")
    if names[0] is None:
        element.say("<mesh> has its file's name elsewhere than in filename: read")
    text = element.text(mesh, "scale")
    if text is None or not text.strip():
        return MeshFile(filename)
    words = len(text.replace(",", " ").split())
    what = f"scale={text[:60]!r} of <mesh>"
    scale = element.parsed(text, what, (1, 3, *range(4, 17)))
    if words > 3:
        element.say(f"{what} has {words} numbers: the first three count")
    scale = np.broadcast_to(scale[:3], 3)
    if not np.isfinite(scale).all():
        raise element.error(f"{what} is not finite", 'write scale="1 1 1"')
    if (scale == 0).any():
        raise element.error(
            f"mesh {filename!r} has scale={text!r}, which leaves nothing of it", 'write scale="1 1 1", or its true size'
        )
    return MeshFile(filename, scale)


def _summarise_missing(links: Sequence[etree._Element], shapeless: Collection[str], repairs: list[Repair]) -> None:
    empty = [link.get("name") for link in links if link.find("visual") is None and link.find("collision") is None]
    empty = [name for name in empty if name not in shapeless]
    if empty:
        repairs.append(Repair("links", f"without geometry: {', '.join(map(str, empty))}", note=True))
