"""Equalities of a compiled MJCF model: joints that follow another, or are held; others are left out, and said.

========================================  =============================================================================
The document                              is read as
========================================  =============================================================================
an equality of two joints                 mimic; along its tangent at 0 where it is bent
an equality of one joint                  held where it says
an equality of fixed tendons, linear,     the same
over one joint or two
over more joints, or bent                 left out: a coupling is lost
a connect or weld constraint              left out: a closed chain is no tree, so the joints move as if it were open
========================================  =============================================================================

Values of joints count from 0, where MuJoCo's equalities count from ``ref``.
"""

from collections.abc import Sequence
from typing import Any

from artsim.loading.mjcf_shapes import numbers
from artsim.loading.urdf_document import MimicRelation
from artsim.model.objects import Repair

_SAME = 1e-12
"""Share of the largest coefficient below which another is none."""


class EqualityReader:
    """Reads the equalities of a compiled model.

    Attributes
    ----------
    mimics : dict
        What each joint follows, by its number.
    held : dict
        Where each joint is held, radians or metres.
    """

    def __init__(self, mujoco: Any, model: Any, joints: Sequence[str], bodies: Sequence[str], repairs: list[Repair]):
        self._model, self._joints, self._bodies, self._repairs = model, joints, bodies, repairs
        self._objects = numbers(mujoco.mjtObj)
        self.mimics: dict[int, MimicRelation] = {}
        self.held: dict[int, float] = {}
        self._sources: dict[int, int] = {}
        types = numbers(mujoco.mjtEq)
        for e in range(model.neq):
            if not model.eq_active0[e]:
                continue
            if model.eq_type[e] == types.mjEQ_JOINT:
                self._read_joints(e)
            elif model.eq_type[e] == types.mjEQ_TENDON:
                self._read_tendons(e)
            else:
                self._leave_open(e, "connect" if model.eq_type[e] == types.mjEQ_CONNECT else "weld")

    def _read_joints(self, e: int) -> None:
        joint, source = int(self._model.eq_obj1id[e]), int(self._model.eq_obj2id[e])
        shift, rate, *bent = self._model.eq_data[e, :5].tolist()
        if source < 0:
            self.held[joint] = self._zero(joint) + shift
            return
        if any(bent):
            self._say(f"joint {self._joints[joint]!r}", "follows another along a curve: read as its tangent at 0")
        self._follow(joint, source, rate, shift)

    def _read_tendons(self, e: int) -> None:
        model = self._model
        first, second = int(model.eq_obj1id[e]), int(model.eq_obj2id[e])
        shift, rate, *bent = model.eq_data[e, :5].tolist()
        # The sum of coefficients times travels from ``ref`` is ``shift``.
        terms: dict[int, float] = dict(self._terms(first))
        if second >= 0:
            for joint, coefficient in self._terms(second):
                terms[joint] = terms.get(joint, 0.0) - rate * coefficient
        largest = max((abs(value) for value in terms.values()), default=0.0)
        terms = {joint: value for joint, value in terms.items() if abs(value) > _SAME * largest}
        taken = [joint for joint in terms if joint in self.mimics or joint in self.held]
        if len(terms) == 1 and not taken:
            ((joint, coefficient),) = terms.items()
            self.held[joint] = self._zero(joint) + shift / coefficient
            return
        if len(terms) == 2 and not (second >= 0 and any(bent)):
            # The joint that comes later follows, unless it follows another already.
            for joint, source in (sorted(terms, reverse=True), sorted(terms)):
                if joint not in taken and not self._leads_to(source, joint):
                    self._follow(joint, source, -terms[source] / terms[joint], shift / terms[joint])
                    return
        names = ", ".join(repr(self._joints[joint]) for joint in sorted(terms))
        self._say(f"tendon {model.tendon(first).name!r}", f"couples joints {names}: the coupling is left out")

    def _terms(self, tendon: int) -> list[tuple[int, float]]:
        """Joints and coefficients of a fixed tendon."""
        start, count = int(self._model.tendon_adr[tendon]), int(self._model.tendon_num[tendon])
        return [(int(self._model.wrap_objid[w]), float(self._model.wrap_prm[w])) for w in range(start, start + count)]

    def _leads_to(self, joint: int, goal: int) -> bool:
        """Whether a joint is another, or follows it by way of others."""
        seen = set()
        while joint != goal and joint in self._sources and joint not in seen:
            seen.add(joint)
            joint = self._sources[joint]
        return joint == goal

    def _follow(self, joint: int, source: int, rate: float, shift: float) -> None:
        """Let a joint's travel from ``ref`` be a rate times another's, plus a shift."""
        offset = self._zero(joint) + shift - rate * self._zero(source)
        self.mimics[joint] = MimicRelation(self._joints[source], rate, offset)
        self._sources[joint] = source

    def _zero(self, joint: int) -> float:
        return float(self._model.qpos0[self._model.jnt_qposadr[joint]])

    def _leave_open(self, e: int, kind: str) -> None:
        model = self._model
        bodies = [self._body(int(ends[e]), int(model.eq_objtype[e])) for ends in (model.eq_obj1id, model.eq_obj2id)]
        first, second = (self._bodies[b] for b in bodies)
        lost = "a closed chain is no tree, so joints move as if it were open, and what it holds together may part"
        if any(model.body_mocapid[b] >= 0 for b in bodies):
            lost = "a program moves one of them (mocap), and the object is free of it"
        self._say(f"<{kind}> of {first!r} and {second!r}", f"left out: {lost}")

    def _body(self, number: int, kind: int) -> int:
        return int(self._model.site_bodyid[number]) if kind == self._objects.mjOBJ_SITE else number

    def _say(self, where: str, what: str) -> None:
        self._repairs.append(Repair(where, what))
