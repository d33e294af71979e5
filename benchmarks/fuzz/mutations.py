"""Mutations of files: of any bytes, and of XML, JSON, lines of text, arrays, archives and images as what they are.

A mutation is a function of a random generator and some bytes. Structured ones fall back to bytes where a file is none
of their kind, so that mutations can follow one another.
"""

from __future__ import annotations

import io
import json
import math
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Mapping
from copy import deepcopy
from itertools import islice
from random import Random
from typing import Any

import numpy as np
from lxml import etree
from numpy.typing import NDArray

Mutation = Callable[[Random, bytes], bytes]

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
    "con", "a/b", "a\\b", "None", "true", "\n", "\t", "x\u0000y".replace("\u0000", "\u0001"), "m.obj", "base", "1",
)  # fmt: skip
"""Texts in place of a name."""

VALUES: tuple[Any, ...] = (
    None, True, False, 0, 1, -1, 2, 255, 256, 1 << 31, 1 << 63, -(1 << 63), 1 << 64, 10**400, 10**9, 0.5, -0.0, 1e308,
    1e-320, math.nan, math.inf, -math.inf, "", "a", "1", "\ud800", "\u202e", "../x", "/", [], {}, [[]], [0], ["a"],
    [None], {"a": 1}, [[1.0, 2.0, 3.0]], [1, 2, 3], "x" * 5000, [0] * 300,
)  # fmt: skip
"""Values in place of one of JSON's."""

_INTEGERS = tuple(
    struct.pack(f"{order}{kind}", value)
    for order in "<>"
    for kind, bits in (("B", 8), ("H", 16), ("I", 32), ("Q", 64))
    for value in (
        0,
        1,
        (1 << bits - 1) - 1,
        1 << bits - 1,
        (1 << bits) - 1,
        (1 << bits) - 2,
        min(1 << 28, (1 << bits) - 3),
    )
)


def of_bytes(rng: Random, data: bytes) -> bytes:
    """Some bytes flipped, overwritten, left out, put in, repeated or swapped."""
    content = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4, 16))):
        at = rng.randrange(len(content) + 1)
        length = min(rng.choice((1, 2, 4, 8, 32, 200)), len(content) - at)
        match rng.randrange(8):
            case 0 if at < len(content):
                content[at] ^= 1 << rng.randrange(8)
            case 1:
                content[at : at + length] = rng.randbytes(length)
            case 2:
                del content[at : at + length]
            case 3:
                content[at:at] = rng.randbytes(rng.choice((1, 4, 30)))
            case 4:
                content[at:at] = content[at : at + length] * rng.choice((1, 2, 50))
            case 5:
                value = rng.choice(_INTEGERS)
                content[at : at + len(value)] = value
            case 6:
                other = rng.randrange(len(content) + 1)
                content[at : at + length] = content[other : other + length]
            case _:
                if rng.random() < 0.3:
                    del content[at:]
    return bytes(content)


_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")


def of_numbers(rng: Random, data: bytes) -> bytes:
    """Some numbers in a text replaced."""
    found = list(_NUMBER.finditer(data[:200_000]))
    if not found:
        return of_bytes(rng, data)
    for match in sorted(rng.sample(found, min(len(found), rng.choice((1, 1, 2, 5)))), key=lambda m: -m.start()):
        data = data[: match.start()] + rng.choice(NUMBERS).encode() + data[match.end() :]
    return data


def of_lines(rng: Random, data: bytes) -> bytes:
    """Lines left out, repeated, moved, joined, cut, or made without end."""
    lines = data.split(b"\n")
    for _ in range(rng.choice((1, 1, 2, 4))):
        at = rng.randrange(len(lines))
        match rng.randrange(8):
            case 0 if len(lines) > 1:
                del lines[at]
            case 1:
                lines[at:at] = [lines[at]] * rng.choice((1, 3, 100))
            case 2:
                other = rng.randrange(len(lines))
                lines[at], lines[other] = lines[other], lines[at]
            case 3:
                lines[at] = lines[at][: rng.randrange(len(lines[at]) + 1)]
            case 4:
                lines[at] += b" " + rng.choice((*NUMBERS, *TEXTS)).encode("utf-8", "replace")
            case 5:
                lines[at] = (lines[at] + b" ") * rng.choice((2, 20, 300))
            case 6:
                words = lines[at].split(b" ")
                rng.shuffle(words)
                lines[at] = b" ".join(words)
            case _:
                lines[at] += rng.choice((b"\r", b"\t", b"\\", b"#", b"\x00", b"\xff"))
    return b"\n".join(lines)


def of_xml(rng: Random, data: bytes) -> bytes:
    """Elements left out, repeated, moved or renamed; attributes and texts replaced."""
    try:
        root = etree.fromstring(data, etree.XMLParser(resolve_entities=False, no_network=True))
    except (etree.XMLSyntaxError, ValueError):
        root = None
    if root is None:
        return of_bytes(rng, data)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        elements = [e for e in root.iter() if isinstance(e.tag, str)]
        _change_element(rng, rng.choice(elements), elements)
    return etree.tostring(root)


def _change_element(rng: Random, element: etree._Element, elements: list[etree._Element]) -> None:
    parent, other = element.getparent(), rng.choice(elements)
    copy = deepcopy(element)
    text = rng.choice(NUMBERS if rng.random() < 0.6 else TEXTS).replace("\x01", "?")
    match rng.randrange(9):
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
        case 5:
            name = rng.choice([name for e in (element, other) for name in e.attrib] or ["name"])
            element.set(name, rng.choice(list(other.attrib.values()) or [text]))
        case 6:
            element.text = text
        case 7 if element.text and element.text.strip():
            words = element.text.split()
            words[rng.randrange(len(words))] = text
            element.text = " ".join(words)
        case _:
            if not len(element.attrib):
                return
            name = rng.choice(list(element.attrib))
            words = element.get(name, "").split() or [""]
            if rng.random() < 0.5:
                words[rng.randrange(len(words))] = text
            else:
                words = [text]
            element.set(name, " ".join(words))


def of_json(rng: Random, data: bytes) -> bytes:
    """Values replaced, left out, repeated, nested or swapped."""
    try:
        value = json.loads(data)
    except (ValueError, RecursionError):
        return of_bytes(rng, data)
    return json.dumps(changed_value(rng, value), ensure_ascii=rng.random() < 0.9).encode("utf-8", "replace")


def changed_value(rng: Random, value: Any) -> Any:
    """A JSON value with some values in it changed."""
    for _ in range(rng.choice((1, 1, 1, 2, 4))):
        places = list(islice(_places(value), 5000))
        if not places:
            return rng.choice(VALUES)
        holder, key = rng.choice(places)
        match rng.randrange(8):
            case 0:
                del holder[key]
            case 1 if isinstance(holder, list):
                copies = rng.choice((1, 2, 300))  # of containers only one, as copies of copies have no end
                holder[key:key] = [holder[key]] * (1 if isinstance(holder[key], (dict, list)) else copies)
            case 2:
                other, at = rng.choice(places)
                if _has(other, at):
                    holder[key] = json.loads(json.dumps(other[at]))
            case 3:
                for _ in range(rng.choice((1, 1, 100))):
                    holder[key] = [holder[key]]
            case 4 if isinstance(holder, dict):
                holder[rng.choice(TEXTS)] = holder.pop(key)
            case 5 if isinstance(holder[key], (int, float)) and not isinstance(holder[key], bool):
                holder[key] = rng.choice((-holder[key], holder[key] * 1000, holder[key] + 1, -1, str(holder[key])))
            case _:
                holder[key] = rng.choice(VALUES)
    return value


def _places(value: Any, depth: int = 0) -> Any:
    """Every (container, key) in a JSON value; of long lists, the first and the last few."""
    if depth > 40:
        return
    if isinstance(value, dict):
        keys: list[Any] = list(value)
    elif isinstance(value, list):
        keys = [*range(min(len(value), 4)), *range(max(4, len(value) - 2), len(value))]
    else:
        return
    for key in keys:
        yield value, key
        yield from _places(value[key], depth + 1)


def _has(holder: Any, key: Any) -> bool:
    return key in holder if isinstance(holder, dict) else key < len(holder)


def npy_bytes(array: NDArray[Any]) -> bytes:
    """An array as a file."""
    buffer = io.BytesIO()
    np.save(buffer, array, allow_pickle=False)
    return buffer.getvalue()


_DTYPES = ("<f2", "<f4", "<f8", ">f8", "i1", "u1", "<i4", "<i8", "<u8", "?", "<c8", "<U3", "S4", "<M8[s]", "V8")
_SHAPES = ("()", "(0,)", "(1000000000,)", "(-1,)", "(0, 3)", "(1, 1, 1)", "(99999999999, 99999999999)", "(3, 3)")


def of_array(rng: Random, data: bytes) -> bytes:
    """Another array: other values, shape or type; or a header that lies."""
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False)
    except Exception:  # a seed that other mutations have been at is any bytes
        return of_bytes(rng, data)
    if rng.random() < 0.2:  # the length of the header stays, as pads at its end make room
        lie = rng.choice(
            (f"'descr': '{rng.choice(('|O', '<f8', '<U999999999', '|V0'))}'", f"'shape': {rng.choice(_SHAPES)}")
        )
        name = lie.split(":")[0].encode()
        return re.sub(name + rb": (?:'[^']*'|\([^)]*\))", lie.encode(), data, count=1)
    return npy_bytes(changed_array(rng, array))


def changed_array(rng: Random, array: NDArray[Any]) -> NDArray[Any]:
    """An array with other values, another shape or another type."""
    array = array.copy()
    match rng.randrange(9):
        case 0 if array.size:
            values = (0, 1, -1, 2, 127, 255, 1e30, -1e300, 1e-300, np.nan, np.inf, 1 << 31, 1 << 62)
            flat = array.reshape(-1)
            for _ in range(rng.choice((1, 1, 3))):
                with np.errstate(all="ignore"):
                    try:
                        flat[rng.randrange(flat.size)] = rng.choice(values)
                    except (OverflowError, ValueError):
                        flat[rng.randrange(flat.size)] = 1
        case 1 if array.ndim:
            array = array[: rng.randrange(len(array) + 1)]
        case 2 if array.ndim and len(array):
            array = np.concatenate([array, array[-rng.choice((1, 2, 5)) :]])
        case 3:
            array = array.reshape(rng.choice(((-1,), (1, -1), (-1, 1))))
        case 4:
            array = array.T
        case 5:
            array = np.zeros((), array.dtype)
        case 6 if array.size:
            array = np.full_like(array, rng.choice((0, 1)))
        case 7 if array.size:
            array = (
                np.where(np.arange(array.size).reshape(array.shape) % 2 == 0, array, -array)
                if array.dtype.kind in "if"
                else array
            )
        case _:
            with np.errstate(all="ignore"):
                try:
                    array = array.astype(rng.choice(_DTYPES))
                except (ValueError, TypeError):
                    array = array[..., None]
    return array


def of_npz(rng: Random, data: bytes) -> bytes:
    """Members changed, left out, renamed, repeated; or an archive that lies about them."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {info.filename: archive.read(info) for info in archive.infolist()}
    except Exception:  # as above
        return of_bytes(rng, data)
    if rng.random() < 0.15:
        return of_bytes(rng, data)
    name = rng.choice(list(members))
    match rng.randrange(8):
        case 0:
            del members[name]
        case 1:
            members[rng.choice(TEXTS) + ".npy"] = members[name]
        case 2:
            members[name] = members[rng.choice(list(members))]
        case 3:
            members[name] = of_bytes(rng, members[name])
        case 4:
            texts = [n for n, content in members.items() if b"'|u1'" in content[:80] and b"{" in content[100:140]]
            for text in texts[:1]:
                plain = np.load(io.BytesIO(members[text])).tobytes()
                members[text] = npy_bytes(np.frombuffer(of_json(rng, plain), np.uint8))
        case _:
            members[name] = of_array(rng, members[name])
    return zip_bytes(members, rng.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)))


def zip_bytes(members: Mapping[str, bytes], compression: int = zipfile.ZIP_STORED) -> bytes:
    """Files as an archive."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, content in members.items():
            archive.writestr(zipfile.ZipInfo(name.encode("ascii", "replace").decode()), content, compression)
    return buffer.getvalue()


def of_png(rng: Random, data: bytes) -> bytes:
    """Another header, or chunks left out, repeated or moved, with sums that are right."""
    chunks = []
    at = 8
    while at + 12 <= len(data):
        length = int.from_bytes(data[at : at + 4], "big")
        chunks.append((data[at + 4 : at + 8], data[at + 8 : at + 8 + length]))
        at += 12 + length
    if not chunks or data[:4] != b"\x89PNG":
        return of_bytes(rng, data)
    number = rng.randrange(len(chunks))
    kind, content = chunks[number]
    match rng.randrange(5):
        case 0:
            header = bytearray(chunks[0][1].ljust(13, b"\0"))
            place = rng.choice((0, 4, 8, 9, 12))
            value = rng.choice((0, 1, 3, 4, 6, 16, 20000, 65536, 1 << 31, (1 << 32) - 1))
            header[place : place + (4 if place < 8 else 1)] = (
                value.to_bytes(4, "big") if place < 8 else bytes([value & 255])
            )
            chunks[0] = (b"IHDR", bytes(header))
        case 1:
            del chunks[number]
        case 2:
            chunks.insert(
                rng.randrange(len(chunks) + 1), (rng.choice((kind, b"PLTE", b"tRNS", b"iCCP", b"zTXt")), content)
            )
        case 3:
            chunks[number] = (kind, of_bytes(rng, content))
        case _:
            chunks = [(k, zlib.compress(bytes(1 << 20)) if k == b"IDAT" else c) for k, c in chunks]
    parts = [data[:8]]
    for kind, content in chunks:
        parts += [len(content).to_bytes(4, "big"), kind, content, zlib.crc32(kind + content).to_bytes(4, "big")]
    return b"".join(parts)


def of_glb(rng: Random, data: bytes) -> bytes:
    """Another description of the same buffers, with lengths that are right."""
    if len(data) < 20 or data[:4] != b"glTF":
        return of_bytes(rng, data)
    length = int.from_bytes(data[12:16], "little")
    text = of_json(rng, data[20 : 20 + length])
    text += b" " * (-len(text) % 4)
    rest = data[20 + length :]
    if rng.random() < 0.2:
        rest = of_bytes(rng, rest)
    return (
        b"glTF"
        + struct.pack("<II", 2, 20 + len(text) + len(rest))
        + struct.pack("<I", len(text))
        + b"JSON"
        + text
        + rest
    )


def of_safetensors(rng: Random, data: bytes) -> bytes:
    """Another header of the same tensors, with a length that is right."""
    length = int.from_bytes(data[:8], "little")
    if length > len(data):
        return of_bytes(rng, data)
    text = of_json(rng, data[8 : 8 + length])
    return len(text).to_bytes(8, "little") + text + data[8 + length :]


def of_tar(rng: Random, data: bytes) -> bytes:
    """Members changed, left out, repeated or renamed, with sums that are right."""
    members: list[tuple[bytes, bytes]] = []
    at = 0
    while at + 512 <= len(data) and data[at] != 0:
        try:
            size = int(data[at + 124 : at + 135], 8)
        except ValueError:
            return of_bytes(rng, data)
        members.append((data[at : at + 512], data[at + 512 : at + 512 + size]))
        at += 512 + -(-size // 512) * 512
    if not members:
        return of_bytes(rng, data)
    number = rng.randrange(len(members))
    header, content = members[number]
    name = header[:100].rstrip(b"\0")
    match rng.randrange(7):
        case 0:
            del members[number]
        case 1:
            members.insert(number, members[number])
        case 2:
            header = rng.choice(TEXTS).encode("utf-8", "replace")[:99].ljust(100, b"\0") + header[100:]
            members[number] = (header, content)
        case 3:
            kind = rng.choice((b"0", b"1", b"2", b"5", b"L", b"x", b"S", b"g"))
            members[number] = (header[:156] + kind + header[157:], content)
        case _:
            change = {b"npy": of_array, b"json": of_json, b"png": of_png}.get(name.rpartition(b".")[2], of_bytes)
            members[number] = (header, change(rng, content))
    parts = []
    for header, content in members:
        block = bytearray(header[:124] + b"%011o\0" % len(content) + header[136:148] + b" " * 8 + header[156:])
        block[148:156] = b"%06o\0 " % sum(block)
        parts += [bytes(block), content, bytes(-len(content) % 512)]
    return b"".join([*parts, bytes(1024)])


MUTATIONS: dict[str, tuple[Mutation, ...]] = {
    "xml": (of_xml, of_xml, of_xml, of_numbers, of_bytes),
    "json": (of_json, of_json, of_json, of_numbers, of_bytes),
    "text": (of_lines, of_lines, of_numbers, of_numbers, of_bytes),
    "binary": (of_bytes,),
    "npy": (of_array, of_array, of_bytes),
    "npz": (of_npz, of_npz, of_npz, of_bytes),
    "png": (of_png, of_png, of_bytes),
    "glb": (of_glb, of_glb, of_glb, of_bytes),
    "safetensors": (of_safetensors, of_safetensors, of_bytes),
    "tar": (of_tar, of_tar, of_tar, of_bytes),
}
"""Mutations that make sense for each format."""

MAX_BYTES = 400_000
"""Of a mutated file, so that inputs stay quick."""


def mutated(rng: Random, data: bytes, form: str, others: tuple[bytes, ...] = ()) -> bytes:
    """Some bytes of a format, mutated once or several times, at times spliced with other bytes of the format."""
    if others and rng.random() < 0.05:
        other = rng.choice(others)
        data = data[: rng.randrange(len(data) + 1)] + other[rng.randrange(len(other) + 1) :]
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        mutation = rng.choice(MUTATIONS[form])
        try:
            data = mutation(rng, data)[:MAX_BYTES]
        except Exception:  # what an earlier mutation left may be nothing that a structured one can work with
            data = of_bytes(rng, data)
    return data
