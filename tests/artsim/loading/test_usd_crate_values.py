"""Values of binary USD files hold no more than they declare, whatever usd-core would make room for."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import pytest

from artsim.errors import AssetError
from artsim.loading.urdf import load
from artsim.loading.usd_bytes import problem_of
from tests.artsim.loading.usd_files import PAIR, joint, written
from tests.conftest import installed

N = 29
"""Items of each list: a number that is nowhere else in the values."""


def several(item: str, start: str = "[", end: str = "]") -> str:
    return f"{start}{', '.join(item.replace('#', str(100 + i)) for i in range(N))}{end}"


LINES = several("#: #.5", "{ ", " }")
ENTRIES = "\n".join(f'string k{i} = "v{i}"' for i in range(N))
SPLINE = "{\nbezier,\n" + "\n".join(f'{i}: 5; post held; {{ string k = "v" }},' for i in range(N)) + "\n}"
PRIM, PROPERTY, LAYER = 'def "o" (\n{}\n) {{\n}}', 'def "o" {{\n{}\n}}', ""
KINDS = {
    "whole numbers": (PROPERTY, f"custom int[] x = {several('#')}"),
    "whole numbers of 64 bits": (PROPERTY, f"custom int64[] x = {several('#')}"),
    "numbers that are whole": (PROPERTY, f"custom float[] x = {several('#')}"),
    "numbers from a table": (PROPERTY, f"custom double[] x = {several('0.1')}"),
    "numbers": (PROPERTY, f"custom double[] x = {several('#.37')}"),
    "vectors": (PROPERTY, f"custom point3f[] x = {several('(#, 0, 0)')}"),
    "turns": (PROPERTY, f"custom quatf[] x = {several('(1, 0, 0, #)')}"),
    "matrices": (PROPERTY, f"custom matrix2d[] x = {several('((1, 0), (0, #))')}"),
    "truths": (PROPERTY, f"custom bool[] x = {several('true')}"),
    "texts": (PROPERTY, f"custom string[] x = {several(chr(34) + 't#' + chr(34))}"),
    "tokens": (PROPERTY, f"custom token[] x = {several(chr(34) + 't#' + chr(34))}"),
    "files": (PROPERTY, f"custom asset[] x = {several('@f#@')}"),
    "time codes": (PROPERTY, f"custom timecode[] x = {several('#')}"),
    "expressions": (PROPERTY, f"custom pathExpression[] x = {several(chr(34) + '/e#//' + chr(34))}"),
    "targets": (PROPERTY, f"custom rel x = {several('</p#>')}"),
    "connections": (PROPERTY, f"double x.connect = {several('</p#.x>')}"),
    "samples": (PROPERTY, f"custom double x.timeSamples = {LINES}"),
    "a list in samples": (PROPERTY, f"custom double[] x.timeSamples = {{ 1: {several('#.37')}, 2: [1] }}"),
    "a spline": (PROPERTY, f"double x.spline = {SPLINE}"),
    "an order": (PROPERTY, f"reorder properties = {several(chr(34) + 'p#' + chr(34))}"),
    "schemas": (PRIM, f"prepend apiSchemas = {several(chr(34) + 's#' + chr(34))}"),
    "references": (PRIM, f"references = {several('@r#@')}"),
    "a list in a reference": (PRIM, f"references = @r@ (customData = {{ int[] a = {several('#')}\n }})"),
    "payloads": (PRIM, f"payload = {several('@r#@')}"),
    "choices": (PRIM, f"variants = {{\n{ENTRIES}\n}}"),
    "sets": (PRIM, f"prepend variantSets = {several(chr(34) + 'v#' + chr(34))}"),
    "a dictionary": (PRIM, f"customData = {{\n{ENTRIES}\n}}"),
    "a list in a dictionary": (PRIM, f"customData = {{ dictionary d = {{ int[] a = {several('#')}\n }}\n }}"),
    "sublayers": (LAYER, f"subLayers = {several('@l#@ (offset = 1)')}"),
    "relocates": (LAYER, f"relocates = {several('</o/a#>: </o/b#>', '{', '}')}"),
}


def crate(file: Path, around: str, content: str) -> bytes:
    from pxr import Sdf

    layer = Sdf.Layer.CreateAnonymous(".usda")
    text = around.format(content) if around else ""
    assert layer.ImportFromString(f"#usda 1.0\n(\n{'' if around else content}\n)\n{text}\n")
    layer.Export(str(file))
    return file.read_bytes()


def sections(data: bytes) -> int:
    """Where values end and sections start."""
    table = int.from_bytes(data[16:24], "little")
    count = int.from_bytes(data[table : table + 8], "little")
    return min(int.from_bytes(data[at + 16 : at + 24], "little") for at in range(table + 8, table + 8 + 32 * count, 32))


@pytest.mark.parametrize("kind", KINDS)
def test_a_value_that_declares_more_than_the_file_holds_is_refused(kind: str, tmp_path: Path) -> None:
    installed("pxr")
    data = crate(tmp_path / "o.usdc", *KINDS[kind])
    assert problem_of(data) is None
    declared = N.to_bytes(8, "little")
    places = [at for at in range(88, sections(data)) if data[at : at + 8] == declared]
    assert places
    for at in places:
        for count in (10**6, 10**8, 1 << 40, (1 << 64) - 1):
            start = time.perf_counter()
            assert problem_of(data[:at] + count.to_bytes(8, "little") + data[at + 8 :]) is not None
            assert time.perf_counter() - start < 0.5


@pytest.mark.parametrize("count", [10**6, (1 << 32) - 1])
def test_tables_of_numbers_are_in_the_file(count: int, tmp_path: Path) -> None:
    installed("pxr")
    data = crate(tmp_path / "o.usdc", *KINDS["numbers from a table"])
    at = data.index(b"t" + (1).to_bytes(4, "little")) + 1
    assert problem_of(data[:at] + count.to_bytes(4, "little") + data[at + 4 :]) is not None


@pytest.mark.parametrize("depth", [20, 200])
def test_dictionaries_inside_each_other_are_bounded(depth: int, tmp_path: Path) -> None:
    installed("pxr")
    from pxr import Sdf

    layer = Sdf.Layer.CreateAnonymous(".usda")
    inner: dict[str, Any] = {"a": "text"}
    for _ in range(depth):
        inner = {"d": inner}
    layer.customLayerData = inner
    layer.Export(str(tmp_path / "o.usdc"))
    assert (problem_of((tmp_path / "o.usdc").read_bytes()) is None) == (depth < 100)


def test_edits_of_arrays_are_looked_at(tmp_path: Path) -> None:
    installed("pxr")
    from pxr import Sdf, Vt

    layer = Sdf.Layer.CreateNew(str(tmp_path / "o.usdc"))
    attribute = Sdf.AttributeSpec(Sdf.PrimSpec(layer, "o", Sdf.SpecifierDef), "x", Sdf.ValueTypeNames.DoubleArray)
    edit = Vt.DoubleArrayEditBuilder()
    for number in range(N):
        edit.Append(number + 0.37)
    attribute.default = edit.FinalizeAndReset()
    layer.Save()
    data = (tmp_path / "o.usdc").read_bytes()
    assert problem_of(data) is None
    at = data.index(N.to_bytes(8, "little"))
    assert problem_of(data[:at] + (10**7).to_bytes(8, "little") + data[at + 8 :]) is not None


def test_an_object_with_a_damaged_value_is_refused_with_a_reason(tmp_path: Path) -> None:
    installed("pxr")
    from pxr import Sdf

    text = written(tmp_path, PAIR + joint("Revolute", "base", "lid"))
    binary = text.with_suffix(".usdc")
    Sdf.Layer.FindOrOpen(str(text)).Export(str(binary))
    whole = binary.read_bytes()
    at = whole.index((2).to_bytes(8, "little"), 88)  # schemas of a body
    binary.write_bytes(whole[:at] + (10**7).to_bytes(8, "little") + whole[at + 8 :])
    with pytest.raises(AssetError, match=r"no USD layer that can be read .its values are damaged"):
        load(binary)
