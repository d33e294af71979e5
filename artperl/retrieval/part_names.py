"""Names of the parts of an estimated object, from the objects that it is made of."""

import re
from collections import Counter
from functools import lru_cache

import torch
from torch import Tensor

from artperl.core.shapes import Shapes
from artperl.core.trees import KINDS
from artperl.retrieval.shape_base import ShapeBase
from artsim.errors import ArtsimError
from artsim.families import FAMILIES, make
from artsim.model.joints import Joint

_FITTED = 0.25
"""Difference of boxes, in diagonals, up to which a part is that of the reference as a fit has stretched it."""
_ROOT = "base"
"""Name of a root whose category is unknown."""


def part_names(base: ShapeBase, reference: int, shapes: Shapes) -> tuple[str, ...]:
    """Names of the parts of a reference, such as "base" and "lid".

    A part of the base is named as its joint is ("lid_joint"). Where the reference is composed of parts of many objects,
    a part is called what the part of the base is called that moves alike and has the most similar box.

    Parameters
    ----------
    base : ShapeBase
    reference : int
        Row of the base that the root is of.
    shapes : Shapes
        One row, the reference as it was fitted.
    """
    count = int(shapes.trees.valid[0].sum())
    types = [KINDS[kind] for kind in shapes.trees.kind[0, :count].tolist()]
    apart = torch.cdist(_boxes(shapes)[0, :count], _boxes(base.shapes).cpu().flatten(0, 1)).view(count, len(base), -1)
    tree = base.trees[reference]
    whole = list(tree.types) == types and bool((apart[:, reference, :count].diagonal() < _FITTED).all())
    names = [root_name(base.categories[reference])]
    for k in range(1, count):
        joint = tree.joints[k] if whole else _most_similar(base, reference, apart[k], types[k])
        name = "part" if joint is None else joint.name.removesuffix("_joint")
        # Numbers are of the objects that parts come from: they say nothing in a composed one.
        names.append(name if whole else re.sub(r"_\d+$", "", name))
    return tuple(_number_alike(names))


def _most_similar(base: ShapeBase, reference: int, apart: Tensor, kind: str) -> Joint | None:
    """The joint of a kind whose part's box is the least apart (B, P) from another one; None without any.

    It is of the reference's category where that has such a joint.
    """
    kinds = base.shapes.trees.kind.cpu()
    alike = base.shapes.trees.valid.cpu() & (kinds == KINDS.index(kind))
    alike[:, 0] = False
    if not bool(alike.any()):
        return None
    own = alike & base.of_category(base.categories[reference]).cpu()[:, None]
    alike = own if bool(own.any()) else alike
    row, part = divmod(int(apart.masked_fill(~alike, torch.inf).argmin()), kinds.shape[1])
    return base.trees[row].joints[part]


@lru_cache(maxsize=64)
def root_name(category: str) -> str:
    """Name of the root of a procedural category's objects; "base" for other categories."""
    if category not in FAMILIES:
        return _ROOT
    try:
        return make(category).parts[0].name
    except ArtsimError:
        return _ROOT


def _number_alike(names: list[str]) -> list[str]:
    """Names of which no two are alike: those that are get new numbers."""
    count = Counter(names)
    twice = {re.sub(r"_\d+$", "", name) for name, times in count.items() if times > 1}
    seen: Counter[str] = Counter()
    result = []
    for name in names:
        stem = re.sub(r"_\d+$", "", name)
        if stem in twice:
            result.append(f"{stem}_{seen[stem]}")
            seen[stem] += 1
        else:
            result.append(name)
    return result


def _boxes(shapes: Shapes) -> Tensor:
    """(B, P, 6) in diagonals."""
    unit = shapes.diagonal[:, None, None]
    return torch.cat([shapes.box_center / unit, shapes.box_size / unit], dim=-1)
