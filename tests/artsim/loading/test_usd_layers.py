"""The layers of a USD file are looked at before they are composed: none is outside, and none expands without bound."""

from __future__ import annotations

import io
import time
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits
from artsim.loading.sources import find_sources
from artsim.loading.urdf import load
from artsim.loading.usd_expansion import Expansion
from artsim.loading.usd_layers import _Layers
from tests.artsim.loading.usd_files import AT_LID, HEAD, HINGE, PAIR, joint, written
from tests.conftest import CASES, installed

SECOND = CASES / "second"
TEN = range(10)


def chain(arc: str, word: str = "def", instanceable: bool = False) -> str:
    """Ten prims below each of ten, nine times over, each by an arc of an ancestor."""
    more = "\n instanceable = true\n" if instanceable else ""
    text = f'{word} "P0" {{\n{word} "c" {{\n' + "".join(f'def Xform "a{i}" {{}}\n' for i in TEN) + "}\n}\n"
    for n in range(9):
        arcs = "".join(f'def "x{i}" (\n {arc} = </Q{n}/c>{more}\n) {{}}\n' for i in TEN)
        text += f'{word} "Q{n}" ({arc} = </P{n}>) {{}}\n{word} "P{n + 1}" {{\ndef "c" {{\n{arcs}}}\n}}\n'
    return text


def variants() -> str:
    text = 'def "P0" {\n' + "".join(f'def "a{i}" {{}}\n' for i in TEN) + "}\n"
    for n in range(9):
        arcs = "".join(f'def "x{i}" (references = </P{n}>) {{}}\n' for i in TEN)
        text += f'def "P{n + 1}" (\nprepend variantSets = "v"\n) {{\nvariantSet "v" = {{\n"b" {{\n{arcs}}}\n}}\n}}\n'
    return text


def diamonds() -> str:
    """One prim of 2^40 sites, and none below it."""
    levels = (
        f'def "A{n}" (references = </D{n}>) {{}}\ndef "B{n}" (references = </D{n}>) {{}}\n'
        f'def "D{n + 1}" (references = [</A{n}>, </B{n}>]) {{}}\n'
        for n in range(40)
    )
    return 'def "D0" {}\n' + "".join(levels)


def implied() -> str:
    """What inherits a class inherits what those who refer to its prim write of the class."""
    text = 'def "Q0" {\n' + "".join(f'def "a{i}" {{}}\n' for i in TEN) + "}\n"
    for n in range(1, 10):
        heirs = "".join(f'def "x{i}" (inherits = </P{n}/_c>) {{}}\n' for i in TEN)
        text += f'def "P{n}" {{\nclass "_c" {{}}\n{heirs}}}\n'
        text += f'def "Q{n}" (references = </P{n}>) {{\nover "_c" (references = </Q{n - 1}>) {{}}\n}}\n'
    return text


def circles() -> str:
    return "".join(
        f'def "A{n}" {{\n' + "".join(f'def "x{i}" (references = </A{i}>) {{}}\n' for i in TEN if i != n) + "}\n"
        for n in TEN
    )


BOMBS: dict[str, Callable[[], str]] = {
    "references": lambda: chain("references"),
    "payloads": lambda: chain("payload"),
    "inherits": lambda: chain("inherits", "class"),
    "specializes": lambda: chain("specializes", "class"),
    "instances": lambda: chain("references", instanceable=True),
    "variants": variants,
    "diamonds": diamonds,
    "implied classes": implied,
    "circles": circles,
    "deep": lambda: 'def "E0" {}\n' + "".join(
        f'def "E{i + 1}" (references = </E{i}>) {{\ndef "y" (references = </E{i}>) {{}}\n}}\n' for i in range(2000)
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BOMBS)
def test_what_expands_without_bound_is_refused_at_once(case: str, tmp_path: Path) -> None:
    path = written(tmp_path, PAIR)
    path.write_text(path.read_text() + BOMBS[case]())
    start = time.process_time()
    with pytest.raises(AssetError, match=r"expand to over 50000 prims|refers to itself in a circle|nested too deeply"):
        load(path)
    assert time.process_time() - start < 2.0


@pytest.mark.parametrize("case", ["ancestral_ref_bomb", "ancestral_inherit_bomb"])
def test_arcs_of_ancestors_are_counted(case: str) -> None:
    start = time.process_time()
    with pytest.raises(AssetError, match="its references, inherits and variants expand to over 50000 prims"):
        load(SECOND / "hostile" / "A03_usd_ancestral_reference_bomb" / case / "mobility.usda")
    assert time.process_time() - start < 2.0


def test_layers_that_take_in_each_other_are_refused(tmp_path: Path) -> None:
    head = "#usda 1.0\n(\n"
    for n in range(20):
        for name in "ab":
            (tmp_path / f"{name}{n}.usda").write_text(f"{head} subLayers = [@c{n + 1}.usda@]\n)\n")
        (tmp_path / f"c{n}.usda").write_text(f"{head} subLayers = [@a{n}.usda@, @b{n}.usda@]\n)\n")
    (tmp_path / "c20.usda").write_text("#usda 1.0\n")
    with pytest.raises(AssetError, match="made of over 200 layers"):
        load(tmp_path / "c0.usda")
    for n in range(9):  # the same path in each of them
        arcs = "".join(f'def "x{i}" (references = @l{n + 1}.usda@) {{}}\n' for i in TEN)
        (tmp_path / f"l{n}.usda").write_text(f'{HEAD}def "o" {{\n{arcs}}}\n')
    (tmp_path / "l9.usda").write_text(f'{HEAD}def "o" {{}}\n')
    with pytest.raises(AssetError, match="expand to over"):
        load(tmp_path / "l0.usda")


def test_a_circle_of_sublayers_is_what_usd_makes_of_it(tmp_path: Path) -> None:
    head = HEAD.replace("(\n", "(\n    subLayers = [@b.usda@]\n", 1)
    written(tmp_path, "", head.replace("@b.usda@", "@object.usda@"), "b.usda")
    assert len(load(written(tmp_path, PAIR + joint("Revolute", "base", "lid", HINGE), head))) == 2


@pytest.mark.parametrize("key", ["relocates", "clips"])
def test_what_moves_prims_about_is_refused(key: str, tmp_path: Path) -> None:
    words = {
        "relocates": HEAD.replace("(\n", "(\n    relocates = {\n        </o/base>: </o/other>\n    }\n", 1),
        "clips": HEAD,
    }
    path = written(tmp_path, PAIR, words[key])
    if key == "clips":
        path.write_text(path.read_text().replace('def Xform "o" {', 'def Xform "o" (clips = {}) {'))
    with pytest.raises(AssetError, match=f"{key} are not read"):
        load(path)


CAUTIOUS = (8, 10)


@pytest.mark.parametrize("seed", range(24))
def test_no_fewer_sites_are_counted_than_prims_are_composed(seed: int, tmp_path: Path) -> None:
    """Random prims, each with arcs to ones before it or below these, in two layers."""
    installed("pxr")
    from pxr import Usd

    rng = np.random.default_rng(seed)
    arcs = ["references", "references", "payload", "inherits", "specializes"]
    names = ["other.usda", "object.usda"]
    for name in names:
        known: list[str] = []
        text = HEAD
        for n in range(12):
            rows = []
            for child in range(int(rng.integers(1, 4))):
                target = f" ({rng.choice(arcs)} = <{rng.choice(known)}>)" if known and rng.random() < 0.4 else ""
                rows.append(f'def "c{child}"{target} {{\ndef "d" {{}}\n}}')
            inside = "\n".join(rows)
            if rng.random() < 0.3:
                inside = f'variantSet "v" = {{\n"x" {{\n{inside}\n}}\n}}\n'
                head = '\nvariants = {\nstring v = "x"\n}\nprepend variantSets = "v"\n'
            else:
                head = (
                    f"{rng.choice(arcs)} = <{rng.choice(known)}>" if known and rng.random() < 0.4 else "active = true"
                )
                if name == "object.usda" and rng.random() < 0.3:
                    head = f"references = @other.usda@</p{rng.integers(12)}>"
            text += f'def "p{n}" ({head}) {{\n{inside}\n}}\n'
            known += [f"/p{n}", f"/p{n}/c0"]
        (tmp_path / name).write_text(text)
    layers = _Layers(tmp_path / "object.usda", LoadLimits())
    try:
        counted = Expansion("", layers.stack, layers.beside).check(layers.root)
    except AssetError:  # classes that are written where they are inherited are counted wherever they may be
        assert seed in CAUTIOUS
        return
    stage = Usd.Stage.Open(layers.opened[layers.root])
    composed = list(stage.Traverse(Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)))
    assert len(composed) <= counted < 100 * len(composed)


# --- packages ------------------------------------------------------------------------------------------------------


def zipped(folder: Path, members: dict[str, str], packed: int = zipfile.ZIP_STORED) -> Path:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", packed) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    path = folder / "m.usdz"
    path.write_bytes(buffer.getvalue())
    return path


def text_of(folder: Path, content: str) -> str:
    return written(folder, content, name="text.usda").read_text()


def test_a_package_is_read() -> None:
    obj = load(SECOND / "US3_usdz" / "m.usdz")
    assert obj.tree.types == ("free", "revolute")
    np.testing.assert_allclose(obj.box_size[1], [0.4, 0.4, 0.02], atol=1e-6)


def test_layers_of_a_package_refer_to_each_other(tmp_path: Path) -> None:
    part = text_of(tmp_path, PAIR)
    root = f'{HEAD}def "o" (references = @parts/p.usda@) {{\n{joint("Revolute", "base", "lid", HINGE + AT_LID)}}}\n'
    package = zipped(tmp_path, {"root.usda": root, "parts/p.usda": part, "t.png": "x"})
    assert len(load(package)) == 2
    package.rename(tmp_path / "mobility.usdz")
    assert [source.path.name for source in find_sources([tmp_path])] == ["mobility.usdz"]
    outer = tmp_path / "outer.usda"
    outer.write_text(f'{HEAD}def "o" (references = @mobility.usdz@) {{}}\n')
    assert len(load(outer)) == 2


def test_a_package_of_binary_layers_is_read(tmp_path: Path) -> None:
    installed("pxr")
    from pxr import Sdf, UsdUtils

    text = written(tmp_path, PAIR + joint("Revolute", "base", "lid", HINGE + AT_LID))
    Sdf.Layer.FindOrOpen(str(text)).Export(str(tmp_path / "o.usdc"))
    assert UsdUtils.CreateNewUsdzPackage(str(tmp_path / "o.usdc"), str(tmp_path / "o.usdz"))
    assert len(load(tmp_path / "o.usdz")) == 2


OUTWARD = HEAD + 'def "o" (references = @{}@) {{}}\n'


@pytest.mark.parametrize(
    ("members", "packed", "text"),
    [
        ({"a.usda": HEAD}, zipfile.ZIP_DEFLATED, "compressed or encrypted"),
        ({"../a.usda": HEAD}, zipfile.ZIP_STORED, "leads out of it"),
        ({"/a.usda": HEAD}, zipfile.ZIP_STORED, "leads out of it"),
        ({"a.png": "x", "a.usda": HEAD}, zipfile.ZIP_STORED, "its first member, 'a.png', is no USD layer"),
        ({"a.usda": OUTWARD.format("b.usda")}, zipfile.ZIP_STORED, "missing in the package"),
        ({"a.usda": OUTWARD.format("../text.usda")}, zipfile.ZIP_STORED, "missing in the package"),
        ({"a.usda": OUTWARD.format("/etc/hostname.usda")}, zipfile.ZIP_STORED, "missing in the package"),
        ({"a.usda": OUTWARD.format("i.usdz"), "i.usdz": "PK"}, zipfile.ZIP_STORED, "missing in the package"),
        ({"a.usda": HEAD + "{" * 1000}, zipfile.ZIP_STORED, "brackets inside each other"),
        ({}, zipfile.ZIP_STORED, "no zip archive, or an empty one"),
    ],
)
def test_what_is_wrong_with_a_package_is_said(members: dict[str, str], packed: int, text: str, tmp_path: Path) -> None:
    text_of(tmp_path, PAIR)
    with pytest.raises(AssetError, match=text):
        load(zipped(tmp_path, members, packed))


def test_a_package_that_is_cut_off_is_refused(tmp_path: Path) -> None:
    path = zipped(tmp_path, {"a.usda": text_of(tmp_path, PAIR)})
    data = path.read_bytes()
    for size in (10, 35, 200):
        path.write_bytes(data[:size])
        with pytest.raises(AssetError, match="no USD layer that can be read"):
            load(path)
