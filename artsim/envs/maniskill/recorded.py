"""Options of the task in the JSON file of a recording, from which ManiSkill makes the environment again."""

from dataclasses import asdict
from pathlib import Path
from typing import Any

from artsim.envs.maniskill.options import TaskOptions
from artsim.errors import ConfigError
from artsim.model.draws import ViewOptions
from artsim.model.objects import ArticulatedObject


def recorded_options(options: dict[str, Any]) -> dict[str, Any]:
    """Options of ``gymnasium.make`` as JSON holds them; :func:`read_options` is the inverse for the task's own.

    Views become a dict and files absolute names. An object itself becomes its name: no file format holds all that moves
    it (masses and friction) and how it looks, so that :func:`read_options` refuses the name.
    """
    options = dict(options)
    if isinstance(options.get("obj"), ArticulatedObject):
        options["obj"] = f"{options['obj'].category} {options['obj'].object_id}"
    if isinstance(options.get("views"), ViewOptions):
        options["views"] = asdict(options["views"])
    if "objects" in options:
        options["objects"] = [str(Path(path).absolute()) for path in options["objects"]]
    return options


def read_options(options: dict[str, Any]) -> TaskOptions:
    """The task's own options, as Python or a recording gives them.

    Raises
    ------
    ConfigError
        When an option makes no sense.
    """
    options = {name: _tuples(value) for name, value in options.items()}
    if isinstance(options.get("obj"), str):
        raise ConfigError(
            f"a recording does not hold the object {options['obj']!r}",
            "obj",
            "record with categories=('laptop',) or objects=('folder',), which artsim.export.export writes",
        )
    if isinstance(options.get("views"), dict):
        options["views"] = ViewOptions(**{name: _tuples(value) for name, value in options["views"].items()})
    if "objects" in options:
        options["objects"] = tuple(Path(path) for path in options["objects"])
    return TaskOptions(**options)


def _tuples(value: Any) -> Any:
    """JSON knows lists only."""
    return tuple(value) if isinstance(value, list) else value
