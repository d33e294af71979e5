"""An untrusted MJCF document, made safe for MuJoCo's parser: one text, without entities, that names no file.

Included files are put in place, what does not describe bodies, joints and shapes is left out, and what would expand
into very much is refused. MuJoCo opens no file: :class:`~artsim.loading.meshes.MeshReader` reads the meshes, and they
are handed over as vertices and triangles.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from lxml import etree

from artsim.common.files import read_bounded
from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits
from artsim.loading.urdf_xml import safe_xml
from artsim.loading.xml_repair import readable_xml
from artsim.model.objects import Repair

_MAX_INCLUDES = 100
_SECTIONS = ("compiler", "default", "asset", "worldbody", "equality")
"""Sections that say what the object is; others are about simulators, cameras and control."""
_KEPT = {
    "default": ("default", "mesh", "geom", "joint", "equality"),
    "asset": ("mesh", "hfield"),
    "worldbody": ("body", "frame", "replicate", "inertial", "joint", "freejoint", "geom"),
    "body": ("body", "frame", "replicate", "inertial", "joint", "freejoint", "geom"),
    "frame": ("body", "frame", "replicate", "joint", "freejoint", "geom"),
    "replicate": ("body", "frame", "replicate", "geom"),
    "equality": ("joint", "connect", "weld"),
}
"""Elements that are read in each other; all others are left out."""
_GROWING = ("composite", "flexcomp", "attach", "model", "flex", "skin")
"""Elements that make bodies or shapes of their own, or read another model."""
_COMPILER = (
    "angle", "autolimits", "eulerseq", "inertiafromgeom", "balanceinertia", "boundmass", "boundinertia",
    "inertiagrouprange",
)  # fmt: skip
_OWN_SETTINGS = ("meshdir", "assetdir", "strippath", "settotalmass")
"""Settings of the compiler that the loader follows itself."""
_UNREAD = ("material", "texture", "user", "fluidshape", "fluidcoef", "hfield")
_MESH_NAME = re.compile(r"[^\0]{1,1000}")


@dataclass
class SafeMjcf:
    """A document that MuJoCo may parse.

    Attributes
    ----------
    text : str
    meshes : dict
        Name of each mesh that is a file: the file's name, from the document's folder on.
    total_mass : str or None
        What all bodies together weigh, kg, where the document says so.
    contents : list of bytes
        Included files.
    """

    text: str
    meshes: dict[str, str]
    total_mass: str | None = None
    contents: list[bytes] = field(default_factory=list)


def is_mjcf(data: bytes, where: Path) -> bool:
    """Whether the top element of a document is ``<mujoco>``."""
    return b"mujoco" in data and re.match(rb"\s*<mujoco[\s/>]", readable_xml(data, where)[0]) is not None


def safe_mjcf(data: bytes, file: Path, limits: LoadLimits, repairs: list[Repair]) -> SafeMjcf:
    """Make a document safe.

    Parameters
    ----------
    data : bytes
        Content of the file.
    file : Path
        Its path: included files lie in its folder.
    limits : LoadLimits
    repairs : list of Repair
        Added to.

    Raises
    ------
    AssetError
        When it is not well formed, names a file outside its folder, or is over a limit.
    """
    data, found = readable_xml(data, file)
    repairs += found
    root = safe_xml(data, file)
    contents: list[bytes] = []
    _include(root, file, limits, contents, {file.resolve()})
    settings = _compiler_settings(root)
    left_out: dict[str, None] = {}
    for section in list(root):
        if section.tag not in _SECTIONS:
            root.remove(section)
        elif section.tag != "compiler":
            _strip(section, left_out, file)
    if left_out:
        repairs.append(Repair("file", f"left out, which says nothing of the object: {', '.join(left_out)}", note=True))
    _check_size(root, file, limits)
    meshes = _take_meshes(root, settings, file)
    text = etree.tostring(root, encoding="unicode")
    return SafeMjcf(text, meshes, settings.get("settotalmass"), contents)


def _include(root: etree._Element, file: Path, limits: LoadLimits, contents: list[bytes], seen: set[Path]) -> None:
    """Put the elements of included files in place of each ``<include>``; each file once, as MuJoCo has it."""
    room = limits.max_urdf_bytes
    while (include := next(root.iter("include"), None)) is not None:
        name = include.get("file") or ""
        path = _inside(name, file)
        if path.resolve() in seen or len(contents) >= _MAX_INCLUDES:
            raise AssetError(
                f"includes {name[:100]!r} twice, or over {_MAX_INCLUDES} files",
                file,
                "include each file once, in one place",
            )
        seen.add(path.resolve())
        data = read_bounded(path, room, "included file", inside=file.parent)
        contents.append(data)
        room -= len(data)
        parent = include.getparent()
        assert parent is not None  # the top element is <mujoco>
        at = parent.index(include)
        parent.remove(include)
        for i, element in enumerate(list(safe_xml(readable_xml(data, path)[0], path))):
            parent.insert(at + i, element)


def _inside(name: str, file: Path) -> Path:
    """A file of the document's folder by its name."""
    path = file.parent / name.replace("\\", "/")
    try:
        inside = bool(name) and path.resolve().is_relative_to(file.parent.resolve())
    except (OSError, ValueError, RuntimeError):  # a name that no file can have
        inside = False
    if not inside:
        raise AssetError(f"includes {name[:100]!r}, which lies outside its folder", file, "move the file inside")
    return path


def _compiler_settings(root: etree._Element) -> dict[str, str]:
    """Keep the settings of the compiler that are about the object; returns those that are not MuJoCo's to follow."""
    own: dict[str, str] = {}
    for compiler in root.findall("compiler"):
        own |= {key: str(compiler.get(key)) for key in _OWN_SETTINGS if compiler.get(key)}
        for key in list(compiler.attrib):
            if key not in _COMPILER:
                del compiler.attrib[key]
        for child in list(compiler):
            compiler.remove(child)
    # Bodies stay apart and shapes that nothing collides with stay there; one thread does.
    fixed = {"fusestatic": "false", "discardvisual": "false", "usethread": "false"}
    root.append(etree.Element("compiler", fixed))
    return own


def _strip(element: etree._Element, left_out: dict[str, None], file: Path) -> None:
    """Leave out elements and attributes that are not read."""
    kept = _KEPT.get(str(element.tag), ())
    for child in list(element):
        if child.tag in _GROWING:
            raise AssetError(
                f"<{child.tag}> is not read",
                f"{file}: line {child.sourceline}",
                "write the bodies and shapes that it stands for, or remove it",
            )
        if child.tag not in kept:
            element.remove(child)
            left_out[f"<{child.tag}>"] = None
            continue
        for key in _UNREAD:
            if key != "hfield" or child.get("type") != "hfield":
                child.attrib.pop(key, None)
        if child.tag == "hfield":
            for key in ("file", "content_type", "elevation"):
                child.attrib.pop(key, None)
            child.set("nrow", "2")
            child.set("ncol", "2")
        _strip(child, left_out, file)


def _check_size(root: etree._Element, file: Path, limits: LoadLimits) -> None:
    """Refuse documents that expand into too many bodies or shapes."""
    totals = {"body": 0, "geom": 0}
    bounds = {"body": limits.max_links, "geom": limits.max_shapes}
    stack = [(section, 1) for section in root.findall("worldbody")]
    while stack:
        element, copies = stack.pop()
        if element.tag == "replicate":
            try:
                copies *= max(int(element.get("count") or 1), 1)
            except ValueError as error:
                raise AssetError(
                    f"count={element.get('count')!r} of <replicate> is no number", file, "write a whole number"
                ) from error
        if element.tag in totals:
            totals[element.tag] += copies
        stack += [(child, copies) for child in element]
        # Even without a body or shape inside, every copy costs time.
        over = next((tag for tag in totals if max(totals[tag], copies) > bounds[tag]), None)
        if over is not None:
            raise AssetError(
                f"it has more than {bounds[over]} <{over}> elements, copies included",
                file,
                "raise LoadLimits.max_links and max_shapes if you trust the file",
            )
    if sum(1 for _ in root.iter("mesh")) > limits.max_shapes:
        raise AssetError(f"it has more than {limits.max_shapes} meshes", file, "raise LoadLimits.max_shapes")


def _take_meshes(root: etree._Element, settings: dict[str, str], file: Path) -> dict[str, str]:
    """Name of each mesh that is a file, and that file; the document names it no more."""
    folder = settings.get("meshdir") or settings.get("assetdir") or ""
    strips = settings.get("strippath") == "true"
    meshes: dict[str, str] = {}
    for mesh in root.iterfind("asset/mesh"):
        if mesh.get("builtin"):
            raise AssetError("a mesh that MuJoCo builds itself is not read", f"{file}: <mesh>", "save it as a file")
        mesh.attrib.pop("content_type", None)
        name = mesh.attrib.pop("file", None)
        if name is None:
            continue
        name = str(name).replace("\\", "/")
        if not _MESH_NAME.fullmatch(name):
            raise AssetError("a mesh has no proper file name", f"{file}: <mesh>", "name its file")
        if strips:
            name = PurePosixPath(name).name
        own = mesh.get("name") or PurePosixPath(name).stem
        mesh.set("name", own)
        if own in meshes:
            raise AssetError(f"two meshes are called {own!r}", file, "give each its own name")
        meshes[own] = str(PurePosixPath(folder.replace("\\", "/")) / name)
    for element in root.iter("hfield", "mesh"):
        element.attrib.pop("file", None)  # in defaults, too
    return meshes
