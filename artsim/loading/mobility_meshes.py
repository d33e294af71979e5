"""Which meshes the parts of a PartNet-Mobility annotation have.

They stand in one of these, whichever comes first:

1. a glTF file with all of them beside the annotation: ``model.glb``, ``model.gltf``, one of the annotation's name, or
   the only one. A node belongs to the part whose number it has as ``partnet_id`` in its ``extras``, or at the beginning
   or the end of its name (``7_handle``, ``handle-7``), or whose name it has; or to the body ``link_7``. What hangs on a
   node does, too;
2. ``result.json``, the tree of PartNet, which names the meshes of each part (``objs``);
3. files of their own, named by the number of the part (``7.obj``, ``handle-7.glb``), in one of a few folders;
4. ``mobility.urdf``, whose visuals are named by the number of their part.

Version 2 has meshes of their own and looks at 2 first.
"""

import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from artsim.common.files import parse_json, read_bounded
from artsim.errors import AssetError
from artsim.loading.mesh_files import FORMATS
from artsim.loading.meshes import MeshReader
from artsim.loading.packages import is_file
from artsim.loading.urdf_document import Geometry, InlineMesh, MeshFile
from artsim.loading.urdf_xml import safe_xml
from artsim.model.objects import Repair

_MAX_BYTES = 8_000_000
"""Of ``result.json``, and of a URDF file that is asked for names alone: real ones take some hundred thousand."""
_FOLDERS = ("textured_objs", "objs", "meshes", "gltf", "")
_MAX_LISTED = 20_000
"""Files of a folder that are looked at."""
_SHOWN = 5


@dataclass(frozen=True)
class PartMeshes:
    """What is known of the meshes."""

    of_part: Mapping[int, list[Geometry]]
    where: str
    """Where they were looked for, for messages."""
    of_link: Mapping[int, list[Geometry]] = field(default_factory=dict)
    """By the number of a part, and by that of a body."""
    contents: list[bytes] = field(default_factory=list)
    """Files that tell which mesh is whose."""


def part_meshes(
    document: Any,
    file: Path,
    names: Mapping[int, str],
    links: Collection[int],
    reader: MeshReader,
    repairs: list[Repair],
) -> PartMeshes:
    """The meshes of the parts of an annotation.

    Parameters
    ----------
    document : list or dict
        The annotation; version 3 is a dict.
    file : Path
    names : mapping of int to str
        Each part's name.
    links : collection of int
        Numbers of the bodies.

    Raises
    ------
    AssetError
        When there are none, or a file that tells of them cannot be read.
    """
    finders: list[Callable[[], PartMeshes | None]] = [
        lambda: _of_result(file),
        lambda: _of_scene(file, names, links, reader, repairs),
    ]
    if isinstance(document, dict):
        finders.reverse()
    finders += [lambda: _of_files(file, names), lambda: _of_urdf(file)]
    for find in finders:
        found = find()
        if found is None:
            continue
        count = sum(len(meshes) for number, meshes in found.of_part.items() if number in names)
        if count > reader.limits.max_shapes:
            raise AssetError(
                f"{count} meshes are over the limit of {reader.limits.max_shapes}",
                file,
                "raise it with artsim.load(..., limits=LoadLimits(max_shapes=...)) if you trust the file",
            )
        return found
    raise AssetError(
        "it names parts, and no file says which meshes they have",
        file,
        f"put a glTF file beside it whose nodes begin with the number of their part, PartNet's result.json, or meshes "
        f"that are named by the number of their part (textured_objs/{next(iter(names), 0)}.obj)",
    )


# --- one glTF file ---


def _of_scene(
    file: Path, names: Mapping[int, str], links: Collection[int], reader: MeshReader, repairs: list[Repair]
) -> PartMeshes | None:
    scene = _scene_beside(file, names)
    if scene is None:
        return None
    owner = _Owner(names, links)
    surfaces, strays = reader.scene(scene.name, owner)
    if not surfaces:
        raise AssetError(
            f"no node of {scene.name} belongs to a part: {', '.join(strays[:_SHOWN])}",
            file,
            f'begin the name of each node with the number of its part, such as "{next(iter(names), 0)}_..."',
        )
    if strays:
        more = f" and {len(strays) - _SHOWN} more" if len(strays) > _SHOWN else ""
        repairs.append(Repair(scene.name, f"nodes that belong to no part left out: {', '.join(strays[:_SHOWN])}{more}"))
    found: dict[str, dict[int, list[Geometry]]] = {"part": {}, "link": {}}
    for (kind, number), surface in surfaces.items():
        mesh = InlineMesh(f"{kind} {number} of {scene.name}", surface.vertices, surface.faces)
        found[kind][number] = [mesh]
    return PartMeshes(found["part"], f"in {scene.name}", found["link"])


def _scene_beside(file: Path, names: Collection[int]) -> Path | None:
    """The glTF file with all meshes, if there is one.

    Raises
    ------
    AssetError
        When there are several to choose from.
    """
    for stem in ("model", file.stem):
        for suffix in (".glb", ".gltf"):
            if (file.parent / f"{stem}{suffix}").is_file():
                return file.parent / f"{stem}{suffix}"
    found = [path for path in _listed(file.parent) if path.suffix.lower() in (".glb", ".gltf")]
    found = [path for path in found if _number(path.stem) not in names]
    if len(found) > 1:
        raise AssetError(f"{len(found)} glTF files stand beside it", file, "call the one with all parts model.glb")
    return found[0] if found else None


class _Owner:
    """Whose a node of a glTF file is, by what it is called."""

    def __init__(self, names: Mapping[int, str], links: Collection[int]):
        self._parts, self._links = set(names), set(links)
        called = list(names.values())
        self._by_name = {name: number for number, name in names.items() if called.count(name) == 1}

    def __call__(self, name: str, extras: Mapping[str, Any]) -> tuple[str, int] | None:
        own = extras.get("partnet_id")
        if isinstance(own, int) and own in self._parts:
            return "part", own
        name = re.sub(r"\.\d{3}$", "", name)  # Blender's way to tell copies apart
        number = _number(name)
        if number is not None and number in self._parts:
            return "part", number
        found = re.fullmatch(r"link_(\d{1,18})", name)
        if found is not None and int(found[1]) in self._links:
            return "link", int(found[1])
        return ("part", self._by_name[name]) if name in self._by_name else None


def _number(name: str) -> int | None:
    """The number that begins or ends a name."""
    found = re.fullmatch(r"(\d{1,18})(?:[_.\- ].*)?|.*-(\d{1,18})", name, re.DOTALL)
    return None if found is None else int(found[1] or found[2])


# --- meshes of their own ---


def _of_result(file: Path) -> PartMeshes | None:
    """By PartNet's tree: what a part shows is what all below it show."""
    path = file.parent / "result.json"
    if not path.is_file():
        return None
    data = read_bounded(path, _MAX_BYTES, path.name, inside=file.parent)
    try:
        tree = parse_json(data)
    except ValueError as error:
        raise AssetError(f"it is not JSON ({error})", path, "restore the file, or remove it") from error
    meshes: dict[int, dict[str, None]] = {}
    above: dict[int, list[int]] = {}
    waiting: list[tuple[Any, list[int]]] = [(node, []) for node in (tree if isinstance(tree, list) else [tree])]
    while waiting:
        node, parents = waiting.pop()
        if not isinstance(node, dict) or not isinstance(node.get("id"), int):
            raise AssetError("a node of it has no 'id'", path, "restore the file, or remove it")
        line = [*parents, node["id"]]
        above[node["id"]] = line
        objs, children = node.get("objs") or [], node.get("children") or []
        if not isinstance(objs, list) or not isinstance(children, list):
            raise AssetError(f"node {node['id']} has 'objs' or 'children' that are no list", path, "restore the file")
        for number in line:
            meshes.setdefault(number, {}).update(dict.fromkeys(map(str, objs)))
        waiting += [(child, line) for child in reversed(children)]
    folder = next((name for name in _FOLDERS if name and (file.parent / name).is_dir()), "textured_objs")
    found = {number: [_mesh(folder, stem, file.parent) for stem in stems] for number, stems in meshes.items() if stems}
    return PartMeshes(found, "in result.json", contents=[data])


def _mesh(folder: str, stem: str, root: Path) -> Geometry:
    """The mesh of a name without an ending, of whatever format there is; the reader keeps it inside."""
    names = (stem, *(f"{stem}{suffix}" for suffix in FORMATS)) if "." in stem else [f"{stem}{s}" for s in FORMATS]
    name = next((f"{folder}/{name}" for name in names if is_file(root / folder / name)), f"{folder}/{stem}.obj")
    return MeshFile(name)


def _of_files(file: Path, names: Mapping[int, str]) -> PartMeshes | None:
    """By the numbers in names of files."""
    for folder in _FOLDERS:
        found: dict[int, list[Geometry]] = {}
        for path in _listed(file.parent / folder):
            own = _number(path.stem)
            # PartNet's own original-7.obj is no part 7: without result.json it is anyone's.
            ours = own in names and not path.stem.startswith(("original-", "new-"))
            if own is not None and ours and path.suffix.lower() in FORMATS:
                found.setdefault(own, []).append(MeshFile(path.relative_to(file.parent).as_posix()))
        if found:
            return PartMeshes(found, f"in {folder or 'the folder'}")
    return None


def _of_urdf(file: Path) -> PartMeshes | None:
    """By the names of a URDF file's visuals: ``handle-7``."""
    path = file.parent / "mobility.urdf"
    if not path.is_file():
        return None
    data = read_bounded(path, _MAX_BYTES, path.name, inside=file.parent)
    found: dict[int, list[Geometry]] = {}
    for visual in safe_xml(data, path).iter("visual"):
        number = re.fullmatch(r".*-(\d{1,18})", visual.get("name") or "", re.DOTALL)
        mesh = visual.find("geometry/mesh")
        if number is not None and mesh is not None and mesh.get("filename"):
            found.setdefault(int(number[1]), []).append(MeshFile(str(mesh.get("filename"))))
    return PartMeshes(found, f"in {path.name}", contents=[data]) if found else None


def _listed(folder: Path) -> list[Path]:
    """Files of a folder, in order; none where there is no folder.

    Raises
    ------
    AssetError
        When there are too many.
    """
    if not folder.is_dir():
        return []
    paths: list[Path] = []
    for path in folder.iterdir():
        if len(paths) >= _MAX_LISTED:
            raise AssetError(f"the folder has more than {_MAX_LISTED} files", folder, "keep each object in its own")
        paths.append(path)
    return sorted(path for path in paths if path.is_file())
