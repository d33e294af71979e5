"""COLLADA (DAE): a graph of nodes that show geometries, in XML.

Materials, images and texture coordinates are never looked at: what is missing of them costs no geometry.

``<unit>`` is applied and ``<up_axis>`` is not: so do RViz, PyBullet and SAPIEN when a URDF file names a mesh.
"""

import math
from collections.abc import Callable, Iterator

import numpy as np
from lxml import etree

from artsim.loading.mesh_files.dae_document import Document, attribute, values
from artsim.loading.mesh_files.dae_geometry import Geometry, read_geometry
from artsim.loading.mesh_files.surface import (
    Array,
    Bounds,
    Draft,
    Surface,
    UnusableMeshError,
    compose_affine,
    mirrors,
    quote_name,
    transform_affine,
)
from artsim.model.transforms import compose_transform, rotation_about

_MAX_DEPTH = 150
"""Nodes inside nodes; far from Python's own limit."""
_NOTHING = np.zeros(4, dtype=object)
"""Pieces, nodes, faces and vertices that a node shows, all that it contains included, before any of it is copied."""


def read_dae(data: bytes, bounds: Bounds) -> Surface:
    """The surface of the scene that a COLLADA file shows, in metres; raises as ``read_mesh``."""
    document = Document(data, bounds)
    draft = Draft()
    scale = _unit(document, draft)
    _tell_up_axis(document, draft)
    scene = _Scene(document, bounds, draft)
    roots = scene.roots()
    pieces, nodes, faces, vertices = sum((scene.extent(root, _MAX_DEPTH) for root in roots), start=_NOTHING)
    bounds.check_pieces(max(pieces, nodes))
    bounds.check(faces, "triangles")
    bounds.check(vertices, "vertices")
    draft.declared = faces
    for root in roots:
        scene.show(root, np.diag([scale, scale, scale, 1.0]))
    scene.tell_unseen()
    return draft.surface()


def _unit(document: Document, draft: Draft) -> float:
    """Metres in a unit of the file."""
    unit = document.root.find("asset/unit")
    text = None if unit is None else unit.get("meter")
    if text is None:
        return 1.0
    try:
        meter = float(text)
    except ValueError:
        meter = math.nan
    if not 0.0 < meter < math.inf:
        raise UnusableMeshError(f"its <unit meter={quote_name(text)}> is no length")
    if any(u.get("meter") not in (None, text) for u in document.root.iter("unit") if u is not unit):
        draft.note(f"has parts in other units: all are taken as units of {meter:g} m")
    return meter


def _tell_up_axis(document: Document, draft: Draft) -> None:
    axis = document.root.findtext("asset/up_axis")
    if axis is not None and axis.strip() != "Z_UP":
        draft.note(f"up_axis {quote_name(axis.strip())} is not applied, as in RViz, PyBullet and SAPIEN")


class _Scene:
    """The nodes of a file, and what they show."""

    def __init__(self, document: Document, bounds: Bounds, draft: Draft):
        self._document, self._bounds, self._draft = document, bounds, draft
        self._geometries: dict[etree._Element, Geometry | None] = {}
        self._extents: dict[etree._Element, np.ndarray | None] = {}
        self._seen: set[etree._Element] = set()
        self._told: set[tuple[etree._Element, str]] = set()

    def roots(self) -> list[etree._Element]:
        """The elements that hold the nodes that the file shows."""
        shown = self._document.root.find("scene/instance_visual_scene")
        scenes = self._document.root.findall("library_visual_scenes/visual_scene")
        if shown is not None:
            scene = self._document.target(shown)
            if scene is not None:
                return [scene]
            self._draft.note(f"scene {quote_name(shown.get('url'))} is missing")
        elif scenes:
            self._draft.note("does not say which scene it shows")
        if scenes:
            return scenes[:1]
        self._draft.note("has no scene: each geometry is shown once, as it is")
        return self._document.root.findall("library_geometries/geometry")

    def extent(self, node: etree._Element, depth: int) -> np.ndarray:
        """How much a node, scene or geometry shows: see :data:`_NOTHING`.

        Raises
        ------
        UnusableMeshError
            When nodes contain each other or are nested too deeply.
        """
        if node in self._extents:
            known = self._extents[node]
            if known is None:
                raise UnusableMeshError(f"node {quote_name(node.get('id'))} contains itself")
            return known
        if depth == 0:
            raise UnusableMeshError(f"its nodes are nested over {_MAX_DEPTH} deep")
        self._extents[node] = None
        total = _NOTHING + [0, 1, 0, 0]
        for geometry in self._shown_by(node):
            total += [1, 0, len(geometry.faces), len(geometry.vertices)]
        for child in self._children(node):
            part = self.extent(child, depth - 1)
            total += part if part[0] else 0
        self._extents[node] = total
        return total

    def show(self, node: etree._Element, T: Array) -> None:
        """Add what a node shows to the surface; T carries its parent's frame to the file's."""
        if not self.extent(node, _MAX_DEPTH)[0]:
            return
        if node.tag == "node":
            for element in node:
                if element.tag == "skew":
                    raise UnusableMeshError(f"node {quote_name(attribute(node))} has a <skew>, which is not read")
                if element.tag in _TRANSFORMS:
                    count, make = _TRANSFORMS[element.tag]
                    T = compose_affine(T, make(values(element, count, node)))
        for geometry in self._shown_by(node):
            faces = geometry.faces[:, ::-1] if mirrors(T) else geometry.faces
            self._draft.accounted += len(faces)
            self._draft.add(transform_affine(T, geometry.vertices), faces)
        for child in self._children(node):
            self.show(child, T)

    def _children(self, node: etree._Element) -> Iterator[etree._Element]:
        for element in node:
            if element.tag == "node":
                yield element
            elif element.tag == "instance_node":
                target = self._document.target(element)
                if target is not None:
                    yield target
                else:
                    self._once(element, f"node {quote_name(element.get('url'))} is missing: left out")

    def _shown_by(self, node: etree._Element) -> Iterator[Geometry]:
        if node.tag == "geometry":
            found = self._geometry(node)
            if found is not None:
                yield found
            return
        for element in node:
            if element.tag in ("instance_geometry", "instance_controller"):
                self._seen.add(element)
                geometry = self._named_by(element)
                if geometry is not None:
                    yield geometry

    def _named_by(self, instance: etree._Element) -> Geometry | None:
        """The geometry of an instance, through the skins and shapes that would change it."""
        target, steps = self._document.target(instance), 0
        while target is not None and target.tag == "controller" and steps < 10:
            steps += 1
            change = next((e for e in target if e.tag in ("skin", "morph")), None)
            if change is not None:
                kind = "skin" if change.tag == "skin" else "morph targets"
                self._once(
                    instance,
                    f"{kind} of {quote_name(target.get('id'))} left out: "
                    "its geometry is shown as it stands in its node",
                )
            target = None if change is None else self._document.find(change.get("source"))
        if target is None or target.tag != "geometry":
            self._once(instance, f"{quote_name(instance.get('url'))} is missing or no geometry: left out")
            return None
        return self._geometry(target)

    def _geometry(self, element: etree._Element) -> Geometry | None:
        if element not in self._geometries:
            self._geometries[element] = read_geometry(element, self._document, self._bounds, self._draft)
        return self._geometries[element]

    def _once(self, element: etree._Element, text: str) -> None:
        """Say something once for each element, however often it is shown."""
        if (element, text) not in self._told:
            self._told.add((element, text))
            self._draft.note(text)

    def tell_unseen(self) -> None:
        """Name what the file holds but its scene does not show."""
        root = self._document.root
        for element in root.iter("instance_geometry", "instance_controller"):
            if element not in self._seen:
                self._draft.note(f"{quote_name(element.get('url'))} in a node outside the scene: left out")
        for geometry in root.iter("geometry"):
            if geometry not in self._geometries:
                self._draft.note(f"geometry {quote_name(attribute(geometry))} is not in the scene: left out")


def _rotation(found: Array) -> Array:
    """About an axis, by degrees."""
    turns = bool(found[:3].any())
    return compose_transform(np.zeros(3), rotation_about(found[:3], np.deg2rad(found[3])) if turns else None)


def _look_at(found: Array) -> Array:
    """A node that stands at a point and looks along its -z at another."""
    eye, target, up = found.reshape(3, 3)
    back = eye - target
    right = np.cross(up, back)
    lengths = [math.sqrt(float((v * v).sum())) for v in (back, right)]
    if min(lengths) == 0.0:
        raise UnusableMeshError("a <lookat> has no direction")
    x, z = right / lengths[1], back / lengths[0]
    return compose_transform(eye, np.column_stack([x, np.cross(z, x), z]))


_TRANSFORMS: dict[str, tuple[int, Callable[[Array], Array]]] = {
    "matrix": (16, lambda found: found.reshape(4, 4)),
    "translate": (3, compose_transform),
    "scale": (3, lambda found: np.diag([*found, 1.0])),
    "rotate": (4, _rotation),
    "lookat": (9, _look_at),
}
"""How many numbers each element has, and the transform that they make."""
