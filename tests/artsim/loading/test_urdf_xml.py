"""XML as people write it: what readers built on TinyXML take is read, and other formats are called by their names."""

from __future__ import annotations

import codecs
from pathlib import Path
from time import process_time

import pytest

from artsim import load
from artsim.errors import AssetError
from artsim.model.objects import ArticulatedObject
from tests.conftest import BOX_LAPTOP, installed

BODY = BOX_LAPTOP[BOX_LAPTOP.index("<robot") :]


def loaded(folder: Path, content: str | bytes) -> ArticulatedObject:
    path = folder / "object.urdf"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return load(path)


def check(obj: ArticulatedObject, repair: str) -> None:
    """It is the laptop, and the repair is said (none for an empty one)."""
    assert obj.tree.types == ("free", "revolute")
    assert [part.name for part in obj.parts] == ["base", "lid"]
    assert obj.diagonal == pytest.approx(0.501, abs=1e-3)
    texts = "\n".join(map(str, obj.repairs))
    assert repair in texts if repair else not obj.repairs


@pytest.mark.parametrize(
    ("content", "repair"),
    [
        (BODY, ""),
        ('<?xml version="1.0" encoding="utf-8"?>' + BODY, ""),
        ("<!-- a robot -->\n" + BODY, ""),
        ('<?xml version="0.0" ?>' + BODY, "declares version '0.0'"),
        ('<?xml version="2.7"?>' + BODY, "declares version '2.7'"),
        ("<?xml ?>" + BODY, "declares no version"),
        ('\n\n <?xml version="1.0"?>' + BODY, "declaration does not come first"),
        ('<!-- made by hand --><?xml version="1.0"?>' + BODY, "declaration does not come first"),
        ('my robot <?xml version="1.0"?>' + BODY, "text before its top element left out: 'my robot'"),
        (BODY + "\n that is all", "text after its top element left out: 'that is all'"),
        (BODY + "\r\n\0", ""),
        ('<?xml version="1.0" encoding="ascii"?>' + BODY.replace("hinge", "Gelenk ü"), "not in its declared encoding"),
        ('<?xml version="1.0" encoding="utf-16"?>' + BODY, "not in its declared encoding"),
        ('<?xml version="1.0" encoding="klingon"?>' + BODY, "not in its declared encoding 'klingon'"),
        ('<?xml version="1.0" encoding="zlib"?>' + BODY, "not in its declared encoding 'zlib'"),
    ],
)
def test_what_stands_around_the_robot_does_not_matter(content: str, repair: str, tmp_path: Path) -> None:
    check(loaded(tmp_path, content), repair)


@pytest.mark.parametrize(
    "data",
    [
        codecs.BOM_UTF8 + BODY.encode(),
        ('<?xml version="1.0" encoding="UTF-16"?>' + BODY).encode("utf-16"),
        ('<?xml version="1.0" encoding="UTF-16"?>' + BODY).encode("utf-16-be"),
        ('<?xml version="1.0"?>' + BODY).encode("utf-32"),
        ('<?xml version="1.0" encoding="latin-1"?>' + BODY.replace("hinge", "türe")).encode("latin-1"),
        ('<?xml version="1.0" encoding="windows-1252"?>' + BODY.replace("hinge", "tür€")).encode("cp1252"),
    ],
)
def test_encodings_are_read_as_they_are_marked_or_declared(data: bytes, tmp_path: Path) -> None:
    check(loaded(tmp_path, data), "")


def test_an_undeclared_encoding_is_said(tmp_path: Path) -> None:
    check(loaded(tmp_path, BODY.replace("hinge", "türe").encode("latin-1")), "read as latin-1")


@pytest.mark.parametrize(
    ("old", "new", "repair"),
    [
        ("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ', ""),
        ("<robot ", '<robot xmlns="http://www.ros.org" ', ""),
        ("</robot>", "<sensor:camera name='c'><x/></sensor:camera></robot>", "prefix sensor is not declared"),
        ("</robot>", "<gazebo a:b='1'/></robot>", "prefix a is not declared"),
        ("</robot>", "<!-- <sensor:camera/> --></robot>", ""),
        ("</robot>", "<x:y xmlns:x='u:v'/></robot>", ""),
        ('<robot name="', '<robot version="a>b" name="', ""),
    ],
)
def test_extensions_and_namespaces_are_let_be(old: str, new: str, repair: str, tmp_path: Path) -> None:
    assert old in BODY
    check(loaded(tmp_path, BODY.replace(old, new, 1)), repair)


def test_a_prefix_of_the_whole_document_is_no_extension(tmp_path: Path) -> None:
    prefixed = (
        BODY.replace("</", "\1").replace("<", "<u:").replace("\1", "</u:").replace("<u:robot", '<u:robot xmlns:u="x:y"')
    )
    check(loaded(tmp_path, prefixed), "")


def test_names_in_capitals_are_read_and_said(tmp_path: Path) -> None:
    written = BODY.replace("<axis xyz", "<Axis XYZ").replace('type="revolute"', 'type="Revolute"')
    obj = loaded(tmp_path, written)
    check(obj, "<Axis>, XYZ read in lower case")
    assert obj.tree.joints[1].axis == load_plain(tmp_path).tree.joints[1].axis


def load_plain(folder: Path) -> ArticulatedObject:
    return loaded(folder, BODY)


@pytest.mark.parametrize(
    ("content", "what"),
    [
        ("<sdf version='1.6'><model/></sdf>", "this is SDF"),
        ("<!DOCTYPE html><html><body>404</body></html>", "is a web page"),
        ("<html></html>", "this is a web page"),
        ("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n", "a pointer of Git LFS"),
        (BODY + BODY, "Extra content at the end"),
        (BODY.replace("<robot ", '<robot xmlns:xacro="http://ros.org/wiki/xacro" ').replace(
            "</robot>", "<xacro:include filename='x'/></robot>"), "<xacro:include>"),
        (BODY.replace("</robot>", "<xacro:arm/></robot>"), "<xacro:arm>"),
        (BODY.replace("</robot>", "<include filename='x'/></robot>"), "not expanded yet: it has <include>"),
        (BODY.replace('name="lid"', 'name="${p}lid"'), "'${p}lid' in <link>"),
        (BODY.replace('0.3 0.4 0.02', '$(arg width) 0.4 0.02'), "not expanded"),
    ],
)  # fmt: skip
def test_another_format_is_called_by_its_name(content: str, what: str, tmp_path: Path) -> None:
    with pytest.raises(AssetError) as error:
        loaded(tmp_path, content)
    assert what in str(error.value)
    assert "Fix: " in str(error.value)


def test_a_line_number_is_that_of_the_file(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="line 4"):
        loaded(tmp_path, '\n<?xml version="1.0"?>\n\n<robot name="r"><link></robot>')


@pytest.mark.parametrize(
    "content",
    [
        "<!--" * 1_000_000,
        "<?" * 2_000_000,
        "<robot>" + "<!--" * 1_000_000,
        "<robot " + "a" * 4_000_000,
        "<robot " + 'a="b" ' * 600_000,
        "<robot>" + "".join(f"<p{i}:a/>" for i in range(300_000)),
        "<robot>" + " a:b" + " " * 4_000_000,
    ],
)
def test_hostile_text_takes_time_in_its_length_only(content: str, tmp_path: Path) -> None:
    start = process_time()
    with pytest.raises(AssetError):
        loaded(tmp_path, content)
    assert process_time() - start < 2.0


def test_pybullet_reads_what_we_read(tmp_path: Path) -> None:
    """The oracle for what tools built on TinyXML take; none of these is XML."""
    bullet = installed("pybullet")
    client = bullet.connect(bullet.DIRECT)
    try:
        for content in ('\n <?xml version="1.0"?>' + BODY, '<?xml version="0.0"?>' + BODY,
                        BODY.replace("</robot>", "<sensor:camera/></robot>")):  # fmt: skip
            check(loaded(tmp_path, content), "XML")
            body = bullet.loadURDF(str(tmp_path / "object.urdf"), physicsClientId=client)
            assert bullet.getNumJoints(body, physicsClientId=client) == 1
    finally:
        bullet.disconnect(client)


def test_a_folder_of_macros_alone_says_how_to_expand_them(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf.xacro").write_text("<robot/>")
    with pytest.raises(AssetError) as error:
        load(tmp_path)
    assert f"xacro {tmp_path}/arm.urdf.xacro > {tmp_path}/arm.urdf" in str(error.value)
