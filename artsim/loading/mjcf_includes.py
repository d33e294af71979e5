"""What an MJCF document includes, put in place: one tree of elements, without ``<include>``."""

import os
from dataclasses import dataclass, field
from pathlib import Path

from lxml import etree

from artsim.common.files import read_bounded
from artsim.errors import AssetError
from artsim.loading.packages import AssetPaths, MissingFileError
from artsim.loading.urdf_xml import safe_xml
from artsim.loading.xml_repair import readable_xml

_MAX_INCLUDES = 100


def put_included(root: etree._Element, file: Path, paths: AssetPaths, max_bytes: int) -> list[bytes]:
    """Put the elements of included files in place of each ``<include>``; each file once, as MuJoCo has it.

    Changes ``root``; returns the content of the included files, which may have ``max_bytes`` together. Raises
    AssetError when one is missing, outside the allowed folders, included twice or not well formed, or they are too
    large.
    """
    reading = _Reading(file, paths, max_bytes, {file.resolve()})
    reading.expand(root, file.parent)
    return reading.contents


@dataclass
class _Reading:
    file: Path
    paths: AssetPaths
    room: int
    seen: set[Path]
    contents: list[bytes] = field(default_factory=list)

    def expand(self, root: etree._Element, folder: Path) -> None:
        """Replace each ``<include>`` below an element of a file in a folder."""
        for include in list(root.iter("include")):
            for element in self._elements(include.get("file") or "", folder):
                include.addprevious(element)
            parent = include.getparent()
            assert parent is not None  # the top element is <mujoco>
            parent.remove(include)

    def _elements(self, name: str, folder: Path) -> list[etree._Element]:
        path = self._path(name, folder)
        real = path.resolve()
        if real in self.seen or len(self.contents) >= _MAX_INCLUDES:
            raise AssetError(
                f"includes {name[:100]!r} twice, or over {_MAX_INCLUDES} files",
                self.file,
                "include each file once, in one place",
            )
        self.seen.add(real)
        data = read_bounded(path, self.room, "included file")
        self.contents.append(data)
        self.room -= len(data)
        included = safe_xml(readable_xml(data, path)[0], path)
        self.expand(included, path.parent)
        return list(included)

    def _path(self, name: str, folder: Path) -> Path:
        """Where an included file is: names start from the document's folder, else from that of who includes it."""
        if not name.strip():
            raise AssetError("an <include> names no file", self.file, 'write <include file="..."/>, or remove it')
        try:
            nested = folder / name.replace("\\", "/")
            if nested.is_file() and not (self.file.parent / name.replace("\\", "/")).is_file():
                name = os.path.relpath(nested, self.file.parent)
        except (OSError, ValueError):  # a name that no file can have: it is said to be missing
            pass
        try:
            return self.paths.resolve(name, "included file")
        except MissingFileError as error:
            raise AssetError(str(error), self.file, error.fix) from error
