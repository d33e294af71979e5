"""The side files of a PartNet-Mobility folder: category, id, part labels, the joints as first annotated.

GAPartNet adds a URDF file with links of its own to such a folder, and ``link_annotation_gapartnet.json``, which says
what each of these links is: "slider_drawer", "hinge_door".

Folders that :func:`artsim.export.export` wrote say more in ``meta.json``: the order of the parts, and which links only
help to build a screw. Such objects are at rest at their file's zero.
"""

import os
from dataclasses import dataclass, field, replace
from pathlib import Path

from artsim.common.files import parse_json, read_bounded
from artsim.errors import AssetError
from artsim.model.objects import Repair

_MAX_SIDE_FILE = 8_000_000
"""Those of PartNet-Mobility take some hundred thousand bytes at most."""

_MAX_NAME = 200
"""Characters of an id, a category, or a label."""


@dataclass(frozen=True)
class SideFiles:
    """What stands beside a URDF file."""

    object_id: str | None = None
    category: str | None = None
    """From ``meta.json``."""
    labels: dict[str, str] = field(default_factory=dict)
    """Link name -> semantic name, from ``semantics.txt``."""
    num_movable: int | None = None
    """Movable joints as first annotated (``mobility_v2.json``, else ``semantics.txt``)."""
    parts: tuple[str, ...] = ()
    """Links that are parts, in order; empty unless artsim itself wrote the folder."""
    helpers: tuple[str, ...] = ()
    """Links without a shape that stand between the two joints of a screw, as far as ``meta.json`` says so."""
    repairs: tuple[Repair, ...] = ()
    """Side files that could not be read."""
    contents: tuple[bytes, ...] = ()
    """Bytes of the files used, part of the object's digest."""


GAPARTNET = "mobility_annotation_gapartnet.urdf"
"""The URDF file of GAPartNet."""
_GAPARTNET_LINKS = "link_annotation_gapartnet.json"
_HELD = "_fixed_handle"
"""End of the names of what does not move against the part that it is on, so that it does not say what that part is."""
_STILL = ("free", "static", "heavy", "fixed", "junk")


def read_side_files(file: Path) -> SideFiles:
    """Read what stands beside an object's file, where it exists; broken side files are reported.

    These are ``meta.json``, and ``semantics.txt`` and ``mobility_v2.json``, or, of GAPartNet's URDF file, its own
    annotation. An annotation of joints in JSON says itself what its parts are. A link that leads out of the folder is
    reported, not followed.
    """
    folder = file.parent
    contents: list[bytes] = []
    repairs: list[Repair] = []

    def content(name: str) -> bytes | None:
        path = folder / name
        if not os.path.lexists(path):
            return None
        try:
            contents.append(read_bounded(path, _MAX_SIDE_FILE, name, inside=folder))
        except AssetError as error:
            repairs.append(Repair(name, f"ignored: {error.what}"))
            return None
        return contents[-1]

    def parsed(name: str) -> object:
        data = content(name)
        if data is None:
            return None
        try:
            return parse_json(data)
        except ValueError as error:
            repairs.append(Repair(name, f"ignored: not JSON ({error})"))
            return None

    meta = parsed("meta.json")
    meta = meta if isinstance(meta, dict) else {}
    category, object_id = meta.get("model_cat"), meta.get("anno_id")
    own = meta.get("artsim")
    own = own if isinstance(own, dict) else {}

    found = SideFiles(
        object_id=_word(object_id) if isinstance(object_id, (str, int)) else None,
        category=_word(category) if isinstance(category, str) else None,
    )
    if file.name == GAPARTNET:  # the other files are about the links of mobility.urdf
        found = replace(found, labels=_gapartnet_labels(parsed(_GAPARTNET_LINKS)))
    elif file.suffix != ".json":
        rows = [line.split() for line in (content("semantics.txt") or b"").decode("utf-8", "replace").splitlines()]
        rows = [row for row in rows if len(row) >= 3]
        num_movable = sum(row[1] not in _STILL for row in rows) if rows else None
        mobility = parsed("mobility_v2.json")
        if isinstance(mobility, list):
            kinds = [str(m.get("joint", "")) for m in mobility if isinstance(m, dict)]
            num_movable = sum(bool(kind) and kind not in _STILL for kind in kinds)
        labels = {row[0]: _word(row[2]) for row in rows}
        parts, helpers = _names(own.get("parts")), _names(own.get("helpers"))
        found = replace(found, labels=labels, num_movable=num_movable, parts=parts, helpers=helpers)
    return replace(found, repairs=tuple(repairs), contents=tuple(contents))


def _gapartnet_labels(annotation: object) -> dict[str, str]:
    """Link name -> what it is, of the links that GAPartNet counts as parts."""
    found = {}
    for entry in annotation if isinstance(annotation, list) else ():
        if isinstance(entry, dict) and entry.get("is_gapart"):
            link, label = str(entry.get("link_name", "")), str(entry.get("category", ""))
            if link and label and not label.endswith(_HELD):
                found[link] = _word(label)
    return found


def _word(text: str | int) -> str:
    """A text cut to a length that fits a line."""
    return str(text)[:_MAX_NAME]


def _names(value: object) -> tuple[str, ...]:
    return tuple(str(name)[:_MAX_NAME] for name in value) if isinstance(value, list) else ()
