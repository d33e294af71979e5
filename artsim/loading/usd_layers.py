"""Opens an untrusted USD file: every layer that it is made of lies in its folder, and what it expands to is bounded."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from artsim.common.extras import needs
from artsim.common.files import read_bounded
from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits
from artsim.loading.usd_bytes import problem_of

SUFFIXES = (".usd", ".usda", ".usdc")
_MAX_LAYERS = 200
_MAX_PRIMS = 200_000
"""Prims of the composed scene. Each takes some 10 microseconds and a few kilobytes."""


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
        from pxr import Sdf, Tf, Usd

    contents: list[bytes] = []
    layers: dict[Path, Any] = {}
    room = limits.max_total_mesh_bytes
    waiting = [file.resolve()]
    while waiting:
        path = waiting.pop()
        if path in layers:
            continue
        if len(layers) >= _MAX_LAYERS:
            raise AssetError(f"it is made of over {_MAX_LAYERS} layers", file, "flatten it: usdcat --flatten")
        data = read_bounded(path, min(room, limits.max_mesh_bytes), "USD layer", inside=file.parent)
        room -= len(data)
        if layers:
            contents.append(data)
        problem = problem_of(data)
        if problem is not None:
            raise unreadable(path, problem)
        try:
            layer = Sdf.Layer.Find(str(path))
            if layer is None:
                layer = Sdf.Layer.FindOrOpen(str(path))
            else:  # as this process opened it before: the file may be another one by now
                layer.Reload(force=True)
        except Tf.ErrorException as error:
            raise unreadable(path, error) from error
        if layer is None:
            raise unreadable(path, "unknown content")
        layers[path] = layer
        waiting += [_beside(name, path, file) for name in layer.GetCompositionAssetDependencies() if name]
    _check_expansion(list(layers.values()), file)
    try:
        stage = Usd.Stage.Open(layers[file.resolve()])
    except Tf.ErrorException as error:
        raise unreadable(file, error) from error
    return stage, contents


def unreadable(path: Path, why: object) -> AssetError:
    try:
        text = " ".join(str(why).split())
    except UnicodeDecodeError:  # USD quotes the file, whatever its bytes are
        text = "it is not text"
    reason = (text.partition(" : ")[2] or text)[:300]  # what comes first is a place in USD's own source
    return AssetError(f"is no USD layer that can be read ({reason})", path, "write it again, or convert it with usdcat")


def _beside(name: str, layer: Path, file: Path) -> Path:
    """The path of a layer that another names, which lies in the folder of the file."""
    path = layer.parent / name
    try:
        found = path.resolve()
        inside = found.is_relative_to(file.parent.resolve()) and found.is_file()
    except (OSError, ValueError, RuntimeError):  # a name that no file can have
        inside = False
    # Names with arguments or inside packages mean other files than they seem to.
    if not inside or ":" in name or "[" in name or found.suffix.lower() not in SUFFIXES:
        raise AssetError(
            f"takes in {name[:100]!r}, which is missing, outside the file's folder, or no USD layer",
            layer,
            "put it there, or write all into one file: usdcat --flatten",
        )
    return found


def _check_expansion(layers: list[Any], file: Path) -> None:
    """Refuse layers whose references expand to too many prims, before they are composed."""
    known: dict[Any, int] = {}

    def count(path: Any) -> int:
        """Prims that the prim of a path is at most made of, in all layers together."""
        if path in known:
            return known[path]
        known[path] = 1  # a circle, which composition leaves out
        total = 1
        for layer in layers:
            spec = layer.GetPrimAtPath(path)
            if spec is None:
                continue
            if spec.HasInfo("clips"):
                raise AssetError("value clips are not read", f"{file}: {path}", "write the values into the file")
            total += sum(count(child.path) for child in spec.nameChildren)
            for variants in spec.variantSets.values():
                for variant in variants.variants.values():
                    total += count(variant.primSpec.path)
            arcs = [*spec.referenceList.GetAddedOrExplicitItems(), *spec.payloadList.GetAddedOrExplicitItems()]
            for arc in arcs:
                total += sum(count(target) for target in _targets(arc, layers))
            for arc in (spec.inheritPathList, spec.specializesList):
                total += sum(count(target) for target in arc.GetAddedOrExplicitItems())
            if total > _MAX_PRIMS:
                raise AssetError(
                    f"it expands to over {_MAX_PRIMS} prims", f"{file}: {path}", "leave out what is not the object"
                )
        known[path] = total
        return total

    try:
        total = sum(count(spec.path) for layer in layers for spec in layer.rootPrims)
    except RecursionError as error:
        raise AssetError("its prims are nested too deeply", file, "flatten its hierarchy") from error
    if total > _MAX_PRIMS:
        raise AssetError(f"it expands to over {_MAX_PRIMS} prims", file, "leave out what is not the object")


def _targets(arc: Any, layers: list[Any]) -> list[Any]:
    """Paths that a reference or payload may mean: its own, else the default prims of all layers."""
    from pxr import Sdf

    if arc.primPath != Sdf.Path.emptyPath:
        return [arc.primPath]
    names = {layer.defaultPrim for layer in layers if layer.defaultPrim}
    return [Sdf.Path.absoluteRootPath.AppendPath(name.lstrip("/")) for name in sorted(names)]
