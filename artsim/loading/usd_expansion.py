"""How much the layers of a USD file expand to when they are composed, found out beforehand.

USD composes a prim from *sites*: places in layers that references, payloads, inherits, specializes and variants bring
together. A prim below one that refers to another is made of what lies below the other, too, so that a few lines may
stand for billions of prims. Here the sites of every prim are counted, with as many copies as there are ways to reach
them: prims that are made of the same sites in the same number are counted once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

from artsim.errors import AssetError

MAX_SITES = 50_000
"""Sites of all prims together: ten for each shape that an object may have. Each takes some 30 microseconds and 3
kilobytes to find, to compose and to read."""
_MAX_STEPS = 200_000
"""Sites looked at: more than as many prims take."""
_LAYERS = 16
"""Layers of a stack that are looked through for a site in the time that a site takes."""
_SLOW = 8
"""Sites that are found in the time of replacing a prefix."""
_ARCS = frozenset(("references", "payload", "inheritPaths", "specializes", "variantSetNames", "clips", "relocates"))

Site = tuple[str, Any]
"""Name of a stack of layers, and a path in it, variants included."""
_Sites = dict[Site, int]
"""Sites, and how often each is one of a prim's."""


class _Found(NamedTuple):
    """What stands at a site: specs, the names below it, and what it counts as."""

    specs: tuple[Any, ...]
    names: tuple[str, ...]
    cost: int


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
        self._found: dict[Site, _Found] = {}
        self._own: dict[Site, _Sites | None] = {}
        self._all: dict[Site, _Sites] = {}
        self._totals: dict[frozenset[tuple[Site, int]], int | None] = {}
        self._arcs: dict[Site, list[tuple[Site, bool]]] = {}
        self._referrers: dict[Site, list[Site]] = {}
        self._stacks: list[str] = []
        self._steps = self._left_out = 0

    def check(self, root: str) -> int:
        """How many sites all prims have that a root layer expands to; no fewer than there are prims.

        Raises
        ------
        AssetError
            When it expands to too many sites, refers to itself in a circle, or takes values from clips.
        """
        self._stacks = [root]
        try:
            for stack in self._stacks:  # grows
                for layer in self._stack(stack):
                    if layer.pseudoRoot.HasInfo("layerRelocates"):
                        raise self._unread("relocates", "/")
                    for spec in layer.rootPrims:
                        self._note_arcs(stack, spec)
            return self._total_below({(root, self._sdf.Path.absoluteRootPath): 1})
        except RecursionError as error:
            raise AssetError("its prims are nested too deeply", self._file, "flatten its hierarchy") from error

    def _total_below(self, sites: _Sites) -> int:
        """What all prims below one that is made of some sites count as."""
        key = frozenset(sites.items())
        if key in self._totals:
            total = self._totals[key]
            if total is None:
                raise self._circle(next(iter(sites))[1])
            return total
        self._totals[key] = None
        total = 0
        names = dict.fromkeys(name for site in sites for name in self._look(site).names)
        self._checked(len(names))
        for name in names:
            below = self._below(sites, name)
            total += sum(count * self._look(site).cost for site, count in below.items())
            heirs = {site: count for site, count in below.items() if self._look(site).names}
            total = self._checked(total + (self._total_below(heirs) if heirs else 0))
        self._totals[key] = total
        return total

    def _below(self, sites: _Sites, name: str) -> _Sites:
        """Sites of the child of a name of a prim that is made of some."""
        found: _Sites = {}
        for (stack, path), count in sites.items():
            for site, copies in self._of_spec((stack, path.AppendChild(name))).items():
                found[site] = found.get(site, 0) + count * copies
        self._count(len(sites))
        self._checked(sum(found.values()))
        return found

    def _sites(self, site: Site) -> _Sites:
        """All sites of the prim at a path of a stack of layers, as they follow from those of its parent."""
        if site in self._all:
            return self._all[site]
        stack, path = site
        if path == self._sdf.Path.absoluteRootPath:
            return {site: 1}
        before = self._left_out
        found = self._below(self._sites((stack, path.GetParentPath())), path.name)
        if self._left_out == before:
            self._all[site] = found
        return found

    def _of_spec(self, site: Site) -> _Sites:
        """A site and those that its own arcs bring; none where nothing stands there."""
        at = self._look(site)
        if not at.specs:
            return {}
        if site not in self._arcs:
            return {site: 1}
        if site in self._own:
            known = self._own[site]
            if known is None:  # a circle, which USD leaves out there, and only there
                self._left_out += 1
            return known or {}
        before = self._left_out
        self._own[site] = None
        total: _Sites = {site: 1}
        for target, is_class in self._arcs[site]:
            brought = [self._of_spec(target) if target[1].ContainsPrimVariantSelection() else self._sites(target)]
            if is_class:
                brought += [self._of_spec(other) for other in self._implied(site, target)]
            for new in brought:
                for other, copies in new.items():
                    total[other] = total.get(other, 0) + copies
                self._count(len(new))
            self._checked(sum(total.values()))
        if self._left_out == before:
            self._own[site] = total
        else:
            del self._own[site]
        return total

    def _look(self, site: Site) -> _Found:
        found = self._found.get(site)
        if found is None:
            stack, path = site
            layers = self._stack(stack)
            self._count(1 + len(layers) // _LAYERS)
            if path == self._sdf.Path.absoluteRootPath:
                specs = tuple(layer.pseudoRoot for layer in layers)
            else:
                specs = tuple(spec for spec in (layer.GetPrimAtPath(path) for layer in layers) if spec is not None)
            below = [spec.nameChildren for spec in specs if spec.nameChildren]
            names = tuple(dict.fromkeys(name for children in below for name in children.keys()))  # noqa: SIM118
            found = self._found[site] = _Found(specs, names, len(specs) + len(layers) // _LAYERS)
        return found

    def _note_arcs(self, stack: str, spec: Any) -> None:
        """Note where the arcs of a prim and of those below it lead."""
        self._count(1)
        site = stack, spec.path
        keys = _ARCS.intersection(spec.ListInfoKeys())
        if keys:
            targets = list(self._targets(site, spec, keys))
            self._arcs.setdefault(site, []).extend(targets)
            for target, _ in targets:
                self._referrers.setdefault(target, []).append(site)
        if spec.nameChildren:
            for child in spec.nameChildren:
                self._note_arcs(stack, child)

    def _targets(self, site: Site, spec: Any, keys: frozenset[str]) -> Iterator[tuple[Site, bool]]:
        """Sites that the arcs of one spec lead to, and whether they are classes."""
        stack, path = site
        for key, what in (("clips", "value clips"), ("relocates", "relocates")):
            if key in keys:
                raise self._unread(what, path)
        if "variantSetNames" in keys or spec.variantSets:
            for name, variants in spec.variantSets.items():
                for variant in variants.variants.values():
                    yield (stack, path.AppendVariantSelection(name, variant.name)), False
                    self._note_arcs(stack, variant.primSpec)
        for arc in (*spec.referenceList.GetAddedOrExplicitItems(), *spec.payloadList.GetAddedOrExplicitItems()):
            other = self._beside(spec.layer, arc.assetPath) if arc.assetPath else stack
            if other not in self._stacks:
                self._stacks.append(other)
            target = arc.primPath
            if target == self._sdf.Path.emptyPath:
                default = self._stack(other)[0].defaultPrim
                target = self._sdf.Path(f"/{default.lstrip('/')}") if default else target
            if target.IsPrimPath():
                yield (other, target), False
        for arcs in (spec.inheritPathList, spec.specializesList):
            yield from (((stack, target), True) for target in arcs.GetAddedOrExplicitItems() if target.IsPrimPath())

    def _implied(self, heir: Site, target: Site) -> list[Site]:
        """Where those who refer to a prim above an heir may write something of its class themselves."""
        found: dict[tuple[Site, Site], None] = {(heir, target): None}
        waiting = list(found)
        while waiting:
            (stack, path), (_, class_path) = waiting.pop()
            for prefix in path.GetPrefixes():
                for other, source in self._referrers.get((stack, prefix), ()):
                    self._count(_SLOW)
                    new = (other, path.ReplacePrefix(prefix, source)), (other, class_path.ReplacePrefix(prefix, source))
                    if new not in found:
                        found[new] = None
                        waiting.append(new)
        return [site for site in dict.fromkeys(site for _, site in found) if site != target]

    def _unread(self, what: str, path: Any) -> AssetError:
        return AssetError(
            f"{what} are not read", f"{self._file}: prim {path}", "write it into one layer: usdcat --flatten"
        )

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
