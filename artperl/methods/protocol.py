"""What a method is: it makes an estimate of a cloud, and can be written down."""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

from numpy.typing import ArrayLike
from torch import nn
from typing_extensions import Self

from artperl.core.estimate import Estimate
from artperl.retrieval.shape_base import ShapeBase


class Method(Protocol):
    """A method of estimating 9D poses, trained.

    Attributes
    ----------
    name : str
        As the registry :data:`artperl.methods.METHODS` has it.
    base : ShapeBase
        References, with the embeddings that they are found by.
    """

    name: ClassVar[str]
    base: ShapeBase

    @property
    def categories(self) -> tuple[str, ...]:
        """Categories of the objects that it knows, each once."""
        ...

    def __call__(self, points: ArrayLike) -> Estimate:
        """Estimate the pose of every part of the object that a cloud (N, 3) shows, camera frame, metres."""
        ...

    def networks(self) -> dict[str, nn.Module]:
        """Its networks by name: what is learnt."""
        ...

    def settings(self) -> dict[str, Any]:
        """Sizes of its networks and options, in JSON's terms: what is chosen."""
        ...

    @classmethod
    def of_settings(cls, settings: dict[str, Any], base: ShapeBase) -> Self:
        """The method with these settings, its networks untrained.

        Raises
        ------
        ValueError
            When the settings are none of this method.
        """
        ...
