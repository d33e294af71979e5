"""XML as people write it becomes XML that a parser accepts, and elements get the names that URDF gives them.

Tools built on TinyXML read files that are not XML: with blank lines before the declaration, with a version 0.0, with
prefixes that nothing declares, with attributes that touch each other. Such files are mended as text before they are
parsed, and every mend is recorded.
"""

import codecs
import re
import shlex
from pathlib import Path

from lxml import etree

from artsim.errors import AssetError
from artsim.model.objects import Repair

WHERE = "XML"
_BOMS = ((codecs.BOM_UTF8, "utf-8"), (codecs.BOM_UTF32_LE, "utf-32"), (codecs.BOM_UTF32_BE, "utf-32"),
         (codecs.BOM_UTF16_LE, "utf-16"), (codecs.BOM_UTF16_BE, "utf-16"))  # fmt: skip
# Encodings of text alone: others that Python knows unpack archives or evaluate escapes.
_ENCODINGS = re.compile(
    r"utf-?(8|16|32)(-?[lb]e)?|(us-?)?ascii|iso-?8859-\d+|latin-?\d|(cp|windows-?)\d+|gb(k|2312|18030)|big5|shift_?jis"
    r"|euc-(jp|kr)|koi8-[ru]",
    re.IGNORECASE,
)
_DECLARATION = re.compile(r"<\?xml\b([^>]*?)\?>", re.IGNORECASE)
_OPENING = re.compile(r"""(<[^\s/>]+)(?:\s+[^\s=>/]+\s*=\s*(?:"[^"]*"|'[^']*'))*\s*/?>""")
_DECLARED = re.compile(r"\sxmlns:([\w.-]+)\s*=")
_TOUCHING = re.compile(r"""["'](?<=[^=\s].)(?=[A-Za-z_][\w.:-]{0,100}\s{0,9}=\s{0,9}["'])""")
_BARE_AND = re.compile(r"&(?!#?\w{1,20};)")
_MAX_PREFIXES = 100
_NOT_EXPANDED = "is a xacro file that is not expanded yet: it has "
UNDECLARED = "urn:undeclared:"

_OTHER_FORMATS = {
    "sdf": "SDF", "gazebo": "SDF", "world": "SDF", "mujoco": "MJCF, MuJoCo's format", "html": "a web page",
    "collada": "a COLLADA mesh", "launch": "a ROS launch file", "package": "a ROS package manifest",
}  # fmt: skip
_ELEMENTS = {
    "robot", "link", "joint", "visual", "collision", "inertial", "geometry", "origin", "axis", "limit", "mimic",
    "parent", "child", "box", "cylinder", "capsule", "sphere", "mesh", "material",
}  # fmt: skip
_ATTRIBUTES = {
    "name", "type", "xyz", "rpy", "quat_xyzw", "link", "joint", "lower", "upper", "multiplier", "offset", "size",
    "radius", "length", "filename", "scale",
}  # fmt: skip


def readable_xml(data: bytes, where: Path) -> tuple[bytes, list[Repair]]:
    """The document as UTF-8 without a declaration, every prefix declared, and nothing around its top element.

    Lines keep their numbers. What is no XML at all is handed on as it is: the parser says what is wrong.

    Raises
    ------
    AssetError
        When it is a pointer to a file that was not downloaded, or a web page.
    """
    if data.startswith(b"version https://git-lfs"):
        raise AssetError(
            "is a pointer of Git LFS, not the file itself",
            where,
            f"cd {shlex.quote(str(where.parent))} && git lfs pull",
        )
    repairs: list[Repair] = []
    text = _decode(data, repairs)
    start, stray = _prolog(text)
    if text[start : start + 14].lower() == "<!doctype html":
        raise AssetError("is a web page, not URDF", where, "download the raw file")
    if start < 0:
        return data, []
    _judge_prolog(text[:start], stray, repairs)
    body = _as_tinyxml_reads(_without_tail(text[start:], repairs), repairs)
    return ("\n" * text.count("\n", 0, start) + _with_prefixes(body, repairs)).encode(), repairs


def _decode(data: bytes, repairs: list[Repair]) -> str:
    """Text by its byte order mark, else as declared, else as UTF-8, which most files are whatever they declare."""
    for mark, encoding in _BOMS:
        if data.startswith(mark):
            try:
                return data.decode("utf-8-sig" if encoding == "utf-8" else encoding)
            except UnicodeDecodeError:
                break
    wide = {b"<\0": "utf-16-le", b"\0<": "utf-16-be"}.get(data[:2])
    declared = re.search(rb"""encoding\s*=\s*["']([\w.:-]+)["']""", data[:1000])
    name = wide or (declared[1].decode("ascii", "replace") if declared else "utf-8")
    for encoding in (name, "utf-8"):
        if _ENCODINGS.fullmatch(encoding):
            try:
                text = data.decode(encoding)
            except (UnicodeDecodeError, LookupError):
                continue
            if "<" in text:  # narrow text that claims to be wide decodes to nonsense
                if encoding != name:
                    repairs.append(Repair(WHERE, f"is not in its declared encoding {name!r}: read as {encoding}"))
                return text
    repairs.append(Repair(WHERE, f"is not in the encoding {name!r}: read as latin-1"))
    return data.decode("latin-1")


def _prolog(text: str) -> tuple[int, str]:
    """Where the top element, or a document type, begins (-1 for nowhere), and the stray text before it."""
    at, stray = 0, []
    while True:
        begin = text.find("<", at)
        stray.append(text[at:begin].strip("\ufeff \t\r\n"))
        if begin < 0:
            return -1, ""
        # One pass over the text: an expression that skips comments takes quadratic time where none is closed.
        close = "-->" if text.startswith("<!--", begin) else "?>" if text.startswith("<?", begin) else ""
        if not close:
            return begin, " ".join(filter(None, stray))
        end = text.find(close, begin)
        if end < 0:
            return -1, ""
        at = end + len(close)


def _judge_prolog(prolog: str, stray: str, repairs: list[Repair]) -> None:
    """Record what stands before the top element and should not."""
    declaration = _DECLARATION.search(prolog)
    if declaration is not None:
        if declaration.start() > 0:
            repairs.append(Repair(WHERE, "its declaration does not come first: what comes before it is left out"))
        version = re.search(r"""version\s*=\s*["']([^"']*)["']""", declaration[1])
        if version is None or version[1] not in ("1.0", "1.1"):
            said = "no version" if version is None else f"version {version[1][:20]!r}"
            repairs.append(Repair(WHERE, f"declares {said}: read as version 1.0"))
    if stray:
        repairs.append(Repair(WHERE, f"text before its top element left out: {stray[:40]!r}"))


def _without_tail(body: str, repairs: list[Repair]) -> str:
    """The document without stray text after its end; another element there stays, and is an error."""
    end = body.rfind(">") + 1
    tail = body[end:].strip("\0 \t\r\n")
    if end == 0:
        return body
    if tail:
        repairs.append(Repair(WHERE, f"text after its top element left out: {tail[:40]!r}"))
    return body[:end]


def _as_tinyxml_reads(body: str, repairs: list[Repair]) -> str:
    """The document with blanks between attributes that touch, ``&`` written out, and comments that hold no ``--``."""
    if "--" in body.replace("<!--", "").replace("-->", ""):
        body = _without_comments(body)
    for pattern, by, said in (
        (_TOUCHING, r"\g<0> ", "attributes that touch each other read as if a blank stood between them"),
        (_BARE_AND, "&amp;", "& read as a character of its own"),
    ):
        body, count = pattern.subn(by, body)
        if count:
            repairs.append(Repair(WHERE, said))
    return body


def _without_comments(body: str) -> str:
    """The document without comments, on the same lines; one that does not end stays."""
    kept, at = [], 0
    while (begin := body.find("<!--", at)) >= 0 and (end := body.find("-->", begin + 4)) >= 0:
        kept += [body[at:begin], "\n" * body.count("\n", begin, end)]
        at = end + 3
    return "".join([*kept, body[at:]])


def _with_prefixes(body: str, repairs: list[Repair]) -> str:
    """The document with every prefix declared that an element or attribute has."""
    opening = _OPENING.match(body)
    if opening is None:
        return body
    seen = "".join(piece.partition("-->")[2] if i else piece for i, piece in enumerate(body.split("<!--")))
    used = set(re.findall(r"</?([A-Za-z_][\w.-]*):", seen)) | set(re.findall(r"\s([A-Za-z_][\w.-]*):[\w.-]+\s*=", seen))
    missing = sorted(used - {*_DECLARED.findall(opening[0]), "xml", "xmlns"})
    if not missing or len(missing) > _MAX_PREFIXES:
        return body
    unknown = sorted(set(missing) - set(_DECLARED.findall(body)))
    if unknown:
        repairs.append(
            Repair(WHERE, f"prefix {', '.join(unknown)} is not declared: its elements are taken for extensions")
        )
    spaces = "".join(f' xmlns:{prefix}="{UNDECLARED}{prefix}"' for prefix in missing)
    return opening[0][: opening.end(1)] + spaces + body[opening.end(1) :]


def use_plain_names(root: etree._Element, where: Path) -> list[Repair]:
    """Give elements the names of URDF: without the namespace of the top element, in lower case.

    Elements of other namespaces are extensions, and keep their names.

    Raises
    ------
    AssetError
        When the document is of another format, or has to be expanded by xacro first.
    """
    own = etree.QName(root).namespace
    respelt: dict[str, None] = {}
    for element in root.iter(etree.Element):
        name = etree.QName(element)
        if name.namespace not in (None, own):
            if "xacro" in str(name.namespace):
                raise xacro_error(_NOT_EXPANDED + f"<{element.prefix}:{name.localname}>", where)
            continue
        plain = name.localname
        if plain not in _ELEMENTS and plain.lower() in _ELEMENTS:
            respelt[f"<{plain}>"] = None
            plain = plain.lower()
        if element.tag != plain:
            element.tag = plain
        for key in list(element.attrib) if plain in _ELEMENTS else ():
            if key not in _ATTRIBUTES and key.lower() in _ATTRIBUTES and key.lower() not in element.attrib:
                respelt[key] = None
                element.set(key.lower(), element.attrib.pop(key))
    _refuse_other_formats(root, where)
    _refuse_unexpanded(root, where)
    if not respelt:
        return []
    return [Repair(WHERE, f"{', '.join([*respelt][:5])} read in lower case, as URDF has its names")]


def _refuse_other_formats(root: etree._Element, where: Path) -> None:
    if root.tag == "robot":
        return
    other = _OTHER_FORMATS.get(str(root.tag).lower())
    is_other = f": this is {other}" if other else ""
    raise AssetError(
        f"the top element is <{root.tag}>, not <robot>{is_other}", where, "pass the object's URDF file, or convert it"
    )


def _refuse_unexpanded(root: etree._Element, where: Path) -> None:
    """Macros of xacro that have not been replaced; what they stand for would be missing."""
    for element in root:
        if element.tag in ("include", "macro"):
            raise xacro_error(_NOT_EXPANDED + f"<{element.tag}>", where)
        if element.tag in ("link", "joint"):
            for inner in element.iter(etree.Element):
                for value in inner.attrib.values():
                    if "${" in value or "$(" in value:
                        raise xacro_error(_NOT_EXPANDED + f"{value[:60]!r} in <{inner.tag}>", where)


def xacro_error(what: str, where: Path) -> AssetError:
    """The error about a file of xacro, with the command that expands it."""
    name = where.name.removesuffix(".xacro").removesuffix(".urdf")
    target = where.with_name(f"{name}.urdf" if where.suffix == ".xacro" else f"{name}_expanded.urdf")
    command = f"xacro {shlex.quote(str(where))} > {shlex.quote(str(target))}"
    return AssetError(what, where, f"{command} and pass that file (xacro comes with ROS, or pip install xacro)")
