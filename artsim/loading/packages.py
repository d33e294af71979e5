"""Where the files are that an object's file names: ``package://``, ``../`` and the like, none of them outside.

They are the meshes of a URDF or MJCF file, and what an MJCF file includes; "the URDF" below stands for either.

A file may be read below an *allowed* folder only:

1. the URDF's own folder;
2. the asset's root: the nearest folder above the URDF that holds ``package.xml`` (at most six levels up); without one,
   the parent of the URDF's folder where that is called ``urdf``, ``robots`` or the like, and a folder ``meshes`` beside
   the URDF's folder;
3. without a ``package.xml``, a folder at most three levels above the URDF whose name is that of the package;
4. folders that the user declares as package roots.

A home folder, what holds homes, the top of the file system and the folder of temporary files are never an asset's root.
Links are followed before it is judged where a file lies.
"""

from __future__ import annotations

import os
import re
import shlex
import stat
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import islice
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from lxml import etree

from artsim.errors import AssetError
from artsim.model.objects import Repair

_MANIFEST_LEVELS, _NAME_LEVELS = 6, 3
_MAX_MANIFEST_BYTES = 1_000_000
_MAX_LISTED = 100_000
_URDF_FOLDERS = ("urdf", "urdfs", "robot", "robots", "model", "models", "xacro", "description", "descriptions")
_MESH_FOLDERS = ("meshes", "mesh")
_SCHEME = re.compile(r"([A-Za-z][A-Za-z0-9+.-]+):/+(.*)", re.DOTALL)
_DRIVE = re.compile(r"[A-Za-z]:/")


class MissingFileError(Exception):
    """No such file in any folder that may be read, and what to do about it."""

    def __init__(self, what: str, fix: str):
        super().__init__(what)
        self.fix = fix


@dataclass
class AssetPaths:
    """Resolves the file names of one URDF or MJCF file."""

    folder: Path
    """The URDF file's folder: the root of relative names."""
    declared: Mapping[str, Path]
    """Folder of each declared package."""
    repairs: list[Repair] = field(default_factory=list)
    """What was assumed so far."""
    _said: set[str] = field(default_factory=set)
    _folders: dict[Path, Path] = field(default_factory=dict)
    _first: dict[str, Path] = field(default_factory=dict)
    """Where names that start alike are looked for first, of those that were found there."""

    def resolve(self, filename: str, what: str = "mesh") -> Path:
        """Path of an existing file, confined to the allowed folders; ``what`` it is, for messages.

        Raises
        ------
        MissingFileError
            When no such file exists.
        AssetError
            When it would lie outside the allowed folders, or is on the web.
        """
        start, _, name = filename.rpartition("/")
        plain = "\\" not in filename and filename == filename.strip()
        if plain and start in self._first and _is_own_file(self._first[start] / name):
            return self._first[start] / name
        package, rest = self._split(filename, what)
        names = dict.fromkeys((rest, unquote(rest)))
        candidates = (candidate for name in names for candidate in self._candidates(package, name))
        tried: list[_Candidate] = []
        is_inside = cache(lambda path: self._is_inside(path, package))  # resolving links takes longest, so once each
        for respelt in (False, True):
            for candidate in tried.copy() if respelt else _kept(candidates, tried):
                if not is_inside(candidate.path):
                    continue
                path = _with_case_of_disk(candidate.path) if respelt else candidate.path
                if path is not None and is_file(path) and is_inside(path):
                    self._say(candidate.assumed)
                    self._say(f"{filename!r} is {path.name!r} on disk: read" if respelt else "")
                    if plain and len(tried) == 1 and not respelt and path.name == name:
                        self._first[start] = path.parent
                    return path
        inside = [candidate for candidate in tried if is_inside(candidate.path)]
        found_outside = next((c.path for c in tried if c not in inside and is_file(c.path)), None)
        if found_outside is not None or not inside:
            raise AssetError(
                f"{what} {filename!r} lies outside the asset's folder",
                self.folder,
                self._fix_outside(package, rest, found_outside),
            )
        raise MissingFileError(f"{what} {filename!r} is missing", self._fix_missing(package, rest))

    @cached_property
    def root(self) -> Path:
        """The asset's root: the folder of the package, or of the URDF; see the module."""
        return self._manifest_root or self._usual_root or self._own

    @cached_property
    def _own(self) -> Path:
        return self.folder.resolve()

    @cached_property
    def _manifest_root(self) -> Path | None:
        for level, ancestor in enumerate([self._own, *self._own.parents]):
            if level > _MANIFEST_LEVELS or _is_shared(ancestor):
                return None
            if is_file(ancestor / "package.xml"):
                return ancestor
        return None

    @cached_property
    def _usual_root(self) -> Path | None:
        parent = self._own.parent
        return parent if self._own.name.lower() in _URDF_FOLDERS and not _is_shared(parent) else None

    @cached_property
    def _manifest_name(self) -> str | None:
        """The name that the package's own manifest gives it."""
        if self._manifest_root is None:
            return None
        path = self._manifest_root / "package.xml"
        try:
            if path.stat().st_size > _MAX_MANIFEST_BYTES:
                return None
            parser = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False)
            return (etree.fromstring(path.read_bytes(), parser).findtext("name") or "").strip() or None
        except (OSError, etree.XMLSyntaxError, ValueError):  # a manifest that is not read names nothing
            return None

    @cached_property
    def _bases(self) -> list[Path]:
        """Folders that a name may start from; above the URDF's folder, only what is allowed is found."""
        return list(dict.fromkeys((self.root, self._own.parent, self._own)))

    def _of_name(self, package: str) -> list[Path]:
        """Folders from the URDF's own upwards that are the package of a name."""
        if self._manifest_root is not None:
            levels = [a for a in [self._own, *self._own.parents] if a.is_relative_to(self._manifest_root)]
            named = [a for a in levels if a.name == package]
            return [*named, self._manifest_root] if self._manifest_name == package else named
        levels = [self._own, *self._own.parents][: _NAME_LEVELS + 1]
        return [a for a in levels if a.name == package and not _is_shared(a) and len(a.parts) > 2]

    @cached_property
    def _allowed(self) -> list[Path]:
        beside = [] if _is_shared(self._own.parent) else [self._own.parent / name for name in _MESH_FOLDERS]
        folders = [self._own, self.root, *beside, *self.declared.values()]
        return [folder.resolve() for folder in folders]

    def _is_inside(self, path: Path, package: str | None) -> bool:
        allowed = self._allowed if package is None else [*self._allowed, *self._of_name(package)]
        try:
            real = self._real(path)
        except (OSError, RuntimeError, ValueError):  # links that go round in a circle, names with a zero byte
            return False
        return any(real.is_relative_to(folder) for folder in allowed)

    def _real(self, path: Path) -> Path:
        """Where a path leads, links followed. A folder of hundreds of meshes is followed once."""
        if path.name in ("", ".."):
            return path.resolve()
        if path.parent not in self._folders:
            self._folders[path.parent] = path.parent.resolve()
        file = self._folders[path.parent] / path.name
        return file.resolve() if file.is_symlink() else file

    def _split(self, filename: str, what: str) -> tuple[str | None, str]:
        """Package (None for a plain path) and the rest of a name."""
        name = filename.strip().replace("\\", "/")
        scheme = _SCHEME.fullmatch(name)
        if scheme is None or _DRIVE.match(name):
            return None, str(_home() / name[2:]) if name.startswith("~/") else name
        kind, rest = scheme[1].lower(), scheme[2]
        if kind in ("package", "model"):
            package, _, rest = rest.partition("/")
            return package, rest.lstrip("/")
        if kind == "file":  # two slashes and a relative path is not what the standard says, but what people write
            absolute = name[len("file:") :].startswith(("///", "//localhost/")) and not _DRIVE.match(rest)
            return None, f"/{rest.removeprefix('localhost/')}" if absolute else rest
        raise AssetError(
            f"{what} {filename!r} is not a file",
            self.folder,
            "download it, and write its path from the file's folder on",
        )

    def _candidates(self, package: str | None, name: str) -> Iterator[_Candidate]:
        """Where a file may be, in the order in which it is looked for."""
        parts = [part for part in name.split("/") if part not in ("", ".")]
        if package is None:
            yield _Candidate(self.folder / name)  # an absolute name replaces the folder
            if PurePosixPath(name).is_absolute() or _DRIVE.match(name):
                yield from self._below_own_name(parts)
                return
            for folder in dict.fromkeys((*self._bases, *self.declared.values())):
                yield _Candidate(folder / name, f"names are read from {folder.name!r} on, not from the URDF's folder")
            yield from self._below_own_name(parts)
            return
        if package in self.declared:
            yield _Candidate(self.declared[package] / name)
            return  # what the user says is not guessed at
        for folder in self._of_name(package):
            yield _Candidate(folder / name)
        if self._sibling(package, name) is not None:
            return  # that package is there, but may not be read: a file of the same name here is another one
        for base in self._bases:
            yield _Candidate(base / package / name, f"package {package!r} is taken for a folder in {base.name!r}")
            yield _Candidate(
                base / name, f"package {package!r} is not declared: taken to be {base.name!r}, the asset's own"
            )
        if ".." in parts:  # what climbs is not guessed at
            return
        yield from self._below_own_name([package, *parts])
        for i in range(1, len(parts) - 1):  # a folder and a name are left: a name alone may be that of another mesh
            for base in self._bases:
                said = (
                    f"package {package!r} is not declared: from {parts[i]!r} on, its names are read from {base.name!r}"
                )
                yield _Candidate(base.joinpath(*parts[i:]), said)

    def _below_own_name(self, parts: list[str]) -> Iterator[_Candidate]:
        """A path written on another machine, or from another root, goes on from where it names the asset's folder."""
        for folder in dict.fromkeys((self.root, self._own)):
            for i in reversed(range(len(parts) - 1)):
                if parts[i] == folder.name:
                    said = f"names that start elsewhere are read from {folder.name!r} on, which they pass through"
                    yield _Candidate(folder.joinpath(*parts[i + 1 :]), said)

    def _say(self, what: str) -> None:
        if what and what not in self._said:
            self._said.add(what)
            self.repairs.append(Repair("file names", what))

    def _sibling(self, package: str, name: str) -> Path | None:
        """A package beside this one that holds the file; it is never read unless it is declared."""
        if self._manifest_root is None or package in self.declared:
            return None
        beside = self._manifest_root.parent / package
        return beside if beside != self._manifest_root and is_file(beside / name) else None

    def _fix_missing(self, package: str | None, rest: str) -> str:
        if package is None:
            return f"put it there, or name the folder that {rest!r} starts from: {option(self._own.name, None)}"
        if package in self.declared:
            return f"put {rest!r} into {str(self.declared[package])!r}, or name another folder: {option(package, None)}"
        sibling = self._sibling(package, rest)
        if sibling is not None:
            return f"allow the package beside this one: {option(package, sibling)}"
        return f"say where the package is: {option(package, None)}"

    def _fix_outside(self, package: str | None, rest: str, found: Path | None) -> str:
        if package is not None and package not in self.declared:
            return f"move it inside, or say where the package is: {option(package, self._sibling(package, rest))}"
        path = Path(os.path.normpath(self.folder / rest)) if found is None else found.resolve()
        common = Path(os.path.commonpath([self._own, path]))
        folder = path.parent if _is_shared(common) or len(common.parts) <= 2 else common
        return f"move it inside, or allow its folder if you trust the file: {option(folder.name, folder)}"


@dataclass(frozen=True)
class _Candidate:
    """A path to look at, and what is assumed by it."""

    path: Path
    assumed: str = ""


def option(name: str, folder: Path | None) -> str:
    """The option that declares a package, ready to paste."""
    name = name if name.isprintable() and name else "NAME"
    value = f"/path/to/{name}" if folder is None or not str(folder).isprintable() else str(folder)
    return f"--package-root {shlex.quote(f'{name}={value}')}"


def _kept(candidates: Iterator[_Candidate], tried: list[_Candidate]) -> Iterator[_Candidate]:
    """Candidates as they are looked at, written down for a second look."""
    for candidate in candidates:
        tried.append(candidate)
        yield candidate


def is_file(path: Path) -> bool:
    """Whether there is a file of a name, which may be one that no file can have."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long for the file system, or with a zero byte
        return False


def _is_own_file(path: Path) -> bool:
    """Whether a path is a file and no link."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except (OSError, ValueError):  # as above
        return False


def _is_folder(path: Path) -> bool:
    try:
        return path.is_dir()
    except (OSError, ValueError):  # as above
        return False


def _is_shared(folder: Path) -> bool:
    """Whether a folder holds more than one asset for sure: a home, what holds homes, the top, temporary files."""
    if folder == Path(tempfile.gettempdir()).resolve() or folder.parent in (Path("/home"), Path("/Users")):
        return True
    return folder == Path(folder.anchor) or _home().is_relative_to(folder)


@cache
def _home() -> Path:
    try:
        return Path.home().resolve()
    except RuntimeError:  # a user that the system does not know
        return Path("/root")


def _with_case_of_disk(path: Path) -> Path | None:
    """The path of an existing file whose name differs in capital letters alone, if there is one."""
    missing = []
    here = path
    while not _is_folder(here):
        missing.append(here.name)
        if here.parent == here or len(missing) > 20:
            return None
        here = here.parent
    for name in reversed(missing):
        if name == "..":
            return None
        try:
            with os.scandir(here) as entries:
                found = sorted(e.name for e in islice(entries, _MAX_LISTED) if e.name.lower() == name.lower())
        except OSError:
            return None
        if not found:
            return None
        here = here / found[0]
    return here
