"""The XML of a COLLADA file, and the numbers and references in it."""

import numpy as np
from lxml import etree

from artsim.errors import AssetError
from artsim.loading.mesh_files.surface import Array, Bounds, UnusableMeshError, quote_name
from artsim.loading.mesh_files.text import numbers
from artsim.loading.urdf_xml import safe_xml

_MAX_TAGS = 600_000
"""An element has two tags, and takes some 200 bytes of memory and two microseconds."""


class Document:
    """A COLLADA document whose tags have no namespace.

    ``points`` are the positions of each source that was read, and ``num_primitives`` counts the primitives.

    Raises
    ------
    AssetError
        When it declares a document type, or is too large.
    UnusableMeshError
        When it is not COLLADA.
    """

    def __init__(self, data: bytes, bounds: Bounds):
        self.root = _parse(data, bounds)
        self.num_primitives = 0
        self.points: dict[etree._Element, Array] = {}
        self._ids: dict[str, etree._Element] = {}
        for element in self.root.iter():
            element.tag = etree.QName(element).localname
            name = element.get("id")
            if name is not None:
                self._ids.setdefault(name, element)
        if self.root.tag != "COLLADA":
            raise UnusableMeshError(f"its top element is {quote_name(self.root.tag)}, not 'COLLADA'")

    def find(self, url: str | None) -> etree._Element | None:
        """The element that ``#id`` names; None for one that is missing or in another file."""
        return self._ids.get(url[1:]) if url is not None and url.startswith("#") else None

    def target(self, instance: etree._Element) -> etree._Element | None:
        """The element that an instance shows."""
        return self.find(instance.get("url"))


def _parse(data: bytes, bounds: Bounds) -> etree._Element:
    if data.count(b"<") > _MAX_TAGS:
        raise AssetError(
            f"the mesh has over {_MAX_TAGS} XML tags", bounds.where, "export it again with one list of numbers a mesh"
        )
    # Long lists of numbers need huge_tree, which lets entities expand without end: none may be declared, and no
    # encoding hides it.
    plain = not data.startswith((b"\xff\xfe", b"\xfe\xff")) and b"\0" not in data[:4]
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise AssetError("declares a document type, which could hide entities", bounds.where, "remove the <!DOCTYPE>")
    declaration = data[: data.find(b"?>")] if data[:100].lstrip().startswith(b"<?xml") else b""
    plain = plain and b"utf-16" not in declaration.lower() and b"utf-7" not in declaration.lower()
    try:
        return safe_xml(data.lstrip(b" \t\r\n"), bounds.where, huge_tree=plain)
    except AssetError as error:
        if error.__cause__ is None and data.strip():
            raise
        raise UnusableMeshError(f"is not well-formed XML ({error.__cause__ or 'it is empty'})") from error


def attribute(element: etree._Element) -> str:
    """What a person calls an element: its id or its name."""
    return element.get("id") or element.get("name") or "without a name"


def array(element: etree._Element | None) -> Array:
    """All numbers in an element; NaN for words that are none."""
    text = "" if element is None else element.text or ""
    return numbers(text.encode("ascii", "replace"), np.float64, np.nan)


def integers(element: etree._Element | None) -> np.ndarray:
    """All whole numbers in an element; -1 for words that are none."""
    text = "" if element is None else element.text or ""
    return numbers(text.encode("ascii", "replace"), np.int64, -1)


def values(element: etree._Element, count: int, node: etree._Element) -> Array:
    """The numbers of a transform.

    Raises
    ------
    UnusableMeshError
        When they are not ``count`` finite numbers.
    """
    found = array(element)
    if len(found) != count or not np.isfinite(found).all():
        raise UnusableMeshError(f"<{element.tag}> of node {quote_name(attribute(node))} is not {count} finite numbers")
    return found
