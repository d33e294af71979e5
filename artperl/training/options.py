"""What a training run depends on, and presets.

Everything that a run may be told stands here once, with its default and its check. The command, the recipes and the
presets name fields of :class:`TrainOptions` and give them values by :func:`changed`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, is_dataclass, replace
from typing import Any, TypeVar

from artperl.agent.ppo import CLONING, JOINT, OWN_STATES, Phase, PPOOptions
from artperl.data.categories import Parts
from artperl.methods import StoredMethod
from artperl.training.steps import one_cycle
from artsim.common.json_records import from_json_values
from artsim.datasets.plan import SampleOptions
from artsim.errors import ConfigError
from artsim.model.draws import StateOptions, ViewOptions

T = TypeVar("T")
LENGTHS = (
    "perception_steps", "dense_steps", "prior_steps", "retrieval_steps", "agent_rollouts", "box_views", "box_steps",
)  # fmt: skip
"""Options that say how long the stages of a run are."""
_WITH_AGENT = ("artperl", "sporeagent")
"""Methods that retrieve a reference by a network and fit it by an agent."""
_MOST = 1_000_000_000
_SHARES = ("stretched", "noisy", "degraded", "cloning_share")
_AT_LEAST_ONE = (
    "base_objects", "reference_points", "width", "denser", "batch_size", "num_points", "retrieval_points",
    "episodes", "box_width", "validate_every", "test_objects", "validation_views", "test_views",
)  # fmt: skip
_AT_LEAST_ZERO = (*LENGTHS, "foreign_categories", "seed", "patience")
_AT_LEAST_TWO = ("retrieval_objects", "retrieval_batch")


@dataclass(frozen=True)
class TrainOptions:
    """What a run depends on.

    Raises
    ------
    ConfigError
        When a value is impossible, or two values contradict each other.
    """

    method: StoredMethod = "full"
    """full: the estimator that is shipped; artperl: the method of the paper as printed; others: its baselines."""
    categories: tuple[str, ...] = ("laptop",)
    """Procedural categories; several share one estimator, and one that is named twice is seen twice as often."""
    parts: Parts = "artimage"
    """artimage: objects with the parts that their category has in ArtImage or ReArtMix, such as body and three drawers;
    any: all objects of the families."""
    max_parts: int | None = None
    """The most parts that an object may have."""
    objects: tuple[str, ...] = ()
    """URDF files, object folders, or folders of them: objects to learn from. Where there are categories, too, every
    other object is one of these."""
    name: str | None = None
    """Of the category that these objects are of: some of them are held out. Without a name the objects themselves are
    learnt."""
    package_roots: tuple[tuple[str, str], ...] = ()
    """Name and folder of the packages that their files name, where they are not found as they are."""
    real: bool = False
    """Every other object is a real one, of the half of ArtImage's frozen split that is not for testing."""
    dataset: str | None = None
    """Folder of a dataset to learn from, its train split, instead of fresh objects."""
    start_from: str | None = None
    """Folder of an estimator whose networks are trained further; by default they start at random."""
    seed: int = 0
    base_objects: int = 64
    """Reference objects of each category."""
    reference_points: int = 192
    """Points of each part of a reference."""
    width: int = 48
    """Channels of perception's finest level."""
    perception_steps: int = 4000
    """Batches that perception, or the segmentation of the method artperl, learns from."""
    dense_steps: int = 1000
    """Batches in its end, of fewer, denser clouds: of as many points as the estimator looks at."""
    denser: int = 2
    """Times the points of a training cloud that the estimator looks at: weights carry over."""
    stretched: float = 0.0
    """Share of these clouds whose objects are stretched between the edges of their parts."""
    noisy: float = 0.0
    """Share of the others with the noise of one of four depth sensors."""
    degraded: float = 0.0
    """Share of all of them that are cut by an occluder or the image's border, have points of the table or a neighbour,
    or are of few points."""
    prior_steps: int = 0
    """Batches that the keypoints of the method omad learn from."""
    retrieval_steps: int = 0
    """Batches that the Siamese network of the method artperl learns from."""
    retrieval_objects: int = 400
    """Fresh objects, four views of each, that these batches are drawn from."""
    retrieval_batch: int = 48
    """Objects in such a batch: a view of each is compared with all of them."""
    retrieval_points: int = 256
    """Points of each view that are embedded, drawn anew each time."""
    retrieval_rate: float = 1e-2
    perception_rate: float = 2e-3
    mixed_precision: bool = True
    """Networks multiply in bfloat16 while they learn, where the processor can."""
    batch_size: int = 32
    num_points: int = 1024
    """Points of a cloud."""
    agent_rollouts: int = 0
    """Batches of episodes that the agent of the method artperl learns from."""
    cloning_share: float = 0.6
    """Of the rollouts, the first ones that the agent learns from by behaviour cloning alone."""
    agent_rate: float = 2e-3
    """Of cloning."""
    reinforcement_rate: float = 2e-4
    """Of the agent once it learns from rewards."""
    episodes: int = 128
    """Episodes of a rollout. An update learns from states of few of them: of many, these are of many objects."""
    box_views: int = 2500
    """Fresh views of the last stage, whose estimates tell where boxes end; 0 leaves boxes as references have them."""
    box_steps: int = 12000
    """Batches that boxes are learnt in."""
    box_residual: float = 0.02
    """Largest residual of estimates that boxes are learnt from: of others there is no saying what their boxes show."""
    box_width: int = 80
    """Channels of the network that they are learnt by."""
    validate_every: int = 1000
    """Steps between validations: of perception, and of the last stage of other methods."""
    patience: int = 0
    """Validations in a row without a gain after which a stage ends; 0 never ends one early."""
    test_objects: int = 40
    """Unseen objects of each category, others for validation than for the test at the end; given ones share so many."""
    foreign_categories: int = 12
    """Other categories, of which two objects each show what confidence must be low for."""
    validation_views: int = 4
    """Views of each object when the estimator is validated."""
    test_views: int = 4
    """Views of each object when the best estimator is tested."""
    sample: SampleOptions = field(default_factory=SampleOptions)
    ppo: PPOOptions = field(default_factory=PPOOptions)

    def __post_init__(self) -> None:
        for names, least in ((_AT_LEAST_ONE, 1), (_AT_LEAST_TWO, 2), (_AT_LEAST_ZERO, 0)):
            for name in names:
                if not least <= getattr(self, name) <= _MOST:
                    raise ConfigError(f"{getattr(self, name)} is not possible", name, f"use {least} to {_MOST}")
        for name in _SHARES:
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ConfigError(f"{getattr(self, name)} is no share", name, "use 0 to 1")
        for name in ("perception_rate", "retrieval_rate", "agent_rate", "reinforcement_rate"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ConfigError(f"{getattr(self, name)} is no learning rate", name, "use 1e-4 to 1e-2")
        if self.noisy and (self.dataset is not None or self.sample.noise != "none"):
            raise ConfigError("clouds that have their noise get no other", "noisy", "use one of noise, dataset, noisy")
        if self.dataset is not None and (self.real or self.objects):
            raise ConfigError("a dataset is not mixed with other objects", "dataset", "generate one with them in it")
        if self.method not in _WITH_AGENT and (self.agent_rollouts or self.retrieval_steps):
            raise ConfigError(
                f"the method {self.method} has no agent, and no network for retrieval",
                "agent_rollouts, retrieval_steps", f"leave them out, or use the method {' or '.join(_WITH_AGENT)}",
            )  # fmt: skip
        if self.method != "omad" and self.prior_steps:
            raise ConfigError("only the method omad has a prior of keypoints", "prior_steps", "leave it out")
        if self.method == "omad" and (self.stretched or self.degraded):
            raise ConfigError(
                "the method omad learns from whole objects", "stretched, degraded", "leave them out, or use --noisy"
            )
        if not self.categories and not self.objects:
            raise ConfigError("there is nothing to learn from", "categories", "name categories or objects")

    def phase(self, rollout: int) -> Phase:
        """The phase of Algorithm 1 that a rollout is in: cloning on states of either kind in turn, then both losses."""
        if rollout >= self._cloning_rollouts:
            return JOINT
        return OWN_STATES if rollout % 2 else CLONING

    def rate_of_agent(self, rollout: int) -> float:
        """The agent's learning rate, a cycle for each phase."""
        cloning = self._cloning_rollouts
        if rollout < cloning:
            return self.agent_rate * one_cycle(rollout, cloning)
        return self.reinforcement_rate * one_cycle(rollout - cloning, self.agent_rollouts - cloning)

    @property
    def _cloning_rollouts(self) -> int:
        return round(self.cloning_share * self.agent_rollouts)

    @property
    def votes(self) -> bool:
        """Whether perception finds parts by votes: of a category's objects with any parts, nobody knows how many."""
        return self.parts == "any" and (not self.objects or self.name is not None)


def changed(options: T, changes: Mapping[str, Any]) -> T:
    """Options with other values for some fields, at every depth.

    Parameters
    ----------
    options : T
        A dataclass.
    changes : mapping
        Names of fields and plain values, as a JSON file has them; a mapping for a field that is a dataclass.

    Raises
    ------
    ConfigError
        When there is no such field, or a value is not of its type or impossible.
    """
    try:
        given = from_json_values(type(options), changes)
    except ValueError as error:
        raise ConfigError(str(error), "options", "see artperl.training.options.TrainOptions") from error
    values = {
        name: changed(getattr(options, name), value) if is_dataclass(getattr(options, name)) else getattr(given, name)
        for name, value in changes.items()
    }
    return replace(options, **values)  # type: ignore[type-var]


def scaled(options: TrainOptions, factor: float) -> TrainOptions:
    """The same run with all stages, and what is between validations, as many times as long."""
    names = [name for name in (*LENGTHS, "validate_every") if getattr(options, name)]
    lengths: dict[str, Any] = {name: max(1, round(factor * getattr(options, name))) for name in names}
    return replace(options, **lengths)


_GENERIC = ("laptop", "eyeglasses", "dishwasher", "scissors", "drawer", "storage_furniture", "robot_arm")
"""Categories of the recipe of generic."""

PRESETS = {
    "quick": TrainOptions(
        base_objects=32, width=32, perception_steps=500, dense_steps=0, batch_size=24, num_points=768,
        box_views=0, validate_every=250, test_objects=20, validation_views=2,
    ),
    "long": TrainOptions(),
    "joint": TrainOptions(
        parts="any", max_parts=10, base_objects=16, reference_points=64, width=40, perception_steps=9000,
        dense_steps=0, denser=1, box_views=0, box_width=40, validate_every=2000, test_objects=8, validation_views=2,
    ),
    "own": TrainOptions(
        categories=_GENERIC, parts="any", max_parts=10, base_objects=16, reference_points=64, width=40,
        start_from="generic", perception_rate=1e-3, perception_steps=600, dense_steps=0, stretched=0.3, noisy=0.25,
        degraded=0.6, box_views=0, box_width=40, validate_every=300, validation_views=2,
        sample=SampleOptions(states=StateOptions("mixed"), views=ViewOptions(preset="mixed")),
    ),
}  # fmt: skip
"""quick: one category in a few minutes on two cores, to see it learn; long: one category within the hour; joint:
one estimator for many categories, with any parts; own: a category of a few given objects, from the estimator generic,
whose sizes and clouds these are, and among whose objects they are shown: alone they make it forget."""

PAPER_PRESETS = {
    "quick": TrainOptions(
        method="artperl", base_objects=32, reference_points=128, width=32, perception_steps=400, batch_size=16,
        num_points=768, retrieval_steps=600, agent_rollouts=40, cloning_share=0.7, validate_every=10,
        test_objects=20, validation_views=2, test_views=2,
    ),
    "long": TrainOptions(method="artperl", retrieval_steps=2000, agent_rollouts=500, validate_every=125),
}  # fmt: skip
"""Presets of the method artperl."""

ANCSH_PRESETS = {
    "quick": TrainOptions(
        method="ancsh", base_objects=32, reference_points=32, width=32, perception_steps=1200, batch_size=16,
        num_points=768, validate_every=300, test_objects=20, validation_views=2, test_views=2,
    ),
    "long": TrainOptions(method="ancsh", reference_points=32),
}  # fmt: skip
"""Presets of the method ancsh."""

OMAD_PRESETS = {
    "quick": TrainOptions(
        method="omad", base_objects=32, reference_points=96, width=32, prior_steps=600, perception_steps=2000,
        batch_size=16, num_points=768, validate_every=500, test_objects=20, validation_views=2, test_views=2,
    ),
    "long": TrainOptions(method="omad", prior_steps=4000),
}  # fmt: skip
"""Presets of the method omad."""

_REGISTRATION = PPOOptions(lambda_rotation=0.5, lambda_translation=0.5, lambda_scale=0.0, epochs=2)
SPOREAGENT_PRESETS = {
    "quick": replace(PAPER_PRESETS["quick"], method="sporeagent", agent_rate=1e-3, ppo=_REGISTRATION),
    "long": replace(PAPER_PRESETS["long"], method="sporeagent", ppo=_REGISTRATION),
}
"""Presets of the method sporeagent: stages as long as those of artperl."""

METHOD_PRESETS: dict[StoredMethod, dict[str, TrainOptions]] = {
    "full": PRESETS,
    "artperl": PAPER_PRESETS,
    "ancsh": ANCSH_PRESETS,
    "omad": OMAD_PRESETS,
    "sporeagent": SPOREAGENT_PRESETS,
}
"""Presets of each method; of the paper and its baselines, quick ones take six to fourteen minutes of a busy core
each."""


FORMER_PRESETS = {"full": "long"}
"""Names that presets had in recipes; a method is called full, too."""


def preset_of(method: StoredMethod, name: str) -> TrainOptions:
    """A preset of a method.

    Raises
    ------
    ConfigError
        When the method has no such preset.
    """
    presets, name = METHOD_PRESETS.get(method, {}), FORMER_PRESETS.get(name, name)
    if name not in presets:
        raise ConfigError(f"the method {method} has no preset {name!r}", "preset", f"use {' or '.join(presets)}")
    return presets[name]
