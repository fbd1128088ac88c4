"""The numbers that shape learning and acting."""

import msgspec


class Curiosity(msgspec.Struct, frozen=True, kw_only=True):
    """Exploration through the map: what was never tried, or long ago, is worth a way.

    While the map is built, every known Sign has an arc straight to the goal for each action not
    tried there, at cost `optimistic_cost`; for an action tried n cycles ago the same arc costs
    `optimistic_cost + restlessness / n`. Without a goal the arcs lead to the frontier. Source:
    project default, not in the seed.

    Attributes:
        optimistic_cost: what trying something new is expected to cost, above 0, in the unit of
            action costs.
        restlessness: cost times cycles, 0 or more; the greater it is, the longer what was tried
            stays tried.

    Raises:
        ValueError: if one is outside its range. The message names it.
    """

    optimistic_cost: float = 10.0
    restlessness: float = 2e4

    def __post_init__(self) -> None:
        if not 0.0 < self.optimistic_cost < float("inf"):
            raise ValueError(f"optimistic_cost: expected above 0, found {self.optimistic_cost}")
        if not 0.0 <= self.restlessness < float("inf"):
            raise ValueError(f"restlessness: expected 0 or more, found {self.restlessness}")


class Parameters(msgspec.Struct, frozen=True, kw_only=True):
    """How a model learns and acts. Every default is a project default: the seed leaves them open.

    Attributes:
        alpha: α, how far a success takes C_m towards 1; 0 to 1.
        beta: β, how far a failure takes C_m towards 0; 0 to 1.
        learning_probability: λ, chance that an opportunity to create a hypothesis is taken;
            0 to 1.
        initial_cm: C_m of a new hypothesis; 0 to 1.
        reach: how many cycles the activation traces go back, so the longest delay of a
            hypothesis; 1 or more.
        own_credit: reckon costs with what a hypothesis foretells that no better one does, and not
            with C_m; see `farside.dem.learning.credit`. Off: the seed's costs.
        differentiation: let middling hypotheses spawn copies with one more Token in the context;
            see `farside.dem.learning.differentiation`.
        removal: remove hypotheses that have proved ineffective.
        maturity: predictions after which a hypothesis is judged for either; 1 or more. Fewer than
            8 are too few to tell a difference from chance.
        ineffective: a mature hypothesis with a C_m below this is removed; 0 to 1.
        break_multiple: a goal is suspended when its P_v has grown past this multiple of what it
            was when set; above 1.
        recovery: cycles after which a suspended goal is tried again; 1 or more.
        curiosity: explore through the map instead of at random; off by default, where an operator
            must not be surprised.

    Raises:
        ValueError: if one is outside its range. The message names it.
    """

    alpha: float = 0.5
    beta: float = 0.2
    learning_probability: float = 1.0
    initial_cm: float = 0.5
    reach: int = 1
    own_credit: bool = True
    differentiation: bool = True
    removal: bool = True
    maturity: int = 16
    ineffective: float = 0.02
    break_multiple: float = 4.0
    recovery: int = 100
    curiosity: Curiosity | None = None

    def __post_init__(self) -> None:
        for name in ("alpha", "beta", "learning_probability", "initial_cm", "ineffective"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(
                    f"{name}: expected a number from 0 to 1, found {getattr(self, name)}"
                )
        for name, unit in (
            ("reach", "cycles"),
            ("maturity", "predictions"),
            ("recovery", "cycles"),
        ):
            if not isinstance(getattr(self, name), int) or getattr(self, name) < 1:
                raise ValueError(
                    f"{name}: expected a whole number of {unit}, 1 or more, "
                    f"found {getattr(self, name)}"
                )
        if not self.break_multiple > 1.0:
            raise ValueError(f"break_multiple: expected above 1, found {self.break_multiple}")
