"""The parameters of learning and acting, and the range of each."""

import math
from enum import StrEnum
from typing import Annotated, cast, get_args

import msgspec
from msgspec import Meta

from farside.dem.equations import IMPROBABLE

Fraction = Annotated[float, Meta(ge=0, le=1)]
Count = Annotated[int, Meta(ge=1, le=10**9)]

MAX_REACH = 1000
"""The longest activation traces, in cycles: every cycle looks at all of them (project default)."""

Reach = Annotated[int, Meta(ge=1, le=MAX_REACH)]

OWN_RULES = (
    "averaging",
    "break_point",
    "differentiation",
    "own_credit",
    "put_aside",
    "removal",
    "situations",
    "whole_implies_parts",
)
"""The parameters that switch a rule of ours on: all that `Parameters.plain` switches off."""

_LATE_RATE = 0.01
_CONSTANT_RATES = {"alpha": 0.5, "beta": 0.2}
_BY_AVERAGING = cast("float", None)  # until `__post_init__` knows which of these


class _Checked(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Fields that are checked however they are set: msgspec by itself does so only on decoding.

    As there, an enum may be given by its value, and a struct as a mapping.
    """

    def __post_init__(self) -> None:
        for field in msgspec.structs.fields(self):
            value = getattr(self, field.name)
            try:
                value = msgspec.convert(value, field.type)
            except msgspec.ValidationError as error:
                expected = _in_words(field.type)
                raise ValueError(f"{field.name}: expected {expected}, found {value}") from error
            msgspec.structs.force_setattr(self, field.name, value)


def _in_words(kind: object) -> str:
    """The values that a field takes, such as "a number >= 0 and <= 1"."""
    match get_args(kind):
        case (number, Meta() as meta):
            bounds = ((">", meta.gt), (">=", meta.ge), ("<=", meta.le))
            limits = [f"{sign} {limit:g}" for sign, limit in bounds if limit is not None]
            return f"{'a whole number' if number is int else 'a number'} {' and '.join(limits)}"
        case _ if isinstance(kind, type) and issubclass(kind, StrEnum):
            return f"one of {', '.join(kind)}"
        case _:
            return getattr(kind, "__name__", str(kind))


class Exploration(StrEnum):
    """What a model does where the map suggests no action."""

    NONE = "none"
    """Nothing: `DynamicExpectancyModel.choose` returns `None`."""

    RANDOM = "random"
    """Any action, each with equal probability."""

    CURIOUS = "curious"
    """What was never tried, or not for long; also on the way to a goal. See `Curiosity`."""


class Values(StrEnum):
    """What a policy value P_v tells of the way to a goal."""

    BEST = "best"
    """Equation 5 of the seed: the least total of cost estimates, by the best outcome of each."""

    EXPECTED = "expected"
    """What it costs on average, by all outcomes of each action; see `farside.dem.policy`."""


class Curiosity(_Checked, frozen=True):
    """Exploration through the map: what was never tried, or not for long, is worth a detour.

    The curious map gives every known Sign an arc straight to the goal for each action: at
    `optimistic_cost` if the action was never tried there, at `optimistic_cost + restlessness / n`
    if it was last tried n cycles ago. Without a goal the arcs lead to the frontier. Source:
    project default, not in the seed.

    Attributes:
        optimistic_cost: the cost that trying something new is expected to have, finite and above
            0, in the unit of the action costs.
        restlessness: in units of cost times cycles, finite and 0 or more. The greater it is, the
            longer an action counts as recently tried.

    Raises:
        ValueError: if a value is out of range. The message names it.
    """

    optimistic_cost: Annotated[float, Meta(gt=0)] = 10.0
    restlessness: Annotated[float, Meta(ge=0)] = 2e4

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("optimistic_cost", "restlessness"):
            if math.isinf(getattr(self, name)):
                raise ValueError(f"{name}: expected a finite number, found inf")


class Parameters(_Checked, frozen=True):
    """How a model learns and acts. Every default is a project default: the seed leaves them open.

    Attributes:
        alpha: α, the gain of C_m on success, as a fraction of its distance to 1; 0 to 1. With
            `averaging` the least gain, .01 by default; without it .5 by default.
        beta: β, the loss of C_m on failure, as a fraction of its value; 0 to 1. With `averaging`
            the least loss, .01 by default; without it .2 by default.
        learning_probability: λ, the probability that an opportunity to create a hypothesis is
            taken; 0 to 1.
        initial_cm: C_m of a new hypothesis; 0 to 1.
        plain: learn and act by the seed and nothing else: every rule of ours is off (`OWN_RULES`),
            whatever is said of it beside.
        reach: length of the activation traces in cycles, and so the longest delay of a
            hypothesis; 1 to `MAX_REACH`.
        improbable: with `averaging`, results contradict C_m if they are a run of equal ones that by
            C_m had less than this probability, 0 to 1. The less, the later a change of the world is
            noticed, and the more rarely luck is taken for one.
        own_credit: base cost estimates on credit instead of C_m; see
            `farside.dem.learning.credit`. Off: the seed's costs.
        averaging: let C_m be the average of the results until α and β are the greater rates, and
            again after results that contradict it; see `farside.dem.equations.averaging_rate`. Off:
            the constant rates α and β from the first result on, as in the seed.
        situations: let few things explain a surprise, and the situation as a whole where its parts
            cannot. Off: every Sign in the activation traces explains it.
        whole_implies_parts: to reach a whole is to reach its parts: P_v(whole) ≤ P_v(part).
        differentiation: let middling hypotheses spawn copies with one more Token in the context;
            see `farside.dem.learning.differentiation`.
        removal: remove hypotheses that have proved ineffective.
        maturity: number of predictions after which a hypothesis may be differentiated or removed;
            1 to 10⁹. Fewer than 8 are too few to tell a difference from chance.
        ineffective: a mature hypothesis with a C_m below this is removed; 0 to 1.
        put_aside: put a goal aside that is unknown or that no way leads to, so that the next can be
            pursued. Off: the top-goal is the highest, and the model explores.
        values: what a policy value tells: `best`, equation 5 of the seed, or `expected`, the cost
            by all outcomes of each action; see `farside.dem.policy.expectation`.
        break_point: block a goal that has become too dear; see `break_multiple`.
        break_multiple: a goal is blocked, and put aside, when its P_v has grown past this multiple
            of what it was when the goal was set; above 1.
        recovery: number of cycles for which a blocked goal stays aside; 1 to 10⁹.
        exploration: what to do where the map suggests no action: `none`, `random` or `curious`.
            Not curious by default, so that the operator is not surprised.
        curiosity: the costs of trying, where exploration is `curious`.

    Raises:
        ValueError: if a value is out of range. The message names it.
    """

    alpha: Fraction = _BY_AVERAGING
    beta: Fraction = _BY_AVERAGING
    learning_probability: Fraction = 1.0
    initial_cm: Fraction = 0.5
    plain: bool = False
    reach: Reach = 1
    averaging: bool = True
    improbable: Fraction = IMPROBABLE
    own_credit: bool = True
    situations: bool = True
    whole_implies_parts: bool = True
    differentiation: bool = True
    removal: bool = True
    maturity: Count = 16
    ineffective: Fraction = 0.02
    put_aside: bool = True
    values: Values = Values.BEST
    break_point: bool = True
    break_multiple: Annotated[float, Meta(gt=1)] = 4.0
    recovery: Count = 100
    exploration: Exploration = Exploration.RANDOM
    curiosity: Curiosity = Curiosity()

    def __post_init__(self) -> None:
        for name, constant in _CONSTANT_RATES.items():
            if getattr(self, name) is _BY_AVERAGING:
                rate = _LATE_RATE if self.averaging and not self.plain else constant
                msgspec.structs.force_setattr(self, name, rate)
        super().__post_init__()
        if not self.plain:
            return
        for name in OWN_RULES:
            msgspec.structs.force_setattr(self, name, False)  # noqa: FBT003 - a value, not a flag
        if self.exploration is Exploration.CURIOUS:
            raise ValueError("exploration: expected none or random with plain, found curious")
        if self.values is Values.EXPECTED:
            raise ValueError("values: expected best with plain, found expected")


def same(one: Parameters, other: Parameters) -> bool:
    """Whether two parameters are equal in every field, though one may be of a subclass."""
    names = [field.name for field in msgspec.structs.fields(Parameters)]
    return all(getattr(one, name) == getattr(other, name) for name in names)


def others_than_default(parameters: Parameters) -> list[str]:
    """The parameters that are not as they would be by default, such as "alpha=0.25"."""
    default = Parameters(plain=parameters.plain, averaging=parameters.averaging)
    named = ["plain=True"] * parameters.plain
    named += ["averaging=False"] * (not parameters.plain and not parameters.averaging)
    names = [field.name for field in msgspec.structs.fields(Parameters)]
    values = {name: getattr(parameters, name) for name in names}
    return named + [f"{n}={value}" for n, value in values.items() if value != getattr(default, n)]
