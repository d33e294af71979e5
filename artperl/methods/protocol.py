"""What a method is: it makes an estimate of a cloud."""

from dataclasses import dataclass
from typing import Any, ClassVar, Protocol

import torch
from numpy.typing import ArrayLike
from torch import nn
from typing_extensions import Self

from artperl.core.estimate import Estimate
from artperl.retrieval.shape_base import ShapeBase
from artsim.model.objects import MAX_PARTS

_MAX_WIDTH = 2048


@dataclass(frozen=True)
class NetworkSizes:
    """Sizes of the networks of a method that learns one kinematic tree: the most parts, and the finest channels."""

    num_rows: int
    width: int = 48

    def __post_init__(self) -> None:
        if not 1 <= self.num_rows <= MAX_PARTS or not 1 <= self.width <= _MAX_WIDTH:
            raise ValueError(f"num_rows is {self.num_rows}, width {self.width}")


class Method(Protocol):
    """A method of estimating 9D poses, trained. What scores, draws or applies a method knows it by this alone."""

    name: ClassVar[str]
    """As the registry :data:`artperl.methods.METHODS` has it."""

    @property
    def categories(self) -> tuple[str, ...]:
        """Categories of the objects that it knows, each once."""
        ...

    def __call__(self, points: ArrayLike) -> Estimate:
        """Estimate the pose of every part of the object that a cloud (N, 3) shows, camera frame, metres."""
        ...


class Untrained(Method, Protocol):
    """A method that needs no training."""

    @classmethod
    def of_category(cls, category: str) -> Self:
        """The method for objects of a category."""
        ...


class Storable(Protocol):
    """What can be written down: networks are what is learnt, settings what is chosen."""

    name: ClassVar[str]
    base: ShapeBase
    """References, with the embeddings that they are found by."""

    def networks(self) -> dict[str, nn.Module]:
        """Its networks by name."""
        ...

    def settings(self) -> dict[str, Any]:
        """Sizes of its networks and options, in JSON's terms."""
        ...


class Stored(Method, Storable, Protocol):
    """A method that is trained, written down and read again."""

    @classmethod
    def of_settings(cls, settings: dict[str, Any], base: ShapeBase) -> Self:
        """The method with these settings, its networks untrained.

        Raises
        ------
        ValueError
            When the settings are none of this method, or do not fit the base.
        """
        ...

    def to(self, device: torch.device | str) -> Self:
        """The method on another device, ready to estimate."""
        ...
