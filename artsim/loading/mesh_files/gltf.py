"""glTF 2.0: a scene in JSON, with numbers in buffers; ``.glb`` holds both in one file.

Coordinates are taken as they stand, as SAPIEN and every simulator does for a mesh that a URDF file names: glTF's own
frame has y up, but robots' files are exported with their link's frame in it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Iterator, Mapping
from typing import Any, TypeVar

import numpy as np

from artsim.common.files import parse_json
from artsim.common.products import norm
from artsim.loading.mesh_files.gltf_buffers import Buffers, Items, integer
from artsim.loading.mesh_files.polygons import fans, strips
from artsim.loading.mesh_files.surface import (
    Array,
    Bounds,
    Draft,
    Indices,
    Surface,
    UnusableMeshError,
    compose_affine,
    join_pieces,
    mirrors,
    quote_name,
    transform_affine,
)
from artsim.model.transforms import compose_transform, rotation_of_quaternion

_READ = ("KHR_mesh_quantization", "EXT_mesh_gpu_instancing")
_HARMLESS = ("KHR_materials_", "KHR_texture_", "EXT_texture_", "MSFT_texture_", "KHR_lights_", "EXT_lights_", "KHR_xmp")
"""Extensions that say nothing about where the surface is, by how their names begin."""

_NOT_READ = (0, 1, 2, 3)
"""Modes of primitives that are points, or lines of three kinds."""
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_MAX_DEPTH = 500

Key = TypeVar("Key", bound=Hashable)


def read_gltf(data: bytes, bounds: Bounds, neighbour: Callable[[str], bytes]) -> Surface:
    """The surface of the scene that a glTF file shows; raises as ``read_mesh``."""
    draft = Draft()
    for _, piece in _scene(data, bounds, neighbour, draft).pieces():
        draft.add(*piece)
    return draft.surface()


Owner = Callable[[str, Mapping[str, Any]], Key | None]
"""Says whose a node is by its name and ``extras``; None where it does not tell."""


def read_gltf_parts(
    data: bytes, bounds: Bounds, neighbour: Callable[[str], bytes], owner: Owner[Key]
) -> tuple[dict[Key, Surface], list[str], tuple[str, ...]]:
    """The surface of each of the parts that the nodes of a glTF file belong to.

    Parameters are those of ``read_mesh``. Where ``owner`` does not tell of a node, what carries the node counts.

    Returns
    -------
    surfaces : dict
        By what ``owner`` gives.
    strays : list of str
        Names of nodes that show something and belong to no part.
    notes : tuple of str
        What was left out, assumed or mended.
    """
    whole = Draft()
    scene = _scene(data, bounds, neighbour, whole)
    drafts: dict[Key, Draft] = {}
    strays: dict[str, None] = {}
    for line, piece in scene.pieces():
        told = (owner(str(node.value.get("name", "")), _extras(node)) for node in line)
        own = next((key for key in told if key is not None), None)
        if own is None:
            strays[quote_name(line[0].value.get("name", "without a name"))] = None
            continue
        drafts.setdefault(own, Draft()).add(*piece)
        whole.add(*piece)
    surfaces = {key: draft.surface() for key, draft in drafts.items()}
    notes = whole.surface().notes if surfaces else tuple(whole.notes)
    return surfaces, list(strays), notes


def _extras(node: Items) -> Mapping[str, Any]:
    extras = node.value.get("extras")  # anything, by glTF
    return extras if isinstance(extras, dict) else {}


def _scene(data: bytes, bounds: Bounds, neighbour: Callable[[str], bytes], draft: Draft) -> _Scene:
    """The scene of a file."""
    text, chunk = _chunks(data)
    try:
        root = parse_json(text)
    except ValueError as error:
        raise UnusableMeshError(f"its JSON cannot be read ({error})") from error
    if not isinstance(root, dict):
        raise UnusableMeshError("its JSON is no glTF")
    document = Items(root)
    _check_version(document)
    return _Scene(document, Buffers(document, chunk, neighbour, bounds), bounds, draft)


def _chunks(data: bytes) -> tuple[bytes, bytes | None]:
    """JSON and bytes of a binary file, or all of a text file as JSON."""
    if not data.startswith(b"glTF"):
        return data, None
    version, length = (int.from_bytes(data[at : at + 4], "little") for at in (4, 8))
    if version != 2:
        raise UnusableMeshError(f"is glTF {version}, not 2")
    if length > len(data):
        raise UnusableMeshError(f"declares {length} bytes, but ends after {len(data)}")
    text, chunk, at = None, None, 12
    while at + 8 <= length:
        size, kind = int.from_bytes(data[at : at + 4], "little"), data[at + 4 : at + 8]
        if at + 8 + size > length:
            raise UnusableMeshError("ends before a chunk that it declares")
        content = data[at + 8 : at + 8 + size]
        if kind == b"JSON" and text is None:
            text = content
        elif kind == b"BIN\0" and chunk is None:
            chunk = content
        at += 8 + size
    if text is None:
        raise UnusableMeshError("holds no JSON")
    return text.rstrip(b"\0"), chunk


def _check_version(document: Items) -> None:
    version = str(document.object("asset").value.get("version"))
    if version.split(".")[0] != "2":
        raise UnusableMeshError(f"is glTF {quote_name(version)}, not 2")
    required = document.value.get("extensionsRequired", [])
    for name in required if isinstance(required, list) else [required]:
        if name not in _READ and not str(name).startswith(_HARMLESS):
            raise UnusableMeshError(
                f"needs the glTF extension {quote_name(name)}, which is not read: export it without"
            )


class _Scene:
    """The nodes of a file, and the meshes that they show."""

    def __init__(self, document: Items, buffers: Buffers, bounds: Bounds, draft: Draft):
        self._document, self._buffers, self._bounds, self._draft = document, buffers, bounds, draft
        self._meshes: dict[tuple[int, tuple[float, ...]], tuple[Array, Indices]] = {}
        self._nodes = document.list("nodes")
        self._num_primitives = 0

    def pieces(self) -> Iterator[tuple[list[Items], tuple[Array, Indices]]]:
        """Count what the scene shows, then read it: each piece with its node, and the nodes that carry that."""
        shown = self._shown()
        copies = [self._placements(line[0], T) for line, T in shown]
        self._bounds.check_pieces(sum(map(len, copies)))
        self._draft.declared = sum(
            self._declared(line[0]) * len(places) for (line, _), places in zip(shown, copies, strict=True)
        )
        self._bounds.check(self._draft.declared, "triangles")
        meshes = [self._mesh(line[0]) for line, _ in shown]
        sizes = [len(vertices) * len(places) for (vertices, _), places in zip(meshes, copies, strict=True)]
        self._bounds.check(sum(sizes), "vertices")
        self._tell_unseen([line[0] for line, _ in shown])
        for (line, _), (vertices, faces), places in zip(shown, meshes, copies, strict=True):
            self._draft.accounted += len(faces) * len(places)
            for T in places:
                piece = transform_affine(T, vertices), faces[:, ::-1] if mirrors(T) else faces
                yield line, piece

    def _shown(self) -> list[tuple[list[Items], Array]]:
        """Each node with a mesh in the scene, with those that carry it, and the transform to the file's frame."""
        waiting: list[tuple[int, Array, list[Items]]] = [(number, np.eye(4), []) for number in self._roots()]
        visited: set[int] = set()
        shown = []
        while waiting:
            number, T, above = waiting.pop()
            if number in visited or len(above) > _MAX_DEPTH:
                raise UnusableMeshError(f"node {number} has two parents, or is nested too deeply")
            visited.add(number)
            line = [self._nodes[number], *above]
            T = compose_affine(T, _transform(line[0]))
            if "mesh" in line[0].value:
                shown.append((line, T))
                self._bounds.check_pieces(len(shown))
            children = [integer(child, len(self._nodes)) for child in line[0].array("children")]
            waiting += [(child, T, line) for child in reversed(children)]
        return shown

    def _roots(self) -> list[int]:
        scenes = self._document.list("scenes")
        if scenes:
            if len(scenes) > 1 and "scene" not in self._document.value:
                self._draft.note(f"does not say which of its {len(scenes)} scenes it shows: the first is taken")
            scene = scenes[integer(self._document.value.get("scene", 0), len(scenes))]
            roots = [integer(number, len(self._nodes)) for number in scene.array("nodes")]
        else:
            children = {integer(c, len(self._nodes)) for node in self._nodes for c in node.array("children")}
            roots = [number for number in range(len(self._nodes)) if number not in children]
            self._draft.note("has no scene: all of its nodes are shown")
        return roots[::-1]

    def _placements(self, node: Items, T: Array) -> list[Array]:
        """Transforms of all copies of a node's mesh."""
        instancing = node.object("extensions").object("EXT_mesh_gpu_instancing").object("attributes")
        if not instancing.value:
            return [T]
        columns = {}
        for name, width in (("TRANSLATION", 3), ("ROTATION", 4), ("SCALE", 3)):
            if name in instancing.value:
                columns[name] = self._buffers.values(instancing.value[name], width)
        counts = {len(column) for column in columns.values()}
        if len(counts) != 1:
            raise UnusableMeshError("EXT_mesh_gpu_instancing does not say how many copies it makes")
        count = counts.pop()
        self._bounds.check_pieces(count)
        moves = columns.get("TRANSLATION", np.zeros((count, 3)))
        turns = columns.get("ROTATION", np.tile([0.0, 0.0, 0.0, 1.0], (count, 1)))
        scales = columns.get("SCALE", np.ones((count, 3)))
        return [compose_affine(T, _compose(*parts)) for parts in zip(moves, turns, scales, strict=True)]

    def _declared(self, node: Items) -> int:
        """Triangles that a node's mesh declares, by the sizes of its accessors alone."""
        count = 0
        for primitive in self._primitives(node):
            mode = integer(primitive.value.get("mode", _TRIANGLES), 2**31)
            source = primitive.value.get("indices", primitive.object("attributes").value.get("POSITION"))
            corners = 0 if source is None else self._buffers.count(source)
            if mode == _TRIANGLES:
                count += corners // 3
            elif mode in (_STRIP, _FAN):
                count += max(corners - 2, 0)
        return count

    def _primitives(self, node: Items) -> list[Items]:
        meshes = self._document.list("meshes")
        primitives = meshes[integer(node.value["mesh"], len(meshes))].list("primitives")
        self._num_primitives += len(primitives)
        self._bounds.check_pieces(self._num_primitives)
        return primitives

    def _mesh(self, node: Items) -> tuple[Array, Indices]:
        """Vertices and triangles of a node's mesh, with the node's weights of its morph targets."""
        number = integer(node.value["mesh"], len(self._document.list("meshes")))
        mesh = self._document.list("meshes")[number]
        label = f"mesh {quote_name(mesh.value.get('name', number))}"
        if "skin" in node.value:
            self._draft.note(f"{label}: skin left out: it is shown as it stands in its node")
        weights = tuple(_numbers(node.array("weights") or mesh.array("weights"), None, f"weights of {label}"))
        if (number, weights) not in self._meshes:
            pieces = [self._primitive(p, weights, label) for p in mesh.list("primitives")]
            self._meshes[number, weights] = join_pieces([piece for piece in pieces if piece is not None])
        return self._meshes[number, weights]

    def _primitive(self, primitive: Items, weights: tuple[float, ...], label: str) -> tuple[Array, Indices] | None:
        mode = primitive.value.get("mode", _TRIANGLES)
        if mode in _NOT_READ:
            self._draft.note(f"{label}: {'lines' if mode else 'points'} left out")
            return None
        attributes = primitive.object("attributes").value
        if mode not in (_TRIANGLES, _STRIP, _FAN) or "POSITION" not in attributes:
            self._draft.note(f"{label}: a primitive without positions, or of no known mode, left out")
            return None
        points = self._buffers.points(attributes["POSITION"], label, self._draft)
        if any(weights):
            points = self._morphed(points, primitive, weights, label)
        if "indices" in primitive.value:
            corners = self._buffers.values(primitive.value["indices"], 1).ravel().astype(np.int64)
        else:
            corners = np.arange(len(points))
        if mode == _STRIP:
            return points, strips(corners)
        if mode == _FAN:
            return points, fans(corners)
        if len(corners) % 3:
            self._draft.note(f"{label}: {len(corners) % 3} corners after the last triangle left out")
        return points, corners[: len(corners) // 3 * 3].reshape(-1, 3)

    def _morphed(self, points: Array, primitive: Items, weights: tuple[float, ...], label: str) -> Array:
        """Positions with the file's own weights of its morph targets."""
        targets = primitive.list("targets")
        if len(targets) != len(weights):
            raise UnusableMeshError(f"{label} has {len(weights)} weights for {len(targets)} morph targets")
        for target, weight in zip(targets, weights, strict=True):
            if weight and "POSITION" in target.value:
                moves = self._buffers.values(target.value["POSITION"], 3)
                if len(moves) != len(points):
                    raise UnusableMeshError(f"{label} has a morph target of {len(moves)} vertices, not {len(points)}")
                points = points + weight * moves
        return points

    def _tell_unseen(self, shown: list[Items]) -> None:
        """Name the meshes that the scene does not show."""
        seen = {node.value["mesh"] for node in shown}
        for number, mesh in enumerate(self._document.list("meshes")):
            if number not in seen:
                self._draft.note(f"mesh {quote_name(mesh.value.get('name', number))} is not in the scene: left out")


def _numbers(found: list[Any], count: int | None, what: str) -> list[float]:
    """A list of finite numbers out of JSON."""
    good = all(isinstance(v, int | float) and not isinstance(v, bool) and abs(v) < 1e300 for v in found)
    if not good or count not in (None, len(found)):
        raise UnusableMeshError(f"{what} are not {'' if count is None else f'{count} '}finite numbers")
    return [float(v) for v in found]


def _transform(node: Items) -> Array:
    """(4, 4) transform of a node to its parent."""
    what = f"numbers of node {quote_name(node.value.get('name', 'without a name'))}"
    if "matrix" in node.value:
        return np.array(_numbers(node.array("matrix"), 16, what)).reshape(4, 4).T
    move = _numbers(node.array("translation") or [0, 0, 0], 3, what)
    turn = _numbers(node.array("rotation") or [0, 0, 0, 1], 4, what)
    scale = _numbers(node.array("scale") or [1, 1, 1], 3, what)
    return _compose(np.array(move), np.array(turn), np.array(scale))


def _compose(move: Array, turn: Array, scale: Array) -> Array:
    """(4, 4) transform that scales, turns by a quaternion (x, y, z, w), then moves."""
    length = float(norm(turn))
    if not 0.0 < length < math.inf:
        raise UnusableMeshError("a node has a rotation that is none")
    return compose_transform(move, scale * rotation_of_quaternion(turn / length))
