"""Convex pieces of real objects: ``python -m benchmarks.decomposition FOLDER``.

Decomposes real PartNet-Mobility objects with CoACD and puts the pieces through their gates: the volume of what is
closed, and that joints move as far as the surfaces let them. Categories come in turn, so that a part of the run stands
for all. Every object is written down when it is done, in a file: the same command goes on. With ``--drawers``, a box
is put into each of so many opened drawers, and must lie in it two seconds later (PyBullet). Prints a row for each
category, then one JSON object.
"""

from __future__ import annotations

import json
import time
import warnings
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import tyro

from artsim.checks.decomposition import check_pieces, surface_errors
from artsim.common.files import read_bounded
from artsim.common.progress import say, track
from artsim.common.tables import table
from artsim.errors import ArtsimError
from artsim.loading.decomposition import DecompositionOptions, decompose
from artsim.loading.sources import FileSource, find_sources
from artsim.loading.urdf import load
from artsim.model.kinematics import Array
from artsim.model.objects import ArticulatedObject
from artsim.physics import PhysicsOptions, Simulation
from artsim.physics.bullet_body import BulletBody
from artsim.renderers.bullet import import_pybullet
from benchmarks.variation import in_turn

_MAX_RECORD = 100_000_000
_SECONDS = 2.0  # that a box is given to fall, or to slide out
_SIDE = 0.12  # of a box, over the least side of its drawer
_GRID = 7  # places along a drawer's sides at which a box is tried


@dataclass(frozen=True)
class Options:
    """Decomposition of real objects."""

    partnet: tyro.conf.Positional[Path]
    """Folder of PartNet-Mobility objects."""
    objects: int = 0
    """Objects, categories in turn; 0 takes all. Drawers are looked for in all."""
    drawers: int = 20
    """Opened drawers that a box is put into."""
    record: Path = Path("out/decomposition.jsonl")
    """File of what is done. Another file makes a run of its own."""
    decomposition: DecompositionOptions = field(default_factory=DecompositionOptions)


def main(options: Options) -> None:
    """Decompose, and print."""
    warnings.filterwarnings("ignore", category=RuntimeWarning)  # trimesh, on surfaces without a volume
    every = in_turn(find_sources([options.partnet]))
    sources = every[: options.objects] if options.objects else every
    rows = {row["name"]: row for row in _read(options.record)}
    options.record.parent.mkdir(parents=True, exist_ok=True)
    with options.record.open("a") as file:
        waiting = [source for source in sources if source.name not in rows]
        for source in track("decomposed", waiting, unit="object"):
            rows[source.name] = measure(source, options.decomposition)
            file.write(json.dumps(rows[source.name]) + "\n")
            file.flush()
    chosen = [rows[source.name] for source in sources]
    print("\n".join(_report(chosen)))
    boxes = try_drawers(every, options) if options.drawers else []
    print(json.dumps({**_totals(chosen), "drawers": len(boxes), "boxes_that_stay": sum(boxes)}))


def measure(source: FileSource, options: DecompositionOptions) -> dict[str, Any]:
    """What became of an object: pieces and processor time, volume errors of parts, and overlaps."""
    obj = source.load()
    start = time.process_time()
    decomposed = decompose(obj, options, progress=False)
    seconds = time.process_time() - start
    gates = check_pieces(obj, decomposed)
    return {
        "name": source.name,
        "category": source.path.parent.parent.name,
        "parts": len(obj),
        "pieces": sum(len(part.body.pieces) for part in decomposed.parts if part.body is not None),
        "seconds": round(seconds, 2),
        "closed_parts": len(gates.volume_errors),
        "volume_errors": [round(error, 4) for error in surface_errors(obj, options)],
        "overlaps": [round(overlap.depth / obj.diagonal, 4) for overlap in gates.overlaps],
    }


def _read(record: Path) -> list[dict[str, Any]]:
    """Objects that an earlier run has done; a line that it was stopped in is done again."""
    if not record.is_file():
        return []
    rows = []
    for line in read_bounded(record, _MAX_RECORD, "record").decode().splitlines():
        try:
            rows.append(json.loads(line))
        except ValueError:
            continue
    return rows


def _totals(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    errors = [error for row in rows for error in row["volume_errors"]]
    return {
        "objects": len(rows),
        "pieces": sum(row["pieces"] for row in rows),
        "seconds": round(sum(row["seconds"] for row in rows), 1),
        "closed_parts": sum(row["closed_parts"] for row in rows),
        "closed_surfaces": len(errors),
        "volume_within_5_percent": round(sum(abs(error) <= 0.05 for error in errors) / max(len(errors), 1), 4),
        "sweep_passed": round(sum(not row["overlaps"] for row in rows) / max(len(rows), 1), 4),
    }


def _report(rows: Sequence[dict[str, Any]]) -> list[str]:
    """A table with a row for each category, and one for all."""
    groups: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for row in rows:
        groups[row["category"]].append(row)
    lines: list[tuple[str, ...]] = [("category", "objects", "parts", "pieces", "s each", "closed", "5 %", "sweep")]
    for name, group in [*sorted(groups.items()), ("all", list(rows))]:
        total = _totals(group)
        lines.append(
            (
                name, str(total["objects"]), str(sum(row["parts"] for row in group)), str(total["pieces"]),
                f"{total['seconds'] / max(len(group), 1):.1f}", str(total["closed_surfaces"]),
                f"{100 * total['volume_within_5_percent']:.0f} %" if total["closed_surfaces"] else "-",
                f"{100 * total['sweep_passed']:.0f} %",
            )
        )  # fmt: skip
    return table(lines, left=1, most=len(lines))


# --- boxes in drawers ---


def try_drawers(sources: Sequence[FileSource], options: Options) -> list[bool]:
    """Whether a box stays in each of the first drawers that a box fits into."""
    found: list[bool] = []
    for source in track("drawers", sources, unit="object"):
        for obj, k in drawers(source):
            stays = box_stays(decompose(obj, options.decomposition, progress=False), k)
            if stays is None:
                continue
            found.append(stays)
            if not stays:
                say(f"a box does not stay in {obj.parts[k].name} of {source.name}")
            if len(found) == options.drawers:
                return found
    return found


def drawers(source: FileSource) -> Iterator[tuple[ArticulatedObject, int]]:
    """Drawers of an object, and their parts; with the annotation's joints where the URDF file has fewer."""
    file = source.path.parent / "mobility_v2.json"
    try:
        obj = load(file if file.is_file() else source.path)
    except ArtsimError:
        obj = source.load()
    for k, (part, joint) in enumerate(zip(obj.parts, obj.tree.joints, strict=True)):
        if joint.type == "prismatic" and "drawer" in part.label and joint.upper - joint.lower > 0.05:
            yield obj, k


def box_stays(obj: ArticulatedObject, k: int) -> bool | None:
    """Whether a box that is put into opened part k lies within it later; None where there is no place for it.

    The part's own surface says where a place is: open above, with a floor below and walls on all sides.
    """
    bullet = import_pybullet()
    opened = obj.tree.rest.copy()
    opened[k] = max(obj.tree.limits[k], key=lambda end: abs(end - obj.tree.rest[k]))
    opened = obj.tree.complete_state(opened)
    T = obj.tree.forward_kinematics(opened)[k]
    half = 0.5 * _SIDE * float(obj.box_size[k].min())
    place = find_place(obj, k, half)
    if place is None:
        return None
    simulation = Simulation(obj, PhysicsOptions(engine="pybullet"))
    assert isinstance(simulation.body, BulletBody)
    simulation.reset(opened)
    client = {"physicsClientId": simulation.body.client}
    shape = bullet.createCollisionShape(bullet.GEOM_BOX, halfExtents=[half] * 3, **client)
    start = T[:3, :3] @ place + T[:3, 3]
    box = bullet.createMultiBody(0.05 / simulation.body.mass_unit, shape, basePosition=start.tolist(), **client)
    for _ in range(round(_SECONDS / simulation.options.control_step)):
        simulation.step(np.zeros(len(obj.tree.free_joints)))
    at = np.array(bullet.getBasePositionAndOrientation(box, **client)[0])
    T_now = obj.tree.forward_kinematics(simulation.state)[k]
    inside = np.linalg.inv(T_now)[:3, :3] @ (at - T_now[:3, 3]) - obj.box_center[k]
    simulation.close()
    return bool(np.all(np.abs(inside) < 0.5 * obj.box_size[k]))


def find_place(obj: ArticulatedObject, k: int, half: float) -> Array | None:
    """(3,) place of a box above the floor of part k, rest frame: the one that is farthest from its walls."""
    mesh = obj.part_mesh(k)
    low, high = obj.part_bounds[k]
    sides = np.linspace(0.1, 0.9, _GRID)
    grid = np.stack(np.meshgrid(*(low[a] + sides * (high[a] - low[a]) for a in (0, 1))), axis=-1).reshape(-1, 2)
    above = np.column_stack([grid, np.full(len(grid), high[2] + half)])
    floors = _first_hit(mesh, above, (0, 0, -1))
    best, place = half * 2.0, None
    for origin, drop in zip(above, floors, strict=True):
        floor = origin[2] - drop
        if not np.isfinite(drop) or high[2] - floor < 3.0 * half:
            continue
        center = np.array([*origin[:2], floor + 1.5 * half])
        walls = [
            float(_first_hit(mesh, center[None], way)[0]) for way in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))
        ]
        if np.isfinite(walls).all() and min(walls) > best:
            best, place = min(walls), center
    return place


def _first_hit(mesh: Any, origins: Array, way: Sequence[float]) -> Array:
    """(N,) distances at which rays meet a mesh; infinite where they do not."""
    found = np.full(len(origins), np.inf)
    places, rays, _ = mesh.ray.intersects_location(origins, np.tile(way, (len(origins), 1)), multiple_hits=False)
    found[rays] = np.linalg.norm(places - origins[rays], axis=1)
    return found


if __name__ == "__main__":
    main(tyro.cli(Options, description=__doc__))
