"""Variations of a given object: stretched, with other limits and axes, parts exchanged or left out.

Each passes the gates that the object itself passes. :mod:`artsim.variation.folder` writes many of them as files.
"""

from collections.abc import Sequence

from artsim.model.objects import ArticulatedObject

__all__ = ["vary"]


def vary(
    obj: ArticulatedObject,
    seed: int = 0,
    others: Sequence[ArticulatedObject] = (),
    strength: float | None = None,
) -> ArticulatedObject:
    """A variation of an object: the same for the same object, seed and others.

    Parameters
    ----------
    obj : ArticulatedObject
        Loaded or made; some joint of it can move.
    seed : int
        Not negative.
    others : sequence of ArticulatedObject
        Of the same category: their parts may take the place of parts of the object.
    strength : float, optional
        Of a procedural object: make it of other parameters, so far from its own as a share of their ranges.

    Returns
    -------
    ArticulatedObject
        Passes every gate of :func:`artsim.checks.check` that ``obj`` passes, and no two parts of it collide that do not
        in ``obj``. Parts keep their names.

    Raises
    ------
    AssetError
        When no joint of the object can move, or no draw passes the gates.
    ConfigError
        When the seed is negative, one of the others is of another category, or the extra ``sim`` is missing.
    """
    # Gates need the extra "sim", which "import artsim" does without.
    from artsim.variation.search import draw_variation

    return draw_variation(obj, seed, others, strength=strength).obj
