"""Where objects come from: files of every format that is read, folders of them, and the procedural families."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from artsim.common.names import name_fix
from artsim.common.sequences import listed
from artsim.errors import AssetError, ConfigError
from artsim.families import FAMILIES
from artsim.families.constraints import NO_CONSTRAINTS, Constraints
from artsim.loading.family_source import FamilySource as FamilySource
from artsim.model.objects import ArticulatedObject

# The modules that read files take longer to import than a procedural object to make: who makes some does without.


@dataclass(frozen=True)
class FileSource:
    """An object to load from a file."""

    path: Path
    """URDF, MJCF, USD or joint file."""
    name: str
    """Path from the folder that was named (or holds the file that was) on: stable when that folder moves."""
    sha256: str
    """Digest of the file."""
    package_roots: Mapping[str, Path] = field(default_factory=dict)
    """For ``package://`` meshes."""
    body: str | None = None
    """Which object of a scene; see :func:`artsim.load`."""

    def load(self) -> ArticulatedObject:
        """The object."""
        from artsim.loading.urdf import load

        return load(self.path, package_roots=self.package_roots, body=self.body)


Source = FileSource | FamilySource


def family_sources(
    categories: Sequence[str] | str,
    objects_per_category: int,
    first_seed: int = 0,
    constraints: Constraints = NO_CONSTRAINTS,
) -> list[FamilySource]:
    """The same number of procedural objects of each category, seeds counting up from ``first_seed``.

    Constraints are those of :func:`artsim.make`, and hold of every object.

    Raises
    ------
    ConfigError
        When a category is unknown, or the number is not positive.
    """
    categories = listed(categories)
    unknown = sorted(set(categories) - FAMILIES.keys())
    if unknown:
        raise ConfigError(
            f"there is no category {', '.join(unknown)}",
            "categories",
            f"{name_fix(unknown[0], [*sorted(FAMILIES), 'all'])}; artsim families describes them",
        )
    if objects_per_category < 1:
        raise ConfigError(f"{objects_per_category} is not a count", "objects_per_category", "use 1 or more")
    seeds = range(first_seed, first_seed + objects_per_category)
    return [FamilySource(category, seed, constraints) for category in dict.fromkeys(categories) for seed in seeds]


def find_sources(
    paths: Sequence[str | Path] | str | Path,
    package_roots: Mapping[str, Path] | None = None,
    body: str | None = None,
) -> list[FileSource]:
    """Every object below some paths, in a stable order.

    Parameters
    ----------
    paths : path, or sequence of path
        URDF, MJCF, USD and joint files, object folders, or folders of object folders: below a folder, every
        ``mobility.urdf`` is taken, where there is none, every ``*.urdf``, and where there is none of these,
        ``mobility.xml`` (MJCF), ``mobility.usda`` (USD), ``mobility_v3.json``, ``mobility_v2.json`` or
        ``motion_attributes.json``.
    package_roots : mapping, optional
    body : str, optional
        Of scenes of several objects; see :func:`artsim.load`.

    Raises
    ------
    AssetError
        When a path does not exist or holds no object.
    """
    from artsim.loading.meshes import LoadLimits
    from artsim.loading.object_files import find_urdf, max_bytes, read_urdf

    sources = []
    every: list[str | Path] = listed(paths)
    for given in (Path(path).absolute() for path in every):
        if given.is_dir():
            found = _below(given)
            if not found:
                raise AssetError(
                    "no URDF, MJCF, USD or joint file below this folder", given, "name a folder that holds some"
                )
        else:
            found = [find_urdf(given)]
        for file in found:
            name = (file.relative_to(given.parent) if given.is_dir() else Path(file.parent.name, file.name)).as_posix()
            data = read_urdf(file, max_bytes(file, LoadLimits()))
            sources.append(FileSource(file, name, hashlib.sha256(data).hexdigest(), dict(package_roots or {}), body))
    return sources


def _below(folder: Path) -> list[Path]:
    from artsim.loading.object_files import OTHER_FILES

    found = []
    visited = set()

    def refuse(error: OSError) -> None:
        raise AssetError(f"cannot list ({error.strerror})", error.filename, "correct its permissions") from error

    for here, folders, files in os.walk(folder, onerror=refuse, followlinks=True):
        real = os.path.realpath(here)
        if real in visited:  # links that go round in a circle
            folders.clear()
            continue
        visited.add(real)
        folders.sort()
        whole = next((name for name in ("mobility.urdf", *OTHER_FILES) if name in files), None)
        urdf = sorted(name for name in files if name.endswith(".urdf"))
        if whole == "mobility.urdf" or (whole is not None and not urdf):
            found.append(Path(here) / whole)
            folders.clear()
        else:
            found += [Path(here) / name for name in urdf]
    return found
