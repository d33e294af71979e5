"""Runs of ``artsim vary``: many variations of one object as files, resumably.

Each variation has a folder of its own, named by its seed, which is made under another name and renamed once it is
whole. Its ``meta.json`` says from what and how it was varied.
"""

import hashlib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from artsim.checks.strict_urdf import convex_collision_geometry, strict_inertia, strict_urdf
from artsim.common.progress import track
from artsim.common.tables import plural, table
from artsim.errors import AssetError
from artsim.export import check_formats, export
from artsim.export.folders import new_folder, remove_unfinished, whole_meta
from artsim.loading.collision_bodies import read_bodies
from artsim.loading.object_files import find_urdf, is_urdf
from artsim.loading.sources import find_sources
from artsim.loading.urdf import load
from artsim.model.convex_bodies import add_surface_bodies
from artsim.model.objects import ArticulatedObject
from artsim.runs.lock import folder_lock
from artsim.runs.recipe import check_counts
from artsim.variation.operations import OPERATIONS
from artsim.variation.search import Variation, check_variable, draw_variation
from artsim.variation.standard import Standard

_FILE_GATES: dict[str, Callable[[Path, Mapping[str, Path] | None], list[str]]] = {
    "strict URDF": strict_urdf,
    "convex collision geometry": convex_collision_geometry,
    "inertia": lambda path, package_roots: strict_inertia(path),
}
"""Gates of a file that stand besides those of the object that it describes."""
_STRENGTH = 0.3
"""Of variations of a procedural object, if nothing else is asked for."""


@dataclass
class VariationSummary:
    """What a run has come to."""

    folder: Path
    gates: tuple[str, ...]
    """That variations pass."""
    made: int = 0
    """Variations that were made now."""
    notes: list[dict[str, Any]] = field(default_factory=list)
    """What ``meta.json`` says of each variation."""
    failed: list[str] = field(default_factory=list)
    """Variations that no draw of passes, and why."""

    @property
    def trees(self) -> set[str]:
        """Digests of different trees with all their numbers."""
        return {own["tree"] for own in self.notes}

    def __str__(self) -> str:
        draws = [1 + len(own["rejected"]) for own in self.notes]
        rejected = Counter(gate for own in self.notes for gate in own["rejected"])
        used = Counter(name for own in self.notes for name in {step["operation"] for step in own["operations"]})
        first = draws.count(1)
        rows = [
            ("variations", str(len(draws))),
            ("made now", str(self.made)),
            ("passed at the first draw", f"{first} ({100 * first / max(1, len(draws)):.0f} %)"),
            ("draws", str(sum(draws))),
            *((f"rejected: {gate}", str(number)) for gate, number in sorted(rejected.items())),
            *((f"operation: {name}", str(used[name])) for name in (*OPERATIONS, "parameters", "between") if used[name]),
            ("different trees", str(len(self.trees))),
            ("different topologies", str(len({own["topology"] for own in self.notes}))),
            ("without a variation", str(len(self.failed))),
        ]
        return "\n".join([f"gates: {', '.join(self.gates)}", *table([("", "number"), *rows])])


def write_variations(
    path: str | Path,
    out: str | Path,
    count: int = 10,
    seed: int = 0,
    others: Sequence[str | Path] = (),
    formats: Sequence[str] = ("urdf",),
    package_roots: Mapping[str, Path] | None = None,
    progress: bool = True,
    strength: float | None = None,
    towards: str | Path | None = None,
) -> VariationSummary:
    """Write variations of an object as files, or resume a run that was stopped.

    Parameters
    ----------
    path : path
        URDF, MJCF, USD, GLB or joint file, or its folder.
    out : path
        Folder; made if missing. Each variation goes to a folder of its own, named by its seed.
    count : int
        Variations.
    seed : int
        Of the first; the others count up from it.
    others : sequence of path
        Objects of the same category, or folders of them, whose parts may be exchanged for the object's.
    formats : sequence of str
        Keys of ``artsim.export.FORMATS``.
    package_roots : mapping, optional
        As for :func:`artsim.load`.
    progress : bool
        Show progress.
    strength : float, optional
        Of a procedural object: vary its parameters, so far as a share of their ranges.
    towards : path, optional
        Of a procedural object: go in equal steps to this one of its category, which is not reached.

    Raises
    ------
    AssetError
        When an object cannot be loaded or has no joint that can move, or there is no other of its category.
    ConfigError
        When an option makes no sense, or the folder cannot be written to.
    DatasetError
        When another run is writing there.
    KeyboardInterrupt
        On Ctrl-C; the same call resumes.
    """
    check_counts(count=count)
    check_formats(formats)
    obj, file_gates = load_with_bodies(path, package_roots)
    check_variable(obj, seed)
    donors = _load_others(obj, others, package_roots)
    goal = None if towards is None else load(towards, package_roots=package_roots)
    if obj.params is not None and goal is None and not donors:
        strength = _STRENGTH if strength is None else strength
    standard = Standard.of(obj)
    folder = Path(out)
    summary = VariationSummary(folder, tuple(dict.fromkeys([*standard.gates, *file_gates])))
    origin = {
        "category": obj.category,
        "object_id": obj.object_id,
        "sha256": obj.sha256,
        "others": hashlib.sha256(" ".join(donor.sha256 for donor in donors).encode()).hexdigest() if donors else "",
    }
    if goal is not None or strength is not None:
        origin |= {"strength": str(strength or 0.0), "towards": "" if goal is None else f"{goal.sha256} {count} {seed}"}
    with folder_lock(folder), track("variations", total=count, unit="object", shown=progress) as bar:
        remove_unfinished(folder)
        for number in range(seed, seed + count):
            notes = _whole(folder / str(number), origin, number, formats)
            if notes is None:
                try:
                    between = None if goal is None else (goal, (number - seed + 1) / (count + 1))
                    draw = partial(draw_variation, obj, number, donors, standard, strength, between)
                    notes = _write(draw, folder, number, file_gates, formats, origin)
                    summary.made += 1
                except AssetError as error:
                    summary.failed.append(str(error))
            if notes is not None:
                summary.notes.append(notes)
            bar.update()
    return summary


def load_with_bodies(
    path: str | Path, package_roots: Mapping[str, Path] | None = None
) -> tuple[ArticulatedObject, tuple[str, ...]]:
    """An object with the bodies that its file describes, and the gates of a file that the file passes.

    Where the collision geometry or the inertia of the file fails its gate, parts have no body.
    """
    obj = load(path, package_roots=package_roots)
    if obj.params is not None:
        return obj, tuple(_FILE_GATES)
    file = find_urdf(Path(path))
    if not is_urdf(file):  # an object file has no bodies; other formats give them with the object
        return obj, ()
    gates = tuple(name for name, gate in _FILE_GATES.items() if not gate(file, package_roots))
    at_zero = not np.any(obj.tree.rest)
    if {"convex collision geometry", "inertia"} <= set(gates) and at_zero:
        obj = read_bodies(obj, file, package_roots)
    return obj, gates


def write_variation(variation: Variation, folder: Path, formats: Sequence[str], notes: dict[str, Any]) -> None:
    """Write one variation: parts without a body collide as their surface, and weigh as their convex hull."""
    export(add_surface_bodies(variation.obj), folder, formats, {"variation": notes})


def describe_variation(variation: Variation, origin: dict[str, Any], seed: int) -> dict[str, Any]:
    """What ``meta.json`` says of a variation."""
    tree = variation.obj.native_tree
    topology = " ".join(f"{joint.type}:{joint.parent}" for joint in tree.joints)
    return {
        "of": origin,
        "seed": seed,
        "version": version("artsim"),
        "operations": list(variation.operations),
        "rejected": list(variation.rejected),
        "gates": list(variation.gates),
        "tree": hashlib.sha256(repr(tree.to_dict()).encode()).hexdigest(),
        "topology": topology,
    }


def _load_others(
    obj: ArticulatedObject, paths: Sequence[str | Path], package_roots: Mapping[str, Path] | None
) -> list[ArticulatedObject]:
    """Other objects of the category; those of other categories, and the object itself, are left out."""
    if not paths:
        return []
    found = [load_with_bodies(source.path, package_roots)[0] for source in find_sources(paths, package_roots)]
    donors = [other for other in found if other.category == obj.category and other.sha256 != obj.sha256]
    if not donors:
        raise AssetError(
            f"none of {plural(len(found), 'object')} is another {obj.category}",
            ", ".join(map(str, paths)),
            "name a folder with objects of the same category",
        )
    return donors


def _whole(folder: Path, origin: dict[str, Any], seed: int, formats: Sequence[str]) -> dict[str, Any] | None:
    """What a variation's ``meta.json`` says, if this version of artsim made it of the same objects and seed."""

    def is_same(meta: dict[str, Any]) -> bool:
        notes = meta["variation"]
        str(VariationSummary(folder, (), 0, [notes]))  # what the summary takes from it
        return (notes["of"], notes["seed"], notes["version"]) == (origin, seed, version("artsim"))

    meta = whole_meta(folder, formats, is_same)
    return None if meta is None else dict(meta["variation"])


def _write(
    draw: Callable[[], Variation],
    out: Path,
    seed: int,
    file_gates: Sequence[str],
    formats: Sequence[str],
    origin: dict[str, Any],
) -> dict[str, Any]:
    """Make a variation and write its folder; returns what its ``meta.json`` says of it."""
    variation = draw()
    notes = describe_variation(variation, origin, seed)
    with new_folder(out / str(seed)) as folder:
        write_variation(variation, folder, formats, notes)
        gates = file_gates if "urdf" in formats else ()
        problems = [problem for name in gates for problem in _FILE_GATES[name](folder, None)]
        if problems:
            raise AssetError(f"its file is not as strict as that of the original: {problems[0]}", f"variation {seed}")
    return notes
