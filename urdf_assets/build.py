"""Build the demo objects of this folder, or of another: ``python urdf_assets/build.py [FOLDER]``. No byte ever differs.

Objects are drawn in their rest frame (metres, Z up, front towards -X) and written as PartNet-Mobility folders: Y-up
meshes, an empty ``base`` link, and joints without rotations of their own. The binary meshes of ``quirks/formats`` are
written too; all other quirk cases are written by hand. ``procedural`` holds one exported object of each family, and
``procedural.sha256`` the digests of their files, which alone is in the repository.

Last digits of the demo objects and of inertias depend on which kernels numpy and its BLAS choose for a processor.
The program starts itself anew with those that every x86-64 processor with AVX2 and FMA has.
"""

import os
import sys
from collections.abc import Sequence
from hashlib import sha256
from itertools import pairwise
from pathlib import Path

import numpy as np
import trimesh
from numpy._core._multiarray_umath import __cpu_features__
from partnet_folder import Link, Model, Vector, write
from shapely import LineString, Point, Polygon, unary_union  # type: ignore[import-untyped]
from trimesh import Trimesh as Mesh

from artsim import ArticulatedObject, make
from artsim.export import export
from artsim.families import FAMILIES

SEEDS_TO_CHOOSE_FROM = 12
KERNELS = {"OPENBLAS_CORETYPE": "Haswell", "NPY_DISABLE_CPU_FEATURES": "X86_V4 AVX512_ICL AVX512_SPR"}


# --- shapes ------------------------------------------------------------------------------------------------------


def box(low: Vector, high: Vector) -> Mesh:
    """Axis-aligned box between two corners."""
    return trimesh.creation.box(bounds=[low, high])


def rod(start: Vector, end: Vector, radius: float, sections: int = 24) -> Mesh:
    """Cylinder between two points."""
    return trimesh.creation.cylinder(radius, segment=[start, end], sections=sections)


def plate(outline: Polygon, low: float, high: float) -> Mesh:
    """A polygon of the XY plane, extruded from one height to another."""
    mesh = trimesh.creation.extrude_polygon(outline, high - low)
    mesh.apply_translation([0, 0, low])
    return mesh


def upright(outline: Polygon, x_low: float, x_high: float) -> Mesh:
    """A polygon of the YZ plane, extruded along X."""
    mesh = plate(outline, x_low, x_high)
    mesh.apply_transform([[0, 0, 1, 0], [1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    return mesh


def joined(solids: Sequence[Mesh]) -> Mesh:
    """One mesh of several solids, each of which stays closed."""
    return trimesh.util.concatenate(list(solids))


def along_y(point: Vector, distance: float) -> Vector:
    """A point moved along Y."""
    return (point[0], point[1] + distance, point[2])


def rounded(width: float, depth: float, radius: float, center: Vector = (0, 0)) -> Polygon:
    """Rectangle with round corners."""
    half = np.array([width, depth]) / 2 - radius
    corners = [(sx * half[0] + center[0], sy * half[1] + center[1]) for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    return Polygon(corners).buffer(radius, quad_segs=6)


# --- the objects ---------------------------------------------------------------------------------------------------


KEYBOARD = (
    (1.0,) * 15,
    (*(1.0,) * 13, 2.0),
    (1.5, *(1.0,) * 12, 1.5),
    (1.75, *(1.0,) * 11, 2.25),
    (2.25, *(1.0,) * 10, 2.75),
    (1.25, 1.25, 1.25, 6.25, 1.25, 1.25, 1.25, 1.25),
)
"""Widths of the keys of each row from the back to the front, in units of one key."""


def keyboard(x: float, z: float, pitch: float = 0.0192, gap: float = 0.0026, height: float = 0.0014) -> list[Mesh]:
    """Rows of keys on a deck; the last row's middle is at ``x``, the first row's further back."""
    rows = []
    for number, widths in enumerate(reversed(KEYBOARD)):
        middle, edges = x + number * pitch, (np.cumsum([0.0, *widths]) - sum(widths) / 2) * pitch
        front, back = middle - (pitch - gap) / 2, middle + (pitch - gap) / 2
        keys = [box([front, -y1 + gap / 2, z], [back, -y0 - gap / 2, z + height]) for y0, y1 in pairwise(edges)]
        rows.append(joined(keys))
    return rows


def laptop() -> Model:
    """Base with keyboard and touchpad, lid with screen; the file's zero is the lid standing upright."""
    width, depth, base_height, lid_height, gap = 0.330, 0.225, 0.016, 0.007, 0.0024
    barrel, shaft = 0.0042, 0.0036
    hinge = np.array([depth / 2 + 0.001, 0, base_height + 0.0015])
    outline = rounded(depth, width, 0.012)
    room = rounded(2 * shaft + 0.0016, 0.174, 0.001, hinge)
    base = [("base_frame", plate(outline.difference(room), 0, base_height))]
    base += [("keyboard", row) for row in keyboard(-0.018, base_height)]
    base.append(("touchpad", plate(rounded(0.060, 0.105, 0.004, (-0.068, 0)), base_height, base_height + 0.0004)))
    base += [("foot", rod([x, y, -0.002], [x, y, 0], 0.008)) for x in (-0.09, 0.09) for y in (-0.14, 0.14)]
    base += [("shaft", rod(along_y(hinge, y - 0.022), along_y(hinge, y + 0.022), barrel)) for y in (-0.11, 0.11)]
    bottom, top = base_height + gap, base_height + gap + lid_height
    notches = unary_union([rounded(0.02, 0.05, 0.001, (depth / 2 + 0.004, y)) for y in (-0.11, 0.11)])
    lid = [
        ("screen_frame", plate(outline.difference(notches), bottom, top)),
        ("screen", plate(rounded(depth - 0.034, width - 0.02, 0.002, (-0.001, 0)), bottom - 0.0004, bottom)),
        ("camera", rod([-depth / 2 + 0.008, 0, bottom - 0.0004], [-depth / 2 + 0.008, 0, bottom], 0.0022)),
        ("shaft", rod(along_y(hinge, -0.085), along_y(hinge, 0.085), shaft)),
    ]
    upright_lid = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0], hinge)
    for _, solid in lid:
        solid.apply_transform(upright_lid)
    return Model(
        "Laptop",
        [
            Link("link_0", "base_body", base),
            Link("link_1", "screen", lid, "link_0", "revolute", hinge, (0, 1, 0), (-np.pi / 2, 0.7)),
        ],
    )


def cabinet() -> Model:
    """Body with three open-topped drawers."""
    width, depth, height, board, back = 0.48, 0.42, 0.66, 0.018, 0.008
    x0, x1, y0, y1 = -depth / 2, depth / 2, -width / 2, width / 2
    body = [
        ("side", box([x0, y0, 0], [x1, y0 + board, height])),
        ("side", box([x0, y1 - board, 0], [x1, y1, height])),
        ("top", box([x0 - 0.012, y0 - 0.01, height], [x1, y1 + 0.01, height + board])),
        ("bottom", box([x0, y0 + board, 0], [x1, y1 - board, board])),
        ("back", box([x1 - back, y0 + board, board], [x1, y1 - board, height])),
    ]
    body += [
        ("leg", rod([x, y, -0.08], [x, y, 0], 0.014)) for x in (x0 + 0.04, x1 - 0.04) for y in (y0 + 0.04, y1 - 0.04)
    ]
    links = [Link("link_0", "cabinet_frame", body)]
    shares = np.array([0.24, 0.33, 0.43])
    opening = height - board
    tops = height - np.concatenate([[0], np.cumsum(shares)]) * opening
    for number, (top, bottom) in enumerate(pairwise(tops), start=1):
        low, high = bottom + 0.004, top - 0.004
        inner0, inner1, end = y0 + board + 0.006, y1 - board - 0.006, x1 - back - 0.02
        wall, rim = 0.010, low + 0.72 * (high - low)
        drawer = [
            ("front", box([x0 - board, y0 + 0.002, low], [x0 - 0.001, y1 - 0.002, high])),
            ("bottom", box([x0 - 0.001, inner0, low + 0.02], [end, inner1, low + 0.028])),
            ("side", box([x0 - 0.001, inner0, low + 0.028], [end, inner0 + wall, rim])),
            ("side", box([x0 - 0.001, inner1 - wall, low + 0.028], [end, inner1, rim])),
            ("back", box([end - wall, inner0 + wall, low + 0.028], [end, inner1 - wall, rim])),
        ]
        middle, face = 0.5 * (low + high), x0 - board
        drawer.append(("handle", rod([face - 0.026, -0.07, middle], [face - 0.026, 0.07, middle], 0.006)))
        drawer += [("handle", rod([face - 0.026, y, middle], [face, y, middle], 0.005)) for y in (-0.055, 0.055)]
        links.append(Link(f"link_{number}", "drawer", drawer, "link_0", "prismatic", (0, 0, 0), (-1, 0, 0), (0, 0.3)))
    return Model("StorageFurniture", links)


def eyeglasses() -> Model:
    """Two rims with lenses, bridge, nose pads and two legs; zero is open."""
    thickness, spread = 0.004, 0.034
    rims = []
    for side in (-1, 1):
        lens = Polygon(
            [
                (
                    side * spread + 0.026 * np.sign(np.cos(a)) * abs(np.cos(a)) ** 0.75,
                    0.0205 * np.sign(np.sin(a)) * abs(np.sin(a)) ** 0.75,
                )
                for a in np.linspace(0, 2 * np.pi, 48, endpoint=False)
            ]
        )
        rims.append(("rim", upright(lens.buffer(0.0035).difference(lens), -thickness / 2, thickness / 2)))
        rims.append(("lens", upright(lens.buffer(0.0005), -0.0006, 0.0006)))
    bridge = LineString([(-0.010, 0.006), (-0.004, 0.0105), (0.004, 0.0105), (0.010, 0.006)]).buffer(0.0018)
    frame = [*rims, ("bridge", upright(bridge, -thickness / 2, thickness / 2))]
    # One leg's hinge stands further back, so that folded legs lie on each other.
    hinges = [np.array([x, side * (spread + 0.0340), 0.009]) for x, side in ((0.0095, -1), (0.0132, 1))]
    for side, hinge in zip((-1, 1), hinges, strict=True):
        pad = trimesh.creation.icosphere(2, 1.0)
        pad.apply_scale([0.0022, 0.0016, 0.0045])
        pad.apply_translation([0.0055, side * 0.0085, -0.006])
        arm = rod([0.0005, side * 0.0098, -0.003], [0.005, side * 0.0088, -0.005], 0.0007, 10)
        frame += [("nose_pad", pad), ("nose_pad_arm", arm)]
        y = side * (spread + 0.0285)
        frame.append(
            (
                "end_piece",
                box(
                    [-thickness / 2, min(y, y + side * 0.008), 0.006],
                    [hinge[0] - 0.0048, max(y, y + side * 0.008), 0.012],
                ),
            )
        )
    links = [Link("link_0", "glasses_body", frame)]
    for number, (side, hinge) in enumerate(zip((-1, 1), hinges, strict=True), start=1):
        x, outer, _ = hinge
        ear = [(0.098, 0.0075), (0.112, 0.0035), (0.122, -0.003), (0.131, -0.012), (0.138, -0.023)]
        stem = LineString([(x - 0.0015, 0.009), (0.055, 0.0088), *ear]).buffer(0.0026, quad_segs=4)
        outline = stem.union(LineString(ear[1:]).buffer(0.0036, quad_segs=4))
        temple = plate(outline, outer - 0.0013, outer + 0.0013)
        temple.apply_transform([[1, 0, 0, 0], [0, 0, -1, 2 * outer], [0, 1, 0, 0], [0, 0, 0, 1]])
        leg = [("leg", temple), ("hinge", rod((x, outer, 0.006), (x, outer, 0.012), 0.0019, 16))]
        links.append(Link(f"link_{number}", "leg", leg, "link_0", "revolute", hinge, (0, 0, -side), (0, np.pi / 2)))
    return Model("Eyeglasses", links)


def dishwasher() -> Model:
    """Hollow tub, door hinged at its bottom edge, two wire racks that slide out."""
    width, depth, height, wall = 0.598, 0.56, 0.82, 0.022
    x0, x1, y0, y1, kick = -depth / 2, depth / 2, -width / 2, width / 2, 0.10
    body = [
        ("side", box([x0, y0, kick], [x1, y0 + wall, height])),
        ("side", box([x0, y1 - wall, kick], [x1, y1, height])),
        ("top", box([x0, y0 + wall, height - wall], [x1, y1 - wall, height])),
        ("bottom", box([x0, y0 + wall, kick], [x1, y1 - wall, kick + wall])),
        ("back", box([x1 - wall, y0 + wall, kick + wall], [x1, y1 - wall, height - wall])),
        ("plinth", box([x0 + 0.05, y0 + 0.01, 0], [x1 - 0.02, y1 - 0.01, kick])),
        ("spray_arm", box([-0.2, -0.02, kick + wall + 0.012], [0.2, 0.02, kick + wall + 0.022])),
        ("spray_arm_hub", rod([0, 0, kick + wall], [0, 0, kick + wall + 0.012], 0.03)),
    ]
    face, inner = x0 - 0.045, x0 - 0.002
    door = [
        ("door_frame", box([face, y0, kick + 0.012], [inner, y1, height - 0.10])),
        ("control_panel", box([face, y0, height - 0.098], [inner, y1, height])),
        (
            "door_lining",
            box([inner, y0 + wall + 0.03, kick + wall + 0.07], [inner + 0.0012, y1 - wall - 0.03, height - 0.13]),
        ),
        ("handle", rod([face - 0.035, y0 + 0.08, height - 0.135], [face - 0.035, y1 - 0.08, height - 0.135], 0.008)),
    ]
    door += [
        ("handle", rod([face - 0.035, y, height - 0.135], [face, y, height - 0.135], 0.006)) for y in (-0.19, 0.19)
    ]
    door += [
        ("button", rod([face - 0.003, y, height - 0.05], [face, y, height - 0.05], 0.009))
        for y in (0.14, 0.17, 0.2, 0.23)
    ]
    door.append(("display", box([face - 0.001, -0.06, height - 0.066], [face, 0.06, height - 0.034])))
    hinge = (x0 - 0.02, 0.0, kick + 0.012)
    links = [
        Link("link_0", "dishwasher_body", body),
        Link("link_1", "door", door, "link_0", "revolute", hinge, (0, -1, 0), (0, np.pi / 2)),
    ]
    for number, (low, deep) in enumerate(((kick + 0.075, 0.12), (kick + 0.36, 0.10)), start=2):
        rack = wire_rack([x0 + 0.012, y0 + wall + 0.015, low], [x1 - wall - 0.02, y1 - wall - 0.015, low + deep])
        if number == 2:
            rack.append(("cutlery_basket", cutlery_basket([-0.21, y0 + wall + 0.03, low + 0.003], [0.10, 0.13, 0.115])))
        links.append(Link(f"link_{number}", "rack", rack, "link_0", "prismatic", (0, 0, 0), (-1, 0, 0), (0, 0.38)))
    return Model("Dishwasher", links)


def wire_rack(low: Vector, high: Vector, wire: float = 0.0022) -> list[tuple[str, Mesh]]:
    """An open basket of wires between two corners."""
    (ax, ay, az), (bx, by, bz) = low, high
    wires = [[[ax, y, az], [bx, y, az]] for y in np.linspace(ay, by, 9)]
    wires += [[[x, ay, az], [x, by, az]] for x in np.linspace(ax, bx, 9)]
    wires += [[[x, y, az], [x, y, bz]] for x in np.linspace(ax, bx, 7) for y in (ay, by)]
    wires += [[[x, y, az], [x, y, bz]] for y in np.linspace(ay, by, 7)[1:-1] for x in (ax, bx)]
    for z in (0.5 * (az + bz), bz):
        wires += [[[ax, y, z], [bx, y, z]] for y in (ay, by)] + [[[x, ay, z], [x, by, z]] for x in (ax, bx)]
    wires += [
        [[x, y, az], [x, y, az + 0.055]] for x in np.linspace(ax, bx, 9)[1:-1] for y in np.linspace(ay, by, 9)[2:-2:2]
    ]
    return [("wires", joined([rod(start, end, wire, 6) for start, end in wires]))]


def cutlery_basket(corner: Vector, size: Vector, wall: float = 0.002) -> Mesh:
    """A box of three open compartments."""
    (x, y, z), (dx, dy, dz) = corner, size
    pockets = [
        box([x + wall, a + wall / 2, z + wall], [x + dx - wall, b - wall / 2, z + dz + wall])
        for a, b in pairwise(np.linspace(y + wall / 2, y + dy - wall / 2, 4))
    ]
    return trimesh.boolean.difference([box(corner, np.add(corner, size)), *pockets], engine="manifold")


def scissors() -> Model:
    """Two halves that cross at the pivot, lying flat with their points at +Y; zero is closed.

    As in PartNet-Mobility, the root's ring is the one towards -X.
    """

    def half(side: int, low: float, high: float, pivot_hole: float) -> list[tuple[str, Mesh]]:
        def mirrored(points: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
            return [(side * y, -x) for x, y in points]

        blade = Polygon(
            mirrored([(-0.098, 0.0006), (-0.012, 0.0022), (0.004, 0.007), (0.008, 0), (0, -0.0082), (-0.02, -0.0088)])
        )
        shank = LineString(mirrored([(0, 0), (0.018, 0.004), (0.036, 0.0165)])).buffer(0.0058)
        steel = unary_union([blade.buffer(0.0004), shank])
        if pivot_hole:
            steel = steel.difference(Point(0, 0).buffer(pivot_hole))
        center = (side * 0.0265, -0.064)
        eye = ellipse(center, 0.0195, 0.034).difference(ellipse(center, 0.0130, 0.0275))
        return [("blade", plate(steel, low, high)), ("handle", plate(eye, low - 0.002, high + 0.002))]

    lower = half(1, 0.0, 0.0024, 0.0)
    lower += [
        ("screw", rod([0, 0, 0.0024], [0, 0, 0.0056], 0.0034)),
        ("screw", rod([0, 0, 0.0056], [0, 0, 0.0068], 0.0055)),
    ]
    upper = half(-1, 0.0028, 0.0052, 0.0038)
    links = [
        Link("link_0", "blade", upper),
        Link("link_1", "blade", lower, "link_0", "revolute", (0, 0, 0), (0, 0, 1), (0, 0.9)),
    ]
    return Model("Scissors", links)


def ellipse(center: Vector, half_x: float, half_y: float) -> Polygon:
    """Ellipse of the XY plane."""
    turns = np.linspace(0, 2 * np.pi, 48, endpoint=False)
    return Polygon([(center[0] + half_x * np.cos(a), center[1] + half_y * np.sin(a)) for a in turns])


MODELS = {
    "laptop": laptop,
    "cabinet": cabinet,
    "eyeglasses": eyeglasses,
    "dishwasher": dishwasher,
    "scissors": scissors,
}


def write_formats(folder: Path) -> None:
    """One ramp with a corner at the origin, so that a swapped or flipped axis would show, in three binary formats."""
    folder.mkdir(parents=True, exist_ok=True)
    ramp = upright(Polygon([(0, 0), (0.1, 0), (0.1, 0.2), (0, 0.1)]), 0, 0.3)
    for kind in ("stl", "glb", "ply"):
        (folder / f"ramp.{kind}").write_bytes(ramp.export(file_type=kind))


def write_procedural(folder: Path) -> None:
    """One procedural object of each category, the smallest file of the first few seeds; and the digests of their files.

    A line of the list is as ``sha256sum`` writes it.
    """
    for category in sorted(FAMILIES):
        objects = [make(category, seed) for seed in range(SEEDS_TO_CHOOSE_FROM)]
        export(min(objects, key=shape_size), folder / category)
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    lines = (f"{sha256(path.read_bytes()).hexdigest()}  {path.relative_to(folder).as_posix()}\n" for path in files)
    folder.with_suffix(".sha256").write_text("".join(lines))


def shape_size(obj: ArticulatedObject) -> int:
    """Triangles of the object's surfaces and collision geometry."""
    return obj.num_faces + sum(len(faces) for part in obj.parts if part.body for _, faces in part.body.pieces)


def main(folder: Path) -> None:
    """Write every object, and the meshes of ``quirks/formats``, below a folder."""
    write_procedural(folder / "procedural")
    write_formats(folder / "quirks" / "formats" / "meshes")
    for name, build in MODELS.items():
        write(build(), folder / name)


def use_common_kernels() -> None:
    """Start this program anew where numpy and its BLAS, which are loaded by now, have chosen for this processor."""
    if not __cpu_features__.get("X86_V3"):
        sys.exit("this processor has no AVX2 and FMA, or NPY_DISABLE_CPU_FEATURES names them. Fix: use another machine")
    if not os.environ.items() >= KERNELS.items():
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | KERNELS)


if __name__ == "__main__":
    use_common_kernels()
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent)
