"""COLLADA files: units, nodes, and everything that a scene leaves out."""

from __future__ import annotations

import numpy as np
import pytest

from artsim.errors import AssetError
from artsim.loading.meshes import UnusableMeshError
from tests.artsim.loading.mesh_builders import WEDGE, area, dae, dae_geometry, dae_triangles, numbers, read, volume

SQUARE = [[0, 0, 0], [4, 0, 0], [4, 4, 0], [0, 4, 0], [1, 1, 0], [1, 2, 0], [2, 2, 0], [2, 1, 0]]


CONTROLLER = '<library_controllers><controller id="k"><{} source="#g"/></controller></library_controllers>'


def bounds(text: str) -> list[list[float]]:
    vertices, faces, _ = read(text, ".dae")
    used = vertices[faces].reshape(-1, 3)
    return [used.min(axis=0).round(9).tolist(), used.max(axis=0).round(9).tolist()]


@pytest.mark.parametrize("meter", [1.0, 0.01, 0.0254, 1000.0])
def test_units_are_applied(meter: float) -> None:
    _, high = bounds(dae(asset=f'<unit name="u" meter="{meter}"/>'))
    assert high == pytest.approx([0.1 * meter, 0.2 * meter, 0.3 * meter])


def test_units_scale_the_nodes_transforms_too() -> None:
    scene = '<node><translate>1 2 3</translate><instance_geometry url="#g"/></node>'
    low, _ = bounds(dae(scene=scene, asset='<unit meter="0.01"/>'))
    assert low == pytest.approx([0.01, 0.02, 0.03])


@pytest.mark.parametrize("meter", ["0", "-1", "nan", "inf", "one"])
def test_units_that_are_no_length_are_refused(meter: str) -> None:
    with pytest.raises(UnusableMeshError, match="is no length"):
        read(dae(asset=f'<unit meter="{meter}"/>'), ".dae")


@pytest.mark.parametrize("axis", ["X_UP", "Y_UP", "Z_UP"])
def test_the_up_axis_is_not_applied_and_said(axis: str) -> None:
    text = dae(asset=f"<up_axis>{axis}</up_axis>")
    assert bounds(text)[1] == pytest.approx([0.1, 0.2, 0.3])
    assert ("up_axis" in read(text, ".dae")[2]) == (axis != "Z_UP")


ROTATED = [[-0.2, 0, 0], [0, 0.1, 0.3]]


@pytest.mark.parametrize(
    ("transform", "expected"),
    [
        ("<rotate>0 0 1 90</rotate>", ROTATED),
        ("<matrix>0 -1 0 0 1 0 0 0 0 0 1 0 0 0 0 1</matrix>", ROTATED),
        ("<translate>1 0 0</translate><rotate>0 0 2 90</rotate>", [[0.8, 0, 0], [1, 0.1, 0.3]]),
        ("<rotate>0 0 1 90</rotate><translate>1 0 0</translate>", [[-0.2, 1, 0], [0, 1.1, 0.3]]),
        ("<scale>2 3 4</scale>", [[0, 0, 0], [0.2, 0.6, 1.2]]),
        ("<rotate>0 0 0 45</rotate>", [[0, 0, 0], [0.1, 0.2, 0.3]]),
        # At (1, 0, 0), looking along +x with z up: its x is -y, its y is z, its z is -x.
        ("<lookat>1 0 0 2 0 0 0 0 1</lookat>", [[0.7, -0.1, 0], [1, 0, 0.2]]),
    ],
)
def test_transforms_of_nodes(transform: str, expected: list[list[float]]) -> None:
    low, high = bounds(dae(scene=f'<node>{transform}<instance_geometry url="#g"/></node>'))
    assert low == pytest.approx(expected[0])
    assert high == pytest.approx(expected[1])


def test_nodes_inside_nodes_and_instances_of_nodes() -> None:
    inner = '<node id="inner"><translate>0 0 1</translate><instance_geometry url="#g"/></node>'
    library = f"<library_nodes>{inner}</library_nodes>"
    scene = (
        '<node><translate>1 0 0</translate><node><scale>2 2 2</scale><instance_node url="#inner"/></node></node>'
        '<node><instance_node url="#inner"/></node>'
    )
    vertices, faces, said = read(dae(scene=scene, libraries=library), ".dae")
    assert len(faces) == 16
    assert bounds(dae(scene=scene, libraries=library)) == [[0, 0, 1], [1.2, 0.4, 2.6]]
    assert volume(vertices, faces) == pytest.approx(9 * 0.003)
    assert said == ""


def test_a_mirrored_node_faces_outwards() -> None:
    vertices, faces, _ = read(dae(scene='<node><scale>-1 1 1</scale><instance_geometry url="#g"/></node>'), ".dae")
    assert volume(vertices, faces) == pytest.approx(0.003)


@pytest.mark.parametrize(
    ("primitive", "wanted", "count"),
    [
        (dae_triangles("g", [[0, 1, 2, 3]], "polylist", "<vcount>4</vcount>"), 16, 2),
        (dae_triangles("g", [[0, 1, 2, 6, 3]], "polylist", "<vcount>5</vcount>"), 12, 3),  # concave
        (dae_triangles("g", [[0, 1, 2]], "tristrips") + dae_triangles("g", [[0, 2, 3]], "trifans"), 16, 2),
        (dae_triangles("g", [[0, 1, 3, 2]], "tristrips"), 16, 2),
        (dae_triangles("g", [[0, 1, 2, 3]], "trifans"), 16, 2),
        (dae_triangles("g", [[0, 1, 2, 3]], "polygons"), 16, 2),
        ('<polygons count="1"><input semantic="VERTEX" source="#v-g" offset="0"/><ph><p>0 1 2 3</p><h>4 5 6 7</h></ph>'
         "</polygons>", 15, 8),
        ('<polygons count="1"><input semantic="VERTEX" source="#v-g" offset="0"/><ph><p>0 1 2 3</p><h>7 6 5 4</h></ph>'
         "</polygons>", 15, 8),
        ('<triangles count="2"><input semantic="TEXCOORD" source="#gone" offset="0"/>'
         '<input semantic="VERTEX" source="#v-g" offset="1"/><p>9 0 9 1 9 2 9 0 9 2 9 3</p></triangles>', 16, 2),
    ],
)  # fmt: skip
def test_every_primitive_is_read(primitive: str, wanted: float, count: int) -> None:
    vertices, faces, said = read(dae(dae_geometry("g", SQUARE, primitive)), ".dae")
    assert area(vertices, faces) == pytest.approx(wanted)
    assert len(faces) == count
    assert said == ""


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (dae(dae_geometry("g", WEDGE[0], dae_triangles("g", WEDGE[1]) + dae_triangles("g", [[0, 1]], "lines"))),
         "geometry 'g': lines left out"),
        (dae(dae_geometry("g", WEDGE[0], dae_triangles("g", WEDGE[1]) + "<triangles count='3'/>")),
         "geometry 'g': <triangles> left out: it has no positions"),
        (dae(dae_geometry("g", WEDGE[0], dae_triangles("g", WEDGE[1]).replace('count="8"', 'count="9"', 1))),
         "declares 9 faces, but holds 8"),
        (dae(dae_geometry("g", WEDGE[0], dae_triangles("g", [*WEDGE[1], [0, 1, 77]]))),
         "geometry 'g': 1 faces left out: not finite, or of vertices that are missing"),
        (dae(dae_geometry("g", WEDGE[0], dae_triangles("g", WEDGE[1])) + dae_geometry("h", WEDGE[0], "")),
         "geometry 'h' is not in the scene: left out"),
        (dae(scene='<node><instance_geometry url="#g"/><instance_geometry url="#gone"/></node>'), "'#gone' is missing"),
        (dae(scene='<node><instance_geometry url="#g"/><instance_node url="other.dae#n"/></node>'),
         "node 'other.dae#n' is missing: left out"),
        (dae(libraries='<library_nodes><node id="q"><instance_geometry url="#g"/></node></library_nodes>'),
         "'#g' in a node outside the scene: left out"),
        (dae(dae_geometry("g", WEDGE[0], dae_triangles("g", WEDGE[1])) + '<geometry id="c"><spline/></geometry>',
             scene='<node><instance_geometry url="#g"/><instance_geometry url="#c"/></node>'),
         "geometry 'c' is of a kind that is not read ('spline'): left out"),
        (dae(scene='<node><instance_controller url="#k"/></node>',
             libraries=CONTROLLER.format("skin")),
         "skin of 'k' left out"),
        (dae(scene='<node><instance_controller url="#k"/></node>',
             libraries=CONTROLLER.format("morph")),
         "morph targets of 'k' left out"),
        (dae().replace("#s", "#t"), "scene '#t' is missing"),
        (dae().replace('<scene><instance_visual_scene url="#s"/></scene>', ""), "does not say which scene"),
    ],
)  # fmt: skip
def test_what_is_lost_is_named_and_the_rest_arrives(text: str, said: str) -> None:
    vertices, faces, notes = read(text, ".dae")
    assert said in notes
    assert area(vertices, faces) == pytest.approx(0.29211 / 2, rel=1e-3)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (dae(scene="<node><matrix>1 0 0</matrix><instance_geometry url='#g'/></node>"), "is not 16 finite numbers"),
        (dae(scene="<node><skew>1 0 0 1 0 1 0</skew><instance_geometry url='#g'/></node>"), "a <skew>, which"),
        (dae()[:-20], "not well-formed"),
        ("<robot/>", "its top element is 'robot'"),
        (dae(libraries='<library_nodes><node id="a"><instance_node url="#a"/></node></library_nodes>',
             scene='<node><instance_node url="#a"/></node>'), "contains itself"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused(text: str, problem: str) -> None:
    with pytest.raises(UnusableMeshError, match=problem):
        read(text, ".dae")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_document_types_are_refused(encoding: str) -> None:
    bomb = '<!DOCTYPE C [<!ENTITY a "1 2 3"><!ENTITY b "&a;&a;&a;&a;">]><COLLADA id="&b;">&b;</COLLADA>'
    with pytest.raises(AssetError, match="document type"):
        read(bomb.encode(encoding), ".dae")


def test_lists_longer_than_ten_megabytes_are_read() -> None:
    """More than libxml2 takes in one text unless it is told to."""
    points = np.column_stack([np.arange(400_000) / 1e5, np.arange(400_000) % 3 / 3, np.zeros(400_000)])
    text = dae(dae_geometry("g", [[0, 0, 0]], dae_triangles("g", [[0, 1, 399_998]])))
    long = " ".join(f"{v:.9f}" for v in points.ravel())
    text = text.replace('count="3">0 0 0<', f'count="{points.size}">{long}<').replace(
        'count="1" stride', 'count="400000" stride'
    )
    assert len(long) > 10_000_000
    vertices, faces, said = read(text, ".dae")
    assert (len(vertices), len(faces), said) == (3, 1, "")


def test_positions_follow_their_accessor() -> None:
    moved = numbers([9, *np.ravel([[z, x, y, 0.5] for x, y, z in WEDGE[0]])])
    text = dae().replace(numbers(WEDGE[0]), moved).replace('stride="3"', 'stride="4" offset="1"')
    text = text.replace('<param name="X"/><param name="Y"/><param name="Z"/>',
                        '<param name="Z"/><param name="X"/><param name="Y"/><param/>')  # fmt: skip
    assert bounds(text)[1] == pytest.approx([0.1, 0.2, 0.3])
