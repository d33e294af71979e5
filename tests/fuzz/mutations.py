"""Mutations of files: of any bytes, of the words of a text, of trees, of arrays, and of members of archives.

A mutation is a function of a random generator and some bytes. Whatever a mutation cannot work with is mutated as bytes,
so that mutations can follow one another.
"""

from __future__ import annotations

import io
import json
import math
import re
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
from lxml import etree
from numpy.typing import NDArray

Mutation = Callable[[Random, bytes], bytes]
Members = list[tuple[str, bytes]]

NUMBERS = (
    "0", "-0", "1", "-1", "2", "3", "255", "256", "65536", "2147483647", "-2147483648", "4294967296",
    "9223372036854775807", "18446744073709551616", "1e9", "1e38", "1e39", "-1e300", "1e308", "1e309", "1e-320", "nan",
    "NaN", "inf", "-inf", "Infinity", "0.5", "1e999999", "9" * 400, "0x10", "1_0", "1,5", "", " ", "a", "True", "null",
    "1 2 3", "0 0 0", "nan nan nan", "1e30 1e30 1e30", "--1", "1e", "\u0661", "\u00bd",
)  # fmt: skip
"""Texts in place of a number."""

TEXTS = (
    "", " ", ".", "..", "../../etc/passwd", "/dev/zero", "/etc/passwd", "file:///etc/passwd", "package://a/b.obj",
    "model://", "http://localhost/x.obj", "a" * 3000, "\u202e\u2066evil", "\u009b31m", "$\\frac{", "%s%n{0}", "\u6905",
    "con", "a/b", "a\\b", "None", "true", "\n", "\t", "x\u0001y", "m.obj", "base", "1",
)  # fmt: skip
"""Texts in place of a name."""

VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 255, 256, 1 << 31, 1 << 63, -(1 << 63), 1 << 64, 10**400, 10**9, 0.5, -0.0, 1e308,
    1e-320, math.nan, math.inf, -math.inf, "", "a", "1", "\ud800", "\u202e", "../x", "/", [], {}, [[]], [0], ["a"],
    [None], {"a": 1}, [[1.0, 2.0, 3.0]], [1, 2, 3], "x" * 5000, [0] * 300,
)  # fmt: skip
"""Values in place of one of JSON's."""

_DTYPES = ("<f2", "<f4", "<f8", ">f8", "i1", "u1", "<i4", "<i8", "<u8", "?", "<c8", "<U3", "S4", "<M8[s]", "V8")
_LIES = (
    *(f"'descr': '{descr}'" for descr in ("|O", "<f8", "<U999999999", "|V0")),
    *(f"'shape': {s}" for s in ("()", "(0,)", "(1000000000,)", "(-1,)", "(0, 3)", "(99999999999, 99999999999)")),
)
_ELEMENTS = (0, 1, -1, 2, 127, 255, 1e30, -1e300, 1e-300, np.nan, np.inf, 1 << 31, 1 << 62)
_MOST = 400_000
"""Bytes of a mutated file, so that inputs stay quick."""


def mutated(rng: Random, data: bytes, suffix: str, other: bytes = b"") -> bytes:
    """A file's bytes, mutated once or several times by what its ending says, at times spliced with another's."""
    if other and rng.random() < 0.05:
        data = data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        mutation = of_bytes if rng.random() < 0.2 else MUTATIONS.get(suffix, of_text)
        try:
            data = mutation(rng, data)[:_MOST]
        except Exception:  # what an earlier mutation left may be nothing that a structured one can work with
            data = of_bytes(rng, data)
    return data


def of_bytes(rng: Random, data: bytes) -> bytes:
    """Some bytes flipped, overwritten by integers of note, left out, put in, repeated or moved."""
    content = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4, 16))):
        at = rng.randrange(len(content) + 1)
        length = min(rng.choice((1, 2, 4, 8, 32, 200)), len(content) - at)
        piece, to = bytes(content[at : at + length]), rng.randrange(len(content) + 1)
        match rng.randrange(8):
            case 0 if at < len(content):
                content[at] ^= 1 << rng.randrange(8)
            case 1 | 2:
                kind, bits = rng.choice((("B", 8), ("H", 16), ("I", 32), ("Q", 64)))
                value = rng.choice((0, 1, (1 << bits - 1) - 1, 1 << bits - 1, (1 << bits) - 1, 1 << min(28, bits - 2)))
                integer = struct.pack(rng.choice("<>") + kind, value)
                content[at : at + len(integer)] = integer
            case 3:
                del content[at : at + length]
            case 4:
                content[at:at] = piece * rng.choice((1, 2, 50))
            case 5:
                content[to:to] = piece
            case 6:
                content[at : at + length] = rng.randbytes(length)
            case _:
                del content[at if rng.random() < 0.3 else len(content) :]
    return bytes(content)


def of_text(rng: Random, data: bytes) -> bytes:
    """Words and lines replaced, left out, repeated or exchanged."""
    text = data.decode("latin-1")
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        lines = rng.random() < 0.3
        parts = re.split(r"(\n)" if lines else r"([\s<>=\"',;:/()\[\]{}]+)", text)
        at, to = 2 * rng.randrange((len(parts) + 1) // 2), 2 * rng.randrange((len(parts) + 1) // 2)
        match rng.randrange(6):
            case 0:
                del parts[at : at + 2]
            case 1:
                parts[at:at] = parts[at : at + 2] * rng.choice((1, 1, 2, 20))
            case 2:
                parts[at], parts[to] = parts[to], parts[at]
            case 3 if not lines:
                parts[at] = rng.choice(parts[::2])
            case _:
                number = re.fullmatch(r"[-+.\d][-+.\deE]*", parts[at])
                parts[at] = rng.choice(NUMBERS if number or rng.random() < 0.3 else TEXTS)
        text = "".join(parts)
    return text.encode("utf-8" if rng.random() < 0.5 else "latin-1", "replace")


def of_xml(rng: Random, data: bytes) -> bytes:
    """Elements left out, repeated, moved or renamed, attributes exchanged; or words."""
    if rng.random() < 0.5:
        return of_text(rng, data)
    root = etree.fromstring(data, etree.XMLParser(resolve_entities=False, no_network=True))
    for _ in range(rng.choice((1, 1, 2, 3))):
        elements = [element for element in root.iter() if isinstance(element.tag, str)]
        element, other = rng.choice(elements), rng.choice(elements)
        parent, copy = element.getparent(), deepcopy(element)
        match rng.randrange(6):
            case 0 if parent is not None:
                parent.remove(element)
            case 1 if parent is not None:
                for _ in range(rng.choice((1, 1, 2, 20))):
                    parent.append(deepcopy(copy))
            case 2:
                other.append(copy)
            case 3:
                element.tag = other.tag
            case 4 if len(element.attrib):
                del element.attrib[rng.choice(list(element.attrib))]
            case _ if len(other.attrib):
                element.set(*rng.choice(list(other.attrib.items())))
    return bytes(etree.tostring(root))


def of_json(rng: Random, data: bytes) -> bytes:
    """Values replaced, left out, repeated, nested or exchanged."""
    value = json.loads(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        places = list(_places(value))
        if not places:
            value = rng.choice(VALUES)
            continue
        (holder, key), (other, at) = rng.choice(places), rng.choice(places)
        match rng.randrange(8):
            case 0:
                del holder[key]
            case 1 if isinstance(holder, list):
                copies = 1 if isinstance(holder[key], dict | list) else rng.choice((1, 2, 300))
                holder[key:key] = [
                    deepcopy(holder[key]) for _ in range(copies)
                ]  # one that stands twice may hold itself
            case 2:
                holder[key] = json.loads(json.dumps(other[at]))
            case 3:
                for _ in range(rng.choice((1, 1, 100))):
                    holder[key] = [holder[key]]
            case 4 if isinstance(holder, dict):
                holder[rng.choice(TEXTS)] = holder.pop(key)
            case 5 if type(holder[key]) in (int, float):
                holder[key] = rng.choice((-holder[key], holder[key] * 1000, holder[key] + 1, -1, str(holder[key])))
            case _:
                holder[key] = rng.choice(VALUES)
    return json.dumps(value, ensure_ascii=rng.random() < 0.9).encode("utf-8", "replace")


def _places(value: Any, depth: int = 0) -> Any:
    """Every (container, key) in a JSON value; of long lists, the first and the last few."""
    if depth < 40 and isinstance(value, dict | list):
        keys = list(value) if isinstance(value, dict) else [k for k in range(len(value)) if k < 4 or k > len(value) - 3]
        for key in keys:
            yield value, key
            yield from _places(value[key], depth + 1)


def of_array(rng: Random, data: bytes) -> bytes:
    """Another array: other values, shape or type; or a header that lies."""
    if rng.random() < 0.2:  # the length of the header stays, as pads at its end make room
        lie = rng.choice(_LIES)
        return re.sub(lie.split(":")[0].encode() + rb": (?:'[^']*'|\([^)]*\))", lie.encode(), data, count=1)
    array: NDArray[Any] = np.load(io.BytesIO(data), allow_pickle=False).copy()
    with np.errstate(all="ignore"):
        match rng.randrange(7):
            case 0 | 1:
                array.reshape(-1)[rng.randrange(array.size)] = rng.choice(_ELEMENTS)
            case 2:
                array = array[: rng.randrange(len(array) + 1)]
            case 3:
                array = np.concatenate([array, array[-rng.choice((1, 2, 5)) :]])
            case 4:
                array = rng.choice((array.T, array.reshape(-1), array[None], np.zeros((), array.dtype)))
            case 5:
                array = np.full_like(array, rng.choice((0, 1)))
            case _:
                array = array.astype(rng.choice(_DTYPES))
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


def of_members(unpack: Callable[[bytes], Members], pack: Callable[[Members], bytes]) -> Mutation:
    """Members left out, repeated, renamed, exchanged or mutated, with lengths and sums that are right."""

    def mutation(rng: Random, data: bytes) -> bytes:
        members = unpack(data)
        at = rng.randrange(len(members))
        name, content = members[at]
        match rng.randrange(10):
            case 0:
                del members[at]
            case 1:
                members.insert(rng.randrange(len(members) + 1), members[at])
            case 2:
                members[at] = (rng.choice(TEXTS) + Path(name).suffix, content)
            case 3:
                members[at] = (name, rng.choice(members)[1])
            case _:
                members[at] = (name, mutated(rng, content, Path(name).suffix))
        return pack(members)

    return mutation


def _zip_members(data: bytes) -> Members:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        return [(info.filename, archive.read(info)) for info in archive.infolist()]


def _zip(members: Members) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in members:
            archive.writestr(zipfile.ZipInfo(name.encode("ascii", "replace").decode()), content, len(content) % 3 * 4)
    return buffer.getvalue()


def _tar_members(data: bytes) -> Members:
    with tarfile.open(fileobj=io.BytesIO(data)) as archive:
        files = ((info.name, archive.extractfile(info)) for info in archive)
        return [(name, file.read() if file else b"") for name, file in files]


def _tar(members: Members) -> bytes:
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for name, content in members:
            info = tarfile.TarInfo(name)
            info.size = len(content)
            info.type = tarfile.SYMTYPE if not content else tarfile.REGTYPE
            archive.addfile(info, io.BytesIO(content))
    return buffer.getvalue()


def _png_members(data: bytes) -> Members:
    chunks, at = [], 8
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        chunks.append((f"{data[at + 4 : at + 8].decode()}.chunk", data[at + 8 : at + 8 + length]))
        at += 12 + length
    return chunks


def _png(members: Members) -> bytes:
    parts = [b"\x89PNG\r\n\x1a\n"]
    for name, content in members:
        kind = name[:4].encode("latin-1", "replace").ljust(4)
        parts += [len(content).to_bytes(4, "big"), kind, content, zlib.crc32(kind + content).to_bytes(4, "big")]
    return b"".join(parts)


def _glb_members(data: bytes) -> Members:
    end = 20 + int.from_bytes(data[12:16], "little")
    return [("text.json", data[20:end]), ("buffer.chunk", data[end:])]


def _glb(members: Members) -> bytes:
    text, rest = members[0][1], b"".join(content for _, content in members[1:])
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<IIII", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


def _safetensors_members(data: bytes) -> Members:
    end = 8 + int.from_bytes(data[:8], "little")
    return [("text.json", data[8:end]), ("tensors.chunk", data[end:])]


def _safetensors(members: Members) -> bytes:
    text, rest = members[0][1], b"".join(content for _, content in members[1:])
    return len(text).to_bytes(8, "little") + text + rest


MUTATIONS: dict[str, Mutation] = {
    **dict.fromkeys((".urdf", ".xml", ".dae"), of_xml),
    **dict.fromkeys((".json", ".gltf"), of_json),
    **dict.fromkeys((".usdc", ".msh", ".chunk"), of_bytes),
    ".npy": of_array,
    ".npz": of_members(_zip_members, _zip),
    ".tar": of_members(_tar_members, _tar),
    ".png": of_members(_png_members, _png),
    ".glb": of_members(_glb_members, _glb),
    ".safetensors": of_members(_safetensors_members, _safetensors),
}
"""By the ending of a file; all others are texts."""
