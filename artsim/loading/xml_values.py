"""Values of URDF elements, as attributes or in the ways that other formats write them, checked and with repairs."""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from lxml import etree

from artsim.common.elementary import cos, sin
from artsim.common.products import norm, unit
from artsim.errors import AssetError
from artsim.model.kinematics import Array
from artsim.model.objects import Repair
from artsim.model.transforms import compose_transform, rotation_of_quaternion

# What C's strtod reads in decimal; Python's float would also take 1_0 and other scripts' digits.
_NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)(e[+-]?\d+)?|inf(inity)?|nan)", re.IGNORECASE | re.ASCII)


@dataclass(frozen=True)
class Element:
    """The link or joint that is being read: its name in messages, its file, and where its repairs go."""

    name: str
    file: Path
    repairs: list[Repair]
    said: set[str] = field(default_factory=set)

    def error(self, what: str, fix: str) -> AssetError:
        """An error about this element."""
        return AssetError(what, f"{self.file}: {self.name}", fix)

    def say(self, what: str, note: bool = False) -> None:
        """Record a repair, or a mere note, once."""
        if what not in self.said:
            self.said.add(what)
            self.repairs.append(Repair(self.name, what, note))

    def child(self, parent: etree._Element, tag: str) -> etree._Element | None:
        """The first child of a name; more than one is said."""
        found = parent.findall(tag)
        if len(found) > 1:
            self.say(f"has {len(found)} <{tag}>: the first counts")
        return found[0] if found else None

    def text(self, element: etree._Element, attribute: str, own: bool = False) -> str | None:
        """An attribute; where it is not there, a child of its name, or with ``own`` the element's own text."""
        value = element.get(attribute)
        if value is not None:
            return str(value)
        inner = element.find(attribute)
        text = (inner.text if inner is not None else element.text if own else None) or ""
        if not text.strip():
            return None
        self.say(f"<{element.tag}> has its {attribute} as text: read as an attribute")
        return text.strip()

    def numbers(
        self, element: etree._Element, attribute: str, count: int, default: str | None = None, own: bool = False
    ) -> Array:
        """The (count,) numbers of a value, which may be infinite; separated by blanks or commas.

        Raises
        ------
        AssetError
            When it is missing without a default, no numbers, another number of them, or not a number.
        """
        text = self.text(element, attribute, own)
        if text is None:
            text = default
        if text is None:
            raise self.error(f"<{element.tag}> has no {attribute!r}", f'write {attribute}="{" ".join("0" * count)}"')
        return self.parsed(text, f"{attribute}={text[:60]!r} of <{element.tag}>", (count,))

    def parsed(self, text: str, what: str, counts: tuple[int, ...]) -> Array:
        """The numbers of a text, as many as one of some counts, in rising order; see :meth:`numbers`."""
        words = text.replace(",", " ").split()
        if not all(_NUMBER.fullmatch(word) for word in words):
            raise self.error(f"{what} is not numbers", "write numbers, separated by blanks")
        if len(words) not in counts:
            wanted = " or ".join(map(str, counts[:2])) + (" or more" if len(counts) > 2 else "")
            raise self.error(f"{what} is not {wanted} number{'' if wanted == '1' else 's'}", "write as many")
        if "," in text:
            self.say(f"{what}: commas read as separators")
        values = np.array([float(word) for word in words])
        if np.isnan(values).any():
            raise self.error(f"{what} is not finite", "write numbers")
        return values

    def finite(
        self, element: etree._Element, attribute: str, count: int, default: str | None = None, own: bool = False
    ) -> Array:
        """As :meth:`numbers`, and all of them finite."""
        values = self.numbers(element, attribute, count, default, own)
        if not np.isfinite(values).all():
            raise self.error(f"{attribute} of <{element.tag}> is not finite", "write finite numbers")
        return values

    def origin(self, parent: etree._Element) -> Array:
        """(4, 4) transform of an element's ``<origin>``; identity without one."""
        origin = self.child(parent, "origin")
        if origin is None:
            origin = self.child(parent, "pose")
            if origin is None:
                return np.eye(4)
            if origin.attrib:
                raise self.error(f"<pose> with {', '.join(origin.keys())} is SDF, not URDF", "write an <origin>")
            self.say("<pose> read as <origin>")
        strange = sorted(set(origin.keys()) - {"xyz", "rpy", "quat_xyzw"})
        if strange:
            self.say(f"<origin> has {', '.join(strange)}, which is not read")
        xyz, rpy, quaternion = (self.text(origin, name) for name in ("xyz", "rpy", "quat_xyzw"))
        own = (origin.text or "").strip()
        if own and (xyz, rpy, quaternion) == (None, None, None):
            values = self.parsed(own, f"<{origin.tag}> {own[:60]!r}", (3, 6))
            self.say(f"<{origin.tag}> has its numbers as text: read as xyz{' and rpy' if len(values) == 6 else ''}")
            xyz, rpy = " ".join(map(repr, values[:3].tolist())), " ".join(map(repr, values[3:].tolist())) or None
        turn = np.eye(3) if rpy is None else rotation_of(self._three(rpy, "rpy"))
        if quaternion is not None:
            if not np.array_equal(turn, np.eye(3)):
                raise self.error("<origin> has both rpy and quat_xyzw", "remove one of them")
            turn = self._quaternion(quaternion)
        return compose_transform(np.zeros(3) if xyz is None else self._three(xyz, "xyz"), turn)

    def _three(self, text: str, attribute: str) -> Array:
        what = f"{attribute}={text[:60]!r} of <origin>"
        values = self.parsed(text, what, (3,))
        if not np.isfinite(values).all():
            raise self.error(f"{what} is not finite", "write finite numbers")
        return values

    def _quaternion(self, text: str) -> Array:
        what = f"quat_xyzw={text[:60]!r} of <origin>"
        values = self.parsed(text, what, (4,))
        length = float(norm(values))
        if not (np.isfinite(length) and length > 1e-9):
            raise self.error(f"{what} is no rotation", 'write quat_xyzw="0 0 0 1" or an rpy')
        if abs(length - 1.0) > 1e-3:
            self.say(f"{what} has length {length:.4g}: normalised")
        return rotation_of_quaternion(unit(values))


def rotation_of(rpy: Array) -> Array:
    """(3, 3) rotation: roll about x, then pitch about y, then yaw about z, all of the fixed frame."""
    (sr, sp, sy), (cr, cp, cy) = sin(rpy).tolist(), cos(rpy).tolist()
    return np.array(
        [
            [cp * cy, sp * sr * cy - cr * sy, sp * cr * cy + sr * sy],
            [cp * sy, sp * sr * sy + cr * cy, sp * cr * sy - sr * cy],
            [-sp, cp * sr, cp * cr],
        ]
    )
