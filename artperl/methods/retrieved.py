"""What methods share whose agent fits a retrieved reference: sizes, networks, settings."""

from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import torch
from torch import nn
from typing_extensions import Self

from artperl.perception.segmentation import Segmentation
from artperl.retrieval.segmented import SegmentedRetrieval, check_embeddings
from artperl.retrieval.shape_base import ShapeBase
from artperl.retrieval.siamese import Siamese
from artsim.common.json_records import from_json_values
from artsim.model.objects import MAX_PARTS

_MAX_WIDTH = 2048


@dataclass(frozen=True)
class Sizes:
    """Sizes of the networks.

    ``num_rows`` is K, the most parts; the others are the channels of the first layers.
    """

    num_rows: int
    segmentation: int = 48
    siamese: int = 64
    policy: int = 64

    def __post_init__(self) -> None:
        if not 1 <= self.num_rows <= MAX_PARTS:
            raise ValueError(f"num_rows is {self.num_rows}, not 1 to {MAX_PARTS}")
        if not all(1 <= width <= _MAX_WIDTH for width in (self.segmentation, self.siamese, self.policy)):
            raise ValueError(f"widths are not within 1 to {_MAX_WIDTH}")


class AgentMethod(SegmentedRetrieval):
    """A method with an agent.

    Parameters
    ----------
    segmentation : Segmentation
    siamese : Siamese
    policy : Module
        Of :attr:`policy_type`.
    base : ShapeBase
        References with their embeddings by ``siamese``.
    options : optional
        Of :attr:`options_type`.
    """

    policy_type: ClassVar[type[Any]]
    options_type: ClassVar[type[Any]]
    policy: Any
    options: Any

    def __init__(
        self, segmentation: Segmentation, siamese: Siamese, policy: Any, base: ShapeBase, options: Any = None
    ):  # fmt: skip
        super().__init__(segmentation, siamese, base)
        self.policy, self.options = policy.eval(), options or self.options_type()

    @classmethod
    def new_networks(cls, sizes: Sizes) -> dict[str, Any]:
        """New networks of these sizes, by name."""
        return {
            "segmentation": Segmentation(sizes.num_rows, sizes.segmentation),
            "siamese": Siamese(sizes.num_rows, sizes.siamese),
            "policy": cls.policy_type(sizes.policy),
        }

    def networks(self) -> dict[str, nn.Module]:
        """The three networks."""
        return {"segmentation": self.segmentation, "siamese": self.siamese, "policy": self.policy}

    def settings(self) -> dict[str, Any]:
        """Sizes and options, in JSON's terms."""
        sizes = Sizes(self.segmentation.num_rows, self.segmentation.width, self.siamese.width, self.policy.width)
        return {"sizes": asdict(sizes), "options": asdict(self.options)}

    @classmethod
    def of_settings(cls, settings: dict[str, Any], base: ShapeBase) -> Self:
        """The method with these settings, its networks untrained."""
        networks = cls.new_networks(from_json_values(Sizes, settings.get("sizes")))
        check_embeddings(base, networks["siamese"])
        return cls(**networks, base=base, options=from_json_values(cls.options_type, settings.get("options")))

    def to(self, device: torch.device | str) -> Self:
        """The method on another device."""
        networks: dict[str, Any] = {name: network.to(device) for name, network in self.networks().items()}
        return type(self)(**networks, base=self.base, options=self.options)
