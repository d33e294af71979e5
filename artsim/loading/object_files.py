"""Which file is an object's: the one that was named, or one of a folder."""

import os
from pathlib import Path

from artsim.common.files import read_bounded
from artsim.errors import AssetError
from artsim.families import CATEGORIES
from artsim.loading.meshes import LoadLimits
from artsim.loading.mjcf_xml import is_mjcf
from artsim.loading.partnet import GAPARTNET
from artsim.loading.rest_state import canonical_category
from artsim.loading.usd_layers import SUFFIXES
from artsim.loading.xml_repair import xacro_error

JOINT_FILES = ("mobility_v3.json", "mobility_v2.json", "motion_attributes.json")
"""Names of a folder's annotation of joints: of PartNet-Mobility with one glTF file, and with many meshes; and of
Shape2Motion."""
OTHER_FILES = ("mobility.xml", *(f"mobility{suffix}" for suffix in SUFFIXES), *JOINT_FILES)
"""Names of an object's file, in a folder without a URDF file."""
UNITY = "motion_unity.urdf"
"""The URDF file of AKB-48."""

_NAMED_BY_FOLDER = {"mobility.urdf", GAPARTNET, UNITY, *OTHER_FILES}
_SCENES = (".glb", ".gltf")
_KINDS = "a URDF, MJCF or USD file, or a JSON file of joints"


def find_urdf(path: Path) -> Path:
    """The file that a path names: itself, or the URDF file in a folder; without one, its file of another format.

    For a glTF file, it is the annotation of joints beside it.

    Raises
    ------
    AssetError
        When there is none, or several to choose from.
    """
    try:
        if path.is_file():
            return _joints_of(path) if path.suffix.lower() in _SCENES else path
        found_folder = path.is_dir()
    except OSError:  # a name that is too long for the system
        found_folder = False
    if not found_folder:
        raise AssetError("no such file or folder", path, f"pass {_KINDS}, or a folder that holds one")
    for mobility in (path / "mobility.urdf", path / GAPARTNET):
        if mobility.is_file():
            return mobility
    found = sorted(p for p in path.glob("*.urdf") if p.is_file())
    if len(found) == 1:
        return found[0]
    if not found:
        other = next((path / name for name in OTHER_FILES if (path / name).is_file()), None)
        if other is not None:
            return other
        macros = sorted(path.glob("*.xacro"))
        if macros:
            raise xacro_error("the folder holds no URDF file, but macros", macros[0])
        names = ("mobility.urdf", *OTHER_FILES)
        below = next((file.parent for name in names for at in ("*", "*/*") for file in path.glob(f"{at}/{name}")), None)
        fix = f"pass {_KINDS}, or a folder with a mobility.urdf or one *.urdf" + (f", such as {below}" if below else "")
        raise AssetError(f"the folder holds no URDF file, nor any of {', '.join(OTHER_FILES)}", path, fix)
    raise AssetError(f"the folder holds {len(found)} URDF files", path, f"pass one of them, such as {found[0].name}")


def _joints_of(scene: Path) -> Path:
    """The annotation of joints beside a glTF file.

    Raises
    ------
    AssetError
        When there is none.
    """
    for name in (*JOINT_FILES[:2], f"{scene.stem}.json"):
        if (scene.parent / name).is_file():
            return scene.parent / name
    raise AssetError(
        "a glTF file has shapes, but no joints",
        scene,
        f"put its {JOINT_FILES[1]} beside it, whose parts have the numbers that begin the names of its nodes",
    )


def read_urdf(file: Path, max_bytes: int) -> bytes:
    """The content of an object's file, which lies in its folder once links are followed.

    The folder itself may be reached through links: then its meshes are there, too.

    Raises
    ------
    AssetError
        When it cannot be read, is too large, or is a link that leads out of its folder.
    """
    what = "URDF file" if file.suffix == ".urdf" else "object's file"
    real = Path(os.path.realpath(file))  # links in a circle are told where they are read
    if file.is_symlink() and not real.is_relative_to(os.path.realpath(file.parent)):
        raise AssetError(f"the {what} is a link that leads out of its folder", file, f"pass the file itself: {real}")
    return read_bounded(file, max_bytes, what)


def max_bytes(file: Path, limits: LoadLimits) -> int:
    """Size that an object's file may have: that of USD holds its meshes."""
    return limits.max_mesh_bytes if file.suffix.lower() in SUFFIXES else limits.max_urdf_bytes


def is_params(file: Path, data: bytes) -> bool:
    """Whether a file holds parameters of a procedural object; see :class:`artsim.model.params.Params`."""
    return file.suffix == ".json" and all(f'"{name}"'.encode() in data for name in ("category", "draw", "values"))


def is_urdf(file: Path) -> bool:
    """Whether an object's file is URDF, and not of another format or an object file.

    Raises
    ------
    AssetError
        When it cannot be read.
    """
    if file.suffix.lower() in (".npz", ".json", *SUFFIXES):
        return False
    return not is_mjcf(read_urdf(file, LoadLimits().max_urdf_bytes), file)


def object_id(file: Path, annotated: str | None) -> str:
    """The name of an object: of its folder, where its file is called as every other is; else of its file.

    PartNet-Mobility's own number is the folder's name; ``meta.json`` may carry an older one.
    """
    if file.name not in _NAMED_BY_FOLDER:
        return _encodable(file.stem)
    folder = file.resolve().parent.name
    return _encodable(folder) if folder.isdigit() or annotated is None else annotated


def category_of_folder(file: Path) -> str | None:
    """The category of an object of Shape2Motion or AKB-48, whose folder lies in one that is called so."""
    if file.name not in (UNITY, JOINT_FILES[-1]):
        return None
    name = canonical_category(_encodable(file.resolve().parent.parent.name))
    return name if name in CATEGORIES else None


def _encodable(name: str) -> str:
    """A file's name as text that can be written; names of files may be any bytes."""
    return name.encode("utf-8", "replace").decode("utf-8")
