"""The layers of a USD file are looked at before they are composed: none is outside, and none expands without bound."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from artsim.errors import AssetError
from artsim.loading.sources import find_sources
from artsim.loading.urdf import load
from tests.artsim.loading.usd_files import AT_LID, HEAD, HINGE, PAIR, joint, written
from tests.conftest import CASES, installed

SECOND = CASES / "second"
TEN = range(10)
TOO_MUCH = r"takes over .* (of memory|of processor time) to read|is damaged: usd-core ends"


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
        head = 'prepend variantSets = "v"\nvariants = {\nstring v = "b"\n}'
        text += f'def "P{n + 1}" (\n{head}\n) {{\nvariantSet "v" = {{\n"b" {{\n{arcs}}}\n}}\n}}\n'
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


@pytest.mark.slow
@pytest.mark.parametrize("case", BOMBS)
def test_what_expands_without_bound_is_refused_at_once(case: str, tmp_path: Path) -> None:
    path = written(tmp_path, PAIR)
    path.write_text(path.read_text() + BOMBS[case]())
    with pytest.raises(AssetError, match=TOO_MUCH):
        load(path)


@pytest.mark.slow
@pytest.mark.parametrize("case", ["ancestral_ref_bomb", "ancestral_inherit_bomb"])
def test_arcs_of_ancestors_are_counted(case: str) -> None:
    with pytest.raises(AssetError, match=TOO_MUCH):
        load(SECOND / "hostile" / "A03_usd_ancestral_reference_bomb" / case / "mobility.usda")


@pytest.mark.slow
def test_layers_that_take_in_each_other_are_refused(tmp_path: Path) -> None:
    head = "#usda 1.0\n(\n"
    for n in range(20):
        for name in "ab":
            (tmp_path / f"{name}{n}.usda").write_text(f"{head} subLayers = [@c{n + 1}.usda@]\n)\n")
        (tmp_path / f"c{n}.usda").write_text(f"{head} subLayers = [@a{n}.usda@, @b{n}.usda@]\n)\n")
    (tmp_path / "c20.usda").write_text("#usda 1.0\n")
    with pytest.raises(AssetError, match=f"made of over 200 layers|{TOO_MUCH}"):
        load(tmp_path / "c0.usda")
    for n in range(9):  # the same path in each of them
        arcs = "".join(f'def "x{i}" (references = @l{n + 1}.usda@) {{}}\n' for i in TEN)
        (tmp_path / f"l{n}.usda").write_text(f'{HEAD}def "o" {{\n{arcs}}}\n')
    (tmp_path / "l9.usda").write_text(f'{HEAD}def "o" {{}}\n')
    with pytest.raises(AssetError, match=TOO_MUCH):
        load(tmp_path / "l0.usda")


def test_a_circle_of_sublayers_is_what_usd_makes_of_it(tmp_path: Path) -> None:
    head = HEAD.replace("(\n", "(\n    subLayers = [@b.usda@]\n", 1)
    written(tmp_path, "", head.replace("@b.usda@", "@object.usda@"), "b.usda")
    assert len(load(written(tmp_path, PAIR + joint("Revolute", "base", "lid", HINGE), head))) == 2


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
        ({"a.usda": HEAD}, zipfile.ZIP_DEFLATED, "compressed files are not supported"),
        ({"a.png": "x", "a.usda": HEAD}, zipfile.ZIP_STORED, "no USD layer that can be read"),
        ({"a.usda": OUTWARD.format("b.usda")}, zipfile.ZIP_STORED, "'b.usda', which is missing"),
        ({"a.usda": OUTWARD.format("../text.usda")}, zipfile.ZIP_STORED, "there is no layer"),
        ({"a.usda": OUTWARD.format("/etc/hostname.usda")}, zipfile.ZIP_STORED, "outside the file's folder"),
        ({"a.usda": OUTWARD.format("i.usdz"), "i.usdz": "PK"}, zipfile.ZIP_STORED, "there is no layer"),
        ({"a.usda": HEAD + "{" * 1000}, zipfile.ZIP_STORED, "no USD layer that can be read"),
        ({}, zipfile.ZIP_STORED, "no USD layer that can be read"),
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
