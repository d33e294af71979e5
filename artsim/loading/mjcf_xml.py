"""An untrusted MJCF document, made safe for MuJoCo's parser: one text, without entities, that names no file.

Included files are put in place, what does not describe bodies, joints and shapes is left out, and what would expand
into very much is refused. MuJoCo opens no file: :class:`~artsim.loading.meshes.MeshReader` reads the meshes, and they
are handed over as vertices and triangles.
"""

import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

from lxml import etree

from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits
from artsim.loading.mjcf_includes import put_included
from artsim.loading.packages import AssetPaths
from artsim.loading.urdf_xml import safe_xml
from artsim.loading.xml_repair import readable_xml
from artsim.model.objects import Repair

_SECTIONS = ("compiler", "default", "asset", "worldbody", "tendon", "equality")
"""Sections that say what the object is; others are about simulators, cameras and control."""
_IN_BODY = ("body", "frame", "replicate", "joint", "freejoint", "geom", "site")
_KEPT = {
    "default": ("default", "mesh", "material", "geom", "joint", "site", "equality"),
    "asset": ("mesh", "hfield", "material"),
    "worldbody": _IN_BODY,
    "body": (*_IN_BODY, "inertial"),
    "frame": _IN_BODY,
    "replicate": _IN_BODY,
    "tendon": ("fixed",),
    "fixed": ("joint",),
    "equality": ("joint", "connect", "weld", "tendon"),
}
"""Elements that are read in each other; all others are left out."""
_ATTRIBUTES = {
    "material": ("name", "class", "rgba"),
    "site": ("name", "class", "pos", "quat", "axisangle", "xyaxes", "zaxis", "euler"),
    "fixed": ("name",),
}
"""Attributes that are read of elements of which the rest is about looks and forces."""
_SOFT = {
    "composite": "bodies that MuJoCo makes of it", "flexcomp": "a soft body", "flex": "a soft body",
    "skin": "a surface that bends over several bodies",
}  # fmt: skip
"""Elements that show something, or make bodies, which is not read."""
_OTHER_MODELS = ("attach", "model")
_COMPILER = (
    "angle", "autolimits", "eulerseq", "inertiafromgeom", "balanceinertia", "boundmass", "boundinertia",
    "inertiagrouprange", "fitaabb", "alignfree",
)  # fmt: skip
_OWN_SETTINGS = ("meshdir", "assetdir", "strippath", "settotalmass")
"""Settings of the compiler that the loader follows itself."""
_UNREAD = ("texture", "user", "fluidshape", "fluidcoef", "hfield")
_NUMBERS = (
    "pos", "quat", "axisangle", "xyaxes", "zaxis", "euler", "size", "fromto", "mass", "density", "diaginertia",
    "fullinertia", "axis", "range", "ref", "scale", "refpos", "refquat", "vertex", "coef", "polycoef",
    "offset", "damping", "frictionloss", "rgba",
)  # fmt: skip
"""Attributes in which MuJoCo takes ``nan`` for a value, or for none."""
_MESH_NAME = re.compile(r"[^\0]{1,1000}")
_MOST_SIDES = 100.0
"""Parameters of meshes that MuJoCo builds itself: they say into how many pieces a round one is cut."""
_NO_MESH = "0 0 0 1e-3 0 0 0 1e-3 0 0 0 1e-3"
"""Vertices that stand for a mesh that only a plugin makes."""


@dataclass
class SafeMjcf:
    """A document that MuJoCo may parse."""

    text: str
    meshes: dict[str, str]
    """Name of each mesh that is a file: the file's name, from the document's folder on."""
    unread: set[str] = field(default_factory=set)
    """Names of meshes that only a plugin makes: a speck stands for each."""
    left_out: tuple[str, ...] = ()
    """Elements that show something or make bodies, and are not read."""
    total_mass: str | None = None
    """What all bodies together weigh, kg, where the document says so."""
    contents: list[bytes] = field(default_factory=list)
    """Included files."""


def is_mjcf(data: bytes, where: Path) -> bool:
    """Whether the top element of a document is ``<mujoco>``."""
    return b"mujoco" in data and re.match(rb"\s*<mujoco[\s/>]", readable_xml(data, where)[0]) is not None


def safe_mjcf(data: bytes, file: Path, paths: AssetPaths, limits: LoadLimits, repairs: list[Repair]) -> SafeMjcf:
    """Make a document safe.

    Raises AssetError when it is not well formed, names a file outside the allowed folders, or is over a limit.
    """
    data, found = readable_xml(data, file)
    repairs += found
    root = safe_xml(data, file)
    contents = put_included(root, file, paths, limits.max_urdf_bytes)
    settings = _compiler_settings(root)
    without, soft = _strip_sections(root, file)
    if without:
        repairs.append(Repair("file", f"left out, which says nothing of the object: {', '.join(without)}", note=True))
    repairs += [Repair(f"<{tag}>", f"left out: {_SOFT[tag]} is not read") for tag in soft]
    _join_sections(root)
    _take_couplings(root, repairs)
    _check_size(root, file, limits)
    meshes, unread = _take_meshes(root, settings, file)
    _name_height_fields(root)
    if _take_percent_signs(root):
        repairs.append(Repair("file", "each % in a name is read as _"))
        meshes, unread = {_plain(name): of for name, of in meshes.items()}, {_plain(name) for name in unread}
    text = etree.tostring(root, encoding="unicode")
    left_out = tuple(f"<{tag}>" for tag in soft)
    return SafeMjcf(text, meshes, unread, left_out, settings.get("settotalmass"), contents)


def _take_percent_signs(root: etree._Element) -> bool:
    """Replace the percent signs of all values; False where there are none.

    MuJoCo prints what it refuses with names as formats of C: ``%n`` ends the process, ``%s`` reads any memory.
    """
    found = False
    for element in root.iter(etree.Element):
        for key, value in element.attrib.items():
            if "%" in value:
                element.set(key, _plain(str(value)))
                found = True
    return found


def _plain(name: str) -> str:
    return name.replace("%", "_")


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


def _strip_sections(root: etree._Element, file: Path) -> tuple[list[str], list[str]]:
    """Leave out what is not read; returns what says nothing of the object, and the tags of what shows something."""
    without: dict[str, None] = {}
    soft: dict[str, None] = {}
    for section in list(root):
        if section.tag not in _SECTIONS:
            soft |= dict.fromkeys(str(e.tag) for e in section.iter(*_SOFT))
            root.remove(section)
        elif section.tag != "compiler":
            _strip(section, without, soft, file)
    return [*without], [*soft]


def _strip(element: etree._Element, without: dict[str, None], soft: dict[str, None], file: Path) -> None:
    kept = _KEPT.get(str(element.tag), ())
    for child in list(element):
        tag = str(child.tag)
        if tag in _OTHER_MODELS:
            raise AssetError(
                f"<{tag}> is not read",
                f"{file}: line {child.sourceline}",
                "let MuJoCo write it into one file: mujoco.MjSpec.from_file(path).to_xml() after compile()",
            )
        if tag not in kept:
            element.remove(child)
            (soft if tag in _SOFT else without)[tag if tag in _SOFT else f"<{tag}>"] = None
            continue
        read = _ATTRIBUTES.get(tag)
        for key in _NUMBERS:
            if "nan" in str(child.get(key, "")).lower():
                raise AssetError(
                    f"{key} of <{tag}> is not a number",
                    f"{file}: line {child.sourceline}",
                    "write numbers, or leave it out",
                )
        for key in list(child.attrib):
            if (key in _UNREAD and (key != "hfield" or child.get("type") != "hfield")) or (read and key not in read):
                del child.attrib[key]
        if tag == "mesh" and child.find("plugin") is not None:
            child.attrib.pop("file", None)
        _strip(child, without, soft, file)


def _join_sections(root: etree._Element) -> None:
    """One section of each kind, but for defaults, whose order among each other counts: MuJoCo joins them, too."""
    first: dict[str, etree._Element] = {}
    for section in list(root):
        tag = str(section.tag)
        if tag in ("default", "compiler"):
            continue
        if tag == "worldbody" and section.attrib:
            continue
        if tag not in first:
            first[tag] = section
            continue
        first[tag].extend(list(section))
        root.remove(section)


def _take_couplings(root: etree._Element, repairs: list[Repair]) -> None:
    """Leave out sites that close no chain, and couplings of tendons that run through space."""
    fixed = {tendon.get("name") for tendon in root.iterfind("tendon/fixed")}
    for equality in list(root.iterfind("equality/tendon")):
        ends = [equality.get(key) for key in ("tendon1", "tendon2") if equality.get(key) is not None]
        if not fixed.issuperset(ends):
            repairs.append(Repair(f"tendon {ends[0]!r}", "couples joints through space: the coupling is left out"))
            parent = equality.getparent()
            assert parent is not None
            parent.remove(equality)
    used = {e.get(key) for e in root.iterfind("equality/*") for key in ("site1", "site2")}
    for site in list(root.iter("site")):
        parent = site.getparent()
        assert parent is not None
        if parent.tag != "default" and site.get("name") not in used:
            parent.remove(site)


def _check_size(root: etree._Element, file: Path, limits: LoadLimits) -> None:
    """Refuse documents that expand into too many bodies or other elements."""
    bounds = {"body": limits.max_links}
    totals: Counter[str] = Counter()
    for element, copies in _counted(root, file):
        tag = str(element.tag)
        totals[tag] += copies
        # Even without a body or shape inside, every copy costs time.
        bound = bounds.get(tag, limits.max_shapes)
        if max(totals[tag], copies) > bound:
            raise AssetError(
                f"it has more than {bound} <{tag}> elements, copies included",
                file,
                "raise LoadLimits.max_links and max_shapes if you trust the file",
            )


def _counted(root: etree._Element, file: Path) -> Iterator[tuple[etree._Element, int]]:
    """Every element below the top one, and how many copies of it there will be."""
    stack = [(section, 1) for section in root]
    while stack:
        element, copies = stack.pop()
        if element.tag == "replicate":
            try:
                copies *= max(int(element.get("count") or 1), 1)
            except ValueError as error:
                raise AssetError(
                    f"count={element.get('count')!r} of <replicate> is no number", file, "write a whole number"
                ) from error
        yield element, copies
        stack += [(child, copies) for child in element]


def _take_meshes(root: etree._Element, settings: dict[str, str], file: Path) -> tuple[dict[str, str], set[str]]:
    """Name of each mesh that is a file, and that file, which the document names no more; and what is no file's."""
    folder = settings.get("meshdir") or settings.get("assetdir") or ""
    strips = settings.get("strippath") == "true"
    meshes: dict[str, str] = {}
    unread: set[str] = set()
    for mesh in root.iterfind("asset/mesh"):
        mesh.attrib.pop("content_type", None)
        name = mesh.attrib.pop("file", None)
        if name is None:
            _check_built(mesh, file)
            if not (mesh.get("vertex") or mesh.get("builtin")):
                mesh.set("vertex", _NO_MESH)
                unread.add(str(mesh.get("name")))
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
    for element in root.iter("mesh"):
        element.attrib.pop("file", None)  # in defaults, too
    return meshes, unread


def _check_built(mesh: etree._Element, file: Path) -> None:
    """Refuse a mesh that MuJoCo would build out of very many pieces."""
    try:
        sides = [abs(float(word)) for word in (mesh.get("params") or "").split()]
    except ValueError as error:
        raise AssetError("params of a mesh are not numbers", f"{file}: <mesh>", "write numbers") from error
    if not all(side <= _MOST_SIDES for side in sides):
        raise AssetError(
            f"a mesh is to be built of over {_MOST_SIDES:g} sides",
            f"{file}: <mesh>",
            "write less, or save it as a file",
        )


def _name_height_fields(root: etree._Element) -> None:
    """Height fields without their files: flat, and called as MuJoCo calls them."""
    for field_ in root.iterfind("asset/hfield"):
        if not field_.get("name"):
            field_.set("name", PurePosixPath(str(field_.get("file") or "").replace("\\", "/")).stem)
        for key in ("file", "content_type", "elevation"):
            field_.attrib.pop(key, None)
        field_.set("nrow", "2")
        field_.set("ncol", "2")
