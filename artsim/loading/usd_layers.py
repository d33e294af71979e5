"""Opens an untrusted USD file: every layer that it is made of lies in its folder, and what it expands to is bounded."""

from __future__ import annotations

import posixpath
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from artsim.common.extras import needs
from artsim.common.files import read_bounded
from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits
from artsim.loading.usd_bytes import MAGIC, problem_of
from artsim.loading.usd_expansion import Expansion
from artsim.loading.usd_packages import members

PACKAGE = ".usdz"
_LAYERS = (".usda", ".usdc", ".usd")
SUFFIXES = (*_LAYERS, PACKAGE)
_MAX_LAYERS = 200


def open_stage(file: Path, limits: LoadLimits) -> tuple[Any, list[bytes]]:
    """A USD stage, and the content of the layers that it takes in besides the file itself.

    Raises
    ------
    AssetError
        When a layer cannot be read, lies outside the file's folder, or is over a limit.
    ConfigError
        When usd-core is not installed.
    """
    with needs("USD files"):
        from pxr import Tf, Usd

    layers = _Layers(file, limits)
    Expansion(file, layers.stack, layers.beside).check(layers.root)
    try:
        stage = Usd.Stage.Open(layers.opened[layers.root])
    except Tf.ErrorException as error:
        raise unreadable(file, error) from error
    return stage, layers.contents


class _Layers:
    """All layers that a file takes in, looked at before usd-core reads them.

    Layers are named as usd-core names them: by their path, or by that of their package and their name in it.
    """

    def __init__(self, file: Path, limits: LoadLimits):
        self._file, self._limits, self._room = file, limits, limits.max_total_mesh_bytes
        self._packages: dict[str, Mapping[str, bytes]] = {}
        self._places: dict[str, tuple[Path, str]] = {}
        self._stacks: dict[str, list[Any]] = {}
        self.opened: dict[str, Any] = {}
        self.contents: list[bytes] = []
        self.root = self._name(file.resolve(), "")
        waiting = [self.root]
        while waiting:
            name = waiting.pop()
            if name in self.opened:
                continue
            if len(self.opened) >= _MAX_LAYERS:
                raise self._too_many()
            layer = self.opened[name] = self._open(name)
            waiting += [self.beside(layer, other) for other in layer.GetCompositionAssetDependencies() if other]

    def stack(self, name: str) -> list[Any]:
        """The layer of a name and its sublayers, each as often as it is one."""
        if name not in self._stacks:
            self._stacks[name] = self._with_sublayers(name, ())
        return self._stacks[name]

    def _with_sublayers(self, name: str, above: tuple[str, ...]) -> list[Any]:
        layer = self.opened[name]
        found = [layer]
        for path in layer.subLayerPaths:
            below = self.beside(layer, path)
            if below not in (*above, name):  # else a circle, which USD leaves out
                found += self._with_sublayers(below, (*above, name))
            if len(found) > _MAX_LAYERS:
                raise self._too_many()
        return found

    def _too_many(self) -> AssetError:
        return AssetError(f"it is made of over {_MAX_LAYERS} layers", self._file, "flatten it: usdcat --flatten")

    def beside(self, layer: Any, name: str) -> str:
        """Name of the layer that another one names, which lies in the folder of the file, or in the same package."""
        path, member = self._places[next(key for key, value in self.opened.items() if value == layer)]
        if path.suffix.lower() == PACKAGE:
            inner = posixpath.normpath(posixpath.join(posixpath.dirname(member), name))
            if inner in self._packages[str(path)] and inner.lower().endswith(_LAYERS):
                return self._name(path, inner)
            raise self._not_beside(name, path, "missing in the package, or no USD layer")
        try:
            found = (path.parent / name).resolve()
            inside = found.is_relative_to(self._file.parent.resolve()) and found.is_file()
        except (OSError, ValueError, RuntimeError):  # a name that no file can have
            inside = False
        # Names with arguments or inside packages mean other files than they seem to.
        if not inside or ":" in name or "[" in name or found.suffix.lower() not in SUFFIXES:
            raise self._not_beside(name, path, "missing, outside the file's folder, or no USD layer")
        return self._name(found, "")

    def _not_beside(self, name: str, path: Path, why: str) -> AssetError:
        return AssetError(
            f"takes in {name[:100]!r}, which is {why}",
            path,
            "put it there, or write all into one file: usdcat --flatten",
        )

    def _name(self, path: Path, member: str) -> str:
        if path.suffix.lower() != PACKAGE:
            name = str(path)
        else:
            inside = self._package(path)
            first = next(iter(inside))
            if not first.lower().endswith(_LAYERS):
                raise unreadable(path, f"its first member, {first[:100]!a}, is no USD layer")
            member = member or first
            name = str(path) if member == first else f"{path}[{member}]"
        self._places[name] = path, member
        return name

    def _package(self, path: Path) -> Mapping[str, bytes]:
        if str(path) not in self._packages:
            try:
                self._packages[str(path)] = members(self._read(path, "USDZ file"))
            except ValueError as error:
                raise unreadable(path, error) from error
        return self._packages[str(path)]

    def _read(self, path: Path, what: str) -> bytes:
        size = min(self._room, self._limits.max_mesh_bytes)
        data = read_bounded(path, size, what, inside=self._file.parent)
        self._room -= len(data)
        if path != self._file.resolve():
            self.contents.append(data)
        return data

    def _open(self, name: str) -> Any:
        """A layer as it is now, after a look at its bytes."""
        from pxr import Sdf, Tf

        path, member = self._places[name]
        data = self._packages[str(path)][member] if member else self._read(path, "USD layer")
        problem = problem_of(data)
        if problem is not None:
            raise unreadable(path, problem)
        try:
            layer = Sdf.Layer.Find(name)
            if layer is None:
                layer = Sdf.Layer.FindOrOpen(name)
            else:  # as this process opened it before: the file may be another one by now
                layer.Reload(force=True)
        except Tf.ErrorException as error:
            raise unreadable(path, error) from error
        if layer is None:
            raise unreadable(path, "unknown content")
        if data.startswith(MAGIC):
            _check_specs(layer, path)
        return layer


def _check_specs(layer: Any, path: Path) -> None:
    """Refuse a layer that lists what it does not hold: usd-core ends the process where it meets that.

    Raises
    ------
    AssetError
    """

    def look(spec: Any) -> None:
        is_object = spec.isEmpty or spec.IsPrimPath() or spec.IsPrimVariantSelectionPath() or spec.IsPrimPropertyPath()
        if is_object and layer.GetObjectAtPath(spec) is None:  # the targets of a relationship are no objects
            lost.append(spec)

    lost: list[Any] = []
    layer.Traverse(layer.pseudoRoot.path, look)
    if lost:
        raise unreadable(path, "it lists prims or properties that it does not hold")


def unreadable(path: Path, why: object) -> AssetError:
    try:
        text = " ".join(str(why).split())
    except UnicodeDecodeError:  # USD quotes the file, whatever its bytes are
        text = "it is not text"
    reason = (text.partition(" : ")[2] or text)[:300]  # what comes first is a place in USD's own source
    return AssetError(f"is no USD layer that can be read ({reason})", path, "write it again, or convert it with usdcat")
