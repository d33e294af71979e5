"""Where the files are that a URDF names: the usual layouts load as given, and nothing outside an asset is read."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
import trimesh

from artsim import load
from artsim.errors import AssetError
from artsim.loading.packages import AssetPaths, MissingFileError
from artsim.loading.roots import PackageRoots

CUBE = trimesh.creation.box((1, 1, 1)).export(file_type="obj")
MANIFEST = '<?xml version="1.0"?><package format="2"><name>{}</name></package>'


def place(folder: Path, urdf: str, filename: str, *files: str, **manifests: str) -> Path:
    """A URDF with one mesh, beside other files, and package manifests by folder ('_' is the top)."""
    for name in files:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(CUBE)
    for where, package in manifests.items():
        (folder / ("." if where == "_" else where)).mkdir(parents=True, exist_ok=True)
        (folder / ("." if where == "_" else where) / "package.xml").write_text(MANIFEST.format(package))
    path = folder / urdf
    path.parent.mkdir(parents=True, exist_ok=True)
    geometry = f'<geometry><mesh filename="{filename}"/></geometry>'
    path.write_text(f'<robot name="r"><link name="a"><visual>{geometry}</visual></link></robot>')
    return path


def said(path: Path) -> str:
    return "\n".join(map(str, load(path).repairs))


@pytest.mark.parametrize(
    ("urdf", "filename", "file", "manifests", "repair"),
    [
        ("foo/urdf/r.urdf", "package://foo/meshes/m.obj", "foo/meshes/m.obj", {"foo": "foo"}, ""),
        ("foo/urdf/r.urdf", "package://foo/meshes/m.obj", "foo/meshes/m.obj", {}, ""),
        ("main/urdf/x/r.urdf", "package://foo/meshes/m.obj", "main/meshes/m.obj", {"main": "foo"}, ""),
        ("repo/robots/a/urdf/r.urdf", "package://pkg/robots/a/m.obj", "repo/robots/a/m.obj", {"repo": "pkg"}, ""),
        ("foo/robots/v1/r.urdf", "package://foo/meshes/m.obj", "foo/meshes/m.obj", {}, ""),
        ("foo/r.urdf", "package://foo/meshes/m.obj", "foo/meshes/m.obj", {}, ""),
        ("x/r.urdf", "package://foo/meshes/m.obj", "x/foo/meshes/m.obj", {}, "is taken for a folder in 'x'"),
        ("x/r.urdf", "package://meshes/m.obj", "x/meshes/m.obj", {}, "is taken for a folder in 'x'"),
        ("x/r.urdf", "package:///x/meshes/m.obj", "x/meshes/m.obj", {}, ""),
        ("x/urdf/r.urdf", "package://foo/meshes/m.obj", "x/meshes/m.obj", {}, "taken to be 'x', the asset's own"),
        ("x/urdf/r.urdf", "model://foo/meshes/m.obj", "x/meshes/m.obj", {}, "taken to be 'x', the asset's own"),
        ("x/urdf/r.urdf", "package://drake/a/x/meshes/m.obj", "x/meshes/m.obj", {}, "read from 'x' on"),
        ("x/urdf/r.urdf", "package://foo/old/meshes/m.obj", "x/meshes/m.obj", {}, "from 'meshes' on"),
        ("x/xml/r.urdf", "package://foo/meshes/m.obj", "x/meshes/m.obj", {}, "taken to be 'x', the asset's own"),
        ("w/d/x/urdf/r.urdf", "meshes/m.obj", "w/d/x/meshes/m.obj", {"w": "w"}, "read from 'x' on"),
        ("x/urdf/r.urdf", "/home/bob/ws/src/x/meshes/m.obj", "x/meshes/m.obj", {}, "read from 'x' on"),
        ("x/urdf/r.urdf", r"C:\\ws\\x\\meshes\\m.obj", "x/meshes/m.obj", {}, "read from 'x' on"),
        ("x/urdf/r.urdf", "../meshes/m.obj", "x/meshes/m.obj", {}, ""),
        ("x/robots/r.urdf", "../meshes/m.obj", "x/meshes/m.obj", {}, ""),
        ("x/variation/r.urdf", "../meshes/m.obj", "x/meshes/m.obj", {}, ""),
        ("x/a/b/r.urdf", "../../c/m.obj", "x/c/m.obj", {"x": "other_name"}, ""),
        ("x/urdf/r.urdf", "meshes/m.obj", "x/meshes/m.obj", {}, "read from 'x' on, not from the URDF's folder"),
        ("x/r.urdf", r"meshes\\m.obj", "x/meshes/m.obj", {}, ""),
        ("x/r.urdf", "./meshes//m.obj", "x/meshes/m.obj", {}, ""),
        ("x/r.urdf", "meshes/my%20mesh.obj", "x/meshes/my mesh.obj", {}, ""),
        ("x/r.urdf", "meshes/50%25.obj", "x/meshes/50%25.obj", {}, ""),
        ("x/r.urdf", "file://meshes/m.obj", "x/meshes/m.obj", {}, ""),
        ("x/r.urdf", "Meshes/M.OBJ", "x/meshes/m.obj", {}, "'Meshes/M.OBJ' is 'm.obj' on disk"),
        ("x/urdf/r.urdf", "package://x/MESHES/m.obj", "x/meshes/m.obj", {}, "on disk: read"),
    ],
)  # fmt: skip
def test_the_usual_layouts_load_as_given(
    urdf: str, filename: str, file: str, manifests: dict[str, str], repair: str, tmp_path: Path
) -> None:
    path = place(tmp_path, urdf, filename.replace("\\\\", "\\"), file, **manifests)
    assert repair in said(path) if repair else not load(path).repairs


@pytest.mark.parametrize("scheme", ["", "file://", "file://localhost"])
def test_absolute_names_inside_the_asset_are_read(scheme: str, tmp_path: Path) -> None:
    mesh = tmp_path / "x" / "meshes" / "m.obj"
    assert not said(place(tmp_path, "x/urdf/r.urdf", f"{scheme}{mesh}", "x/meshes/m.obj"))


@pytest.mark.parametrize(
    ("urdf", "filename", "file", "manifests"),
    [
        ("x/r.urdf", "../secret/m.obj", "secret/m.obj", {}),
        ("x/urdf/r.urdf", "../../secret/m.obj", "secret/m.obj", {}),
        ("x/urdf/r.urdf", "../../secret/m.obj", "secret/m.obj", {"x": "x"}),
        ("x/urdf/r.urdf", "package://x/../secret/m.obj", "secret/m.obj", {"x": "x"}),
        ("x/urdf/r.urdf", "package://x/../secret/m.obj", "secret/m.obj", {}),
        ("x/urdf/r.urdf", "package://../../secret/m.obj", "secret/m.obj", {}),
        ("x/urdf/r.urdf", "package://x/%2e%2e/secret/m.obj", "secret/m.obj", {"x": "x"}),
        ("x/r.urdf", r"..\secret\m.obj", "secret/m.obj", {}),
        ("s/x/y/z/u/r.urdf", "package://s/secret/m.obj", "s/secret/m.obj", {}),  # too far up for a name alone
        ("s/x/urdf/r.urdf", "package://s/secret/m.obj", "s/secret/m.obj", {"s/x": "x", "s": "s"}),  # the nearest counts
        ("x/urdf/r.urdf", "package://y/meshes/m.obj", "y/meshes/m.obj", {"x": "x", "y": "y"}),  # a package beside
    ],
)
def test_nothing_outside_is_read(
    urdf: str, filename: str, file: str, manifests: dict[str, str], tmp_path: Path
) -> None:
    path = place(tmp_path, urdf, filename, file, **manifests)
    with pytest.raises(AssetError, match="--package-root"):
        load(path)
    link = tmp_path / Path(urdf).parent / "link.obj"
    link.symlink_to(tmp_path / file)
    with pytest.raises(AssetError, match="lies outside the asset's folder"):
        load(place(tmp_path, urdf, "link.obj", **manifests))


def test_a_file_after_others_of_its_folder_is_judged_by_itself(tmp_path: Path) -> None:
    folder, secret = tmp_path / "x" / "meshes", tmp_path / "secret" / "m.obj"
    for file in (folder / "a.obj", folder / "b.obj", secret):
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("v 0 0 0")
    (folder / "link.obj").symlink_to(secret)
    (folder / "inner.obj").symlink_to(folder / "b.obj")
    paths = AssetPaths(tmp_path / "x", {})
    assert [paths.resolve(f"meshes/{name}") for name in ("a.obj", "b.obj", "inner.obj")] == [
        folder / name for name in ("a.obj", "b.obj", "inner.obj")
    ]
    assert paths.resolve("meshes/A.obj") == folder / "a.obj"
    for name in ("meshes/link.obj", "meshes/../../secret/m.obj"):
        with pytest.raises(AssetError, match="outside"):
            paths.resolve(name)
    for name in ("meshes/c.obj", "meshes/..", "meshes/", "meshes/a\0.obj"):
        with pytest.raises((MissingFileError, AssetError)):
            paths.resolve(name)


def test_a_home_and_the_folder_of_temporary_files_are_no_assets(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from artsim.loading import packages

    monkeypatch.setattr(packages, "_home", lambda: tmp_path)
    for name in ("../m.obj", f"package://{tmp_path.name}/m.obj"):
        with pytest.raises(AssetError, match="--package-root"):
            load(place(tmp_path, "urdf/r.urdf", name, "m.obj"))
    (tmp_path / "package.xml").write_text(MANIFEST.format("home"))
    with pytest.raises(AssetError, match="--package-root"):
        load(place(tmp_path, "urdf/r.urdf", "package://home/m.obj", "m.obj"))


def fix_of(path: Path) -> list[str]:
    """The option that an error says, as a shell would read it."""
    with pytest.raises(AssetError) as error:
        load(path)
    words = shlex.split(str(error.value.fix))
    return words[words.index("--package-root") :][:2]


@pytest.mark.parametrize(
    ("urdf", "filename", "file", "manifests"),
    [
        ("x y/urdf/r.urdf", "package://y/meshes/m.obj", "y/meshes/m.obj", {"x y": "x", "y": "y"}),
        ("z/x/r.urdf", "../sec ret/m.obj", "z/sec ret/m.obj", {}),
        ("z/a/b/r.urdf", "../../arms/c/m.obj", "z/arms/c/m.obj", {}),
    ],
)
def test_where_the_file_is_found_the_option_can_be_pasted(
    urdf: str, filename: str, file: str, manifests: dict[str, str], tmp_path: Path
) -> None:
    import tyro

    path = place(tmp_path, urdf, filename, file, **manifests)
    roots: dict[str, Path] = tyro.cli(dict_of_roots, args=fix_of(path))
    assert load(path, package_roots=roots).parts[0].name == "a"


def dict_of_roots(package_root: PackageRoots) -> dict[str, Path]:
    return dict(package_root)


def test_where_it_is_not_found_the_option_names_the_package(tmp_path: Path) -> None:
    assert fix_of(place(tmp_path, "x/r.urdf", "package://foo/m.obj")) == ["--package-root", "foo=/path/to/foo"]
    assert fix_of(place(tmp_path, "x/r.urdf", "gone.obj")) == ["--package-root", "x=/path/to/x"]
    assert fix_of(place(tmp_path, "x/r.urdf", "/gone/far/m.obj")) == ["--package-root", "far=/gone/far"]
    assert fix_of(place(tmp_path, "x/r.urdf", "package://a\u202e/m.obj"))[1].startswith("NAME=")


def test_a_declared_root_is_where_its_package_is(tmp_path: Path) -> None:
    path = place(tmp_path, "x/r.urdf", "package://foo/m.obj", "x/m.obj", "elsewhere/m.obj")
    assert not load(path, package_roots={"foo": tmp_path / "elsewhere"}).repairs
    with pytest.raises(AssetError, match=r"put 'm\.obj' into"):  # not another of this name
        load(path, package_roots={"foo": tmp_path})
    with pytest.raises(AssetError, match="no such folder"):
        load(path, package_roots={"foo": tmp_path / "nowhere"})


def test_a_mesh_that_is_not_beside_the_urdf_is_found_in_a_declared_root(tmp_path: Path) -> None:
    path = place(tmp_path, "x/r.urdf", "m.obj", "elsewhere/m.obj")
    assert len(load(path, package_roots={"meshes": tmp_path / "elsewhere"}).parts) == 1


def test_roots_add_up_however_they_are_given() -> None:
    import tyro

    words = ["--package-root", "a=/x", "b=/y=z", "--package-root", "c=."]
    assert tyro.cli(dict_of_roots, args=words) == {"a": Path("/x"), "b": Path("/y=z"), "c": Path()}


def test_an_address_on_the_web_is_told(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match=r"is not a file.*download it"):
        load(place(tmp_path, "x/r.urdf", "https://example.org/m.obj"))


@pytest.mark.parametrize(
    "manifest", ["", "<package>", "<!DOCTYPE p [<!ENTITY e 'x'>]><package><name>&e;</name></package>"]
)
def test_a_broken_manifest_names_nothing_but_marks_its_folder(manifest: str, tmp_path: Path) -> None:
    path = place(tmp_path, "p/a/b/r.urdf", "../../m.obj", "p/m.obj")
    (tmp_path / "p" / "package.xml").write_text(manifest)
    assert len(load(path).parts) == 1


def run(monkeypatch: pytest.MonkeyPatch, *words: str) -> None:
    from artsim.commands.verbs import main

    monkeypatch.setattr("sys.argv", ["artsim", *words])
    main()


def test_what_the_command_line_says_can_be_pasted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    path = place(tmp_path, "z/x/r.urdf", "../my parts/m.obj", "z/my parts/m.obj")
    with pytest.raises(SystemExit):
        run(monkeypatch, "inspect", str(path))
    option = "--package-root" + capsys.readouterr().err.partition("--package-root")[2]
    run(monkeypatch, "inspect", str(path), *shlex.split(option))
    assert "1 parts, 0 free joints, 12 triangles" in capsys.readouterr().out


def test_every_command_that_loads_objects_takes_package_roots() -> None:
    import tyro

    from artperl.commands.verbs import Evaluate, Train
    from artsim.commands.verbs import Generate, Grasps, Inspect, Record, Scene, View

    roots = ["--package-root", "a=/x", "b=/y"]
    expected = {"a": Path("/x"), "b": Path("/y")}
    assert tyro.cli(Generate, args=["--out", "o", *roots]).package_root == expected
    assert tyro.cli(Grasps, args=["o", *roots]).package_root == expected
    assert tyro.cli(Inspect, args=["o", *roots]).package_root == expected
    assert tyro.cli(View, args=["o", *roots]).package_root == expected
    assert tyro.cli(Train, args=roots).package_roots == expected
    assert tyro.cli(Evaluate, args=["laptop", *roots]).package_root == expected
    assert tyro.cli(Record, args=["--out", "o", *roots]).episode.package_root == expected
    assert tyro.cli(Scene, args=["--out", "o", *roots]).options.scene.package_root == expected


@pytest.mark.parametrize(
    "name", ["a" * 5000, "a%00b.obj", "package://p/" + "a" * 300 + ".obj", "../" * 2000 + "m.obj", "~/m.obj"]
)
def test_names_that_no_file_can_have_are_missing_files(name: str, tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="--package-root"):
        load(place(tmp_path, "x/r.urdf", name))
