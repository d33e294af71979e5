"""How much the layers of a USD file expand to when they are composed, found out beforehand.

USD composes a prim from *sites*: places in layers that references, payloads, inherits, specializes and variants bring
together. A prim below one that refers to another is made of what lies below the other, too, so that a few lines may
stand for billions of prims. Here the sites of every prim are counted, with as many copies as there are ways to reach
them: prims that are made of the same sites in the same number are counted once.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from artsim.errors import AssetError

MAX_SITES = 200_000
"""Sites of all prims together. Each takes some 10 microseconds and a kilobyte to compose."""
_MAX_STEPS = 500_000
"""Sites looked at, which is some seconds: more than as many prims of an object take."""

Site = tuple[str, Any]
"""Name of a stack of layers, and a path in it, variants included."""
_Sites = Counter[Site]


class Expansion:
    """Counts what a root layer expands to.

    Parameters
    ----------
    file : str or Path
        For messages.
    stack : callable
        The layers that the layer of a name and its sublayers are, strongest first.
    beside : callable
        Name of the layer that a layer takes in by a name of its own.
    """

    def __init__(self, file: Any, stack: Callable[[str], Sequence[Any]], beside: Callable[[Any, str], str]):
        from pxr import Sdf

        self._sdf, self._file, self._stack, self._beside = Sdf, file, stack, beside
        self._own: dict[Site, _Sites] = {}
        self._all: dict[Site, _Sites] = {}
        self._totals: dict[frozenset[tuple[Site, int]], int] = {}
        self._classes: dict[str, list[Site]] | None = None
        self._stacks: list[str] = []
        self._steps = 0

    def check(self, root: str) -> None:
        """Refuse what is too much.

        Raises
        ------
        AssetError
            When it expands to too many sites, refers to itself in a circle, or takes values from clips.
        """
        self._stacks = [root]
        try:
            self._total(Counter({(root, self._sdf.Path.absoluteRootPath): 1}))
        except RecursionError as error:
            raise AssetError("its prims are nested too deeply", self._file, "flatten its hierarchy") from error

    def _total(self, sites: _Sites) -> int:
        """Sites of a prim that is made of some, and of all prims below it."""
        key = frozenset(sites.items())
        if key in self._totals:
            if self._totals[key] < 0:
                raise self._circle(next(iter(sites))[1])
            return self._totals[key]
        self._totals[key] = -1
        total = 0
        names: dict[str, None] = {}
        for site, count in sites.items():
            specs = self._specs(site)
            total = self._checked(total + count * len(specs))
            names.update((child.name, None) for spec in specs for child in spec.nameChildren)
        for name in names:
            total = self._checked(total + self._total(self._below(sites, name)))
        self._totals[key] = total
        return total

    def _below(self, sites: _Sites, name: str) -> _Sites:
        """Sites of the child of a name of a prim that is made of some."""
        found: _Sites = Counter()
        for (stack, path), count in sites.items():
            for site, copies in self._of_spec((stack, path.AppendChild(name))).items():
                found[site] += count * copies
            self._count(1)
        self._checked(sum(found.values()))
        return found

    def _sites(self, site: Site) -> _Sites:
        """All sites of the prim at a path of a stack of layers, as they follow from those of its parent."""
        if site in self._all:
            return self._all[site]
        stack, path = site
        if path == self._sdf.Path.absoluteRootPath:
            return Counter({site: 1})
        found = self._below(self._sites((stack, path.GetParentPath())), path.name)
        self._all[site] = found
        return found

    def _of_spec(self, site: Site) -> _Sites:
        """A site and those that its own arcs bring; none where nothing stands there."""
        found = self._own.get(site)
        if found is not None:
            if site not in found and found:
                raise self._circle(site[1])
            return found
        specs = self._specs(site)
        if not specs:
            return self._own.setdefault(site, Counter())
        self._own[site] = Counter({("", ""): 1})  # in the making
        total: _Sites = Counter({site: 1})
        for spec in specs:
            for target in self._targets(site, spec):
                new = self._of_spec(target) if target[1].ContainsPrimVariantSelection() else self._sites(target)
                total.update(new)
                self._count(len(new))
                self._checked(sum(total.values()))
        self._own[site] = total
        return total

    def _targets(self, site: Site, spec: Any) -> Iterator[Site]:
        """Sites that the arcs of one spec lead to."""
        stack, path = site
        if spec.HasInfo("clips"):
            raise AssetError("value clips are not read", f"{self._file}: prim {path}", "write the values into the file")
        if spec.HasInfo("relocates") or spec.layer.pseudoRoot.HasInfo("layerRelocates"):
            raise AssetError("relocates are not read", f"{self._file}: prim {path}", "flatten it: usdcat --flatten")
        for name, variants in spec.variantSets.items():
            for variant in variants.variants.keys():  # noqa: SIM118  # no dictionary
                yield stack, path.AppendVariantSelection(name, variant)
        for arc in (*spec.referenceList.GetAddedOrExplicitItems(), *spec.payloadList.GetAddedOrExplicitItems()):
            other = self._beside(spec.layer, arc.assetPath) if arc.assetPath else stack
            if other not in self._stacks:
                self._stacks.append(other)
                self._classes = None
            target = arc.primPath
            if target == self._sdf.Path.emptyPath:
                default = next((layer.defaultPrim for layer in self._stack(other)[:1]), "")
                target = self._sdf.Path(f"/{default.lstrip('/')}") if default else self._sdf.Path.emptyPath
            if target.IsPrimPath():
                yield other, target
        for arcs in (spec.inheritPathList, spec.specializesList):
            for target in arcs.GetAddedOrExplicitItems():
                if target.IsPrimPath():
                    yield stack, target
                    yield from self._implied(stack, target)

    def _implied(self, stack: str, target: Any) -> Iterator[Site]:
        """Where the class of a path may stand for those who refer to its prim: sites of its name that bring arcs."""
        if self._classes is None:
            self._classes = {}
            for name in self._stacks:
                for layer in self._stack(name):
                    for spec in layer.rootPrims:
                        self._note(name, spec)
        for site in self._classes.get(target.name, []):
            if site != (stack, target) and self._own.get(site) != Counter({("", ""): 1}):
                yield site

    def _note(self, stack: str, spec: Any) -> bool:
        """Note the specs of a name that have arcs, or something below them that has."""
        self._count(1)
        below = [self._note(stack, child) for child in spec.nameChildren]
        arcs = (spec.referenceList, spec.payloadList, spec.inheritPathList, spec.specializesList)
        found = any(below) or bool(spec.variantSets) or any(arc.GetAddedOrExplicitItems() for arc in arcs)
        if found and self._classes is not None:
            self._classes.setdefault(spec.name, []).append((stack, spec.path))
        return found

    def _specs(self, site: Site) -> list[Any]:
        stack, path = site
        if path == self._sdf.Path.absoluteRootPath:
            return [layer.pseudoRoot for layer in self._stack(stack)]
        found = (layer.GetPrimAtPath(path) for layer in self._stack(stack))
        return [spec for spec in found if spec is not None]

    def _count(self, steps: int) -> None:
        self._steps += steps
        if self._steps > _MAX_STEPS:
            raise self._too_many()

    def _checked(self, total: int) -> int:
        if total > MAX_SITES:
            raise self._too_many()
        return total

    def _too_many(self) -> AssetError:
        return AssetError(
            f"its references, inherits and variants expand to over {MAX_SITES} prims",
            self._file,
            "leave out what is not the object",
        )

    def _circle(self, path: Any) -> AssetError:
        return AssetError("refers to itself in a circle", f"{self._file}: prim {path}", "remove one of its references")
