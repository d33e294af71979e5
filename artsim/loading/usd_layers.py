"""Opens an untrusted USD file: every layer that it is made of lies in its folder, and all are of a size."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from artsim.common.files import read_bounded
from artsim.errors import AssetError
from artsim.loading.meshes import LoadLimits

SUFFIXES = (".usda", ".usdc", ".usd", ".usdz")
_MAX_LAYERS = 200


def open_stage(file: Path, limits: LoadLimits, holds: Callable[[int], None]) -> tuple[Any, list[bytes]]:
    """A USD stage, and the content of the files that it takes in besides the file itself.

    Parameters
    ----------
    file : Path
    limits : LoadLimits
    holds : callable
        Is told the bytes of all files so far, before usd-core reads them.

    Raises
    ------
    AssetError
        When a layer cannot be read, lies outside the file's folder, or is over a limit.
    """
    from pxr import Sdf, Tf, Usd

    layers = _Layers(file, limits, holds)
    waiting, opened = [str(file.resolve())], dict[str, Any]()
    while waiting:
        name = waiting.pop()
        if name in opened:
            continue
        if len(opened) >= _MAX_LAYERS:
            raise AssetError(f"it is made of over {_MAX_LAYERS} layers", file, "flatten it: usdcat --flatten")
        layers.look_at(name)
        try:
            layer = Sdf.Layer.Find(name)
            if layer is None:
                layer = Sdf.Layer.FindOrOpen(name)
            else:  # as this process opened it before: the file may be another one by now
                layer.Reload(force=True)
        except Tf.ErrorException as error:
            raise unreadable(Path(name), error) from error
        if layer is None:
            raise unreadable(Path(name), "there is no layer, or it has unknown content")
        opened[name] = layer
        waiting += [layers.beside(layer, other) for other in layer.GetCompositionAssetDependencies() if other]
    try:
        stage = Usd.Stage.Open(opened[str(file.resolve())])
    except Tf.ErrorException as error:
        raise unreadable(file, error) from error
    return stage, layers.contents


class _Layers:
    """The files of layers, by the names that usd-core gives them: those in packages have their package's before."""

    def __init__(self, file: Path, limits: LoadLimits, holds: Callable[[int], None]):
        self._file, self._limits, self._holds = file.resolve(), limits, holds
        self._folder, self._files, self._bytes = self._file.parent, set[Path](), 0
        self.contents: list[bytes] = []

    def look_at(self, name: str) -> None:
        """Refuse a layer whose file is too large, or one file too many."""
        path = self._path(name)
        if path in self._files:
            return
        self._files.add(path)
        room = min(self._limits.max_total_mesh_bytes - self._bytes, self._limits.max_mesh_bytes)
        data = read_bounded(path, room, "USD file", inside=self._folder)
        if path != self._file:
            self.contents.append(data)
        self._bytes += len(data)
        self._holds(self._bytes)

    def beside(self, layer: Any, name: str) -> str:
        """Name of the layer that another one names, which lies in the folder of the file, or in the same package."""
        try:
            full = layer.ComputeAbsolutePath(name)
            path = self._path(full)
            inside = path.is_relative_to(self._folder) and path.is_file()
        except (OSError, ValueError, RuntimeError):  # a name that no file can have
            inside = False
        # Names with arguments or inside packages mean other files than they seem to.
        if not inside or ":" in name or "[" in name or Path(full.rstrip("]")).suffix.lower() not in SUFFIXES:
            raise AssetError(
                f"takes in {name[:100]!r}, which is missing, outside the file's folder, or no USD layer",
                layer.realPath or self._file,
                "put it there, or write all into one file: usdcat --flatten",
            )
        return full if full != str(path) and "[" in full else str(path)

    @staticmethod
    def _path(name: str) -> Path:
        from pxr import Ar

        return Path(Ar.SplitPackageRelativePathOuter(name)[0]).resolve()


def unreadable(path: Path, why: object) -> AssetError:
    try:
        text = " ".join(str(why).split())
    except UnicodeDecodeError:  # USD quotes the file, whatever its bytes are
        text = "it is not text"
    reason = (text.partition(" : ")[2] or text)[:300]  # what comes first is a place in USD's own source
    return AssetError(f"is no USD layer that can be read ({reason})", path, "write it again, or convert it with usdcat")
