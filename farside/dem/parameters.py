"""The numbers that shape learning."""

import msgspec


class Parameters(msgspec.Struct, frozen=True, kw_only=True):
    """How a model learns. Every default here is a project default: the seed leaves them open.

    Attributes:
        alpha: α, how far a success takes C_m towards 1; 0 to 1.
        beta: β, how far a failure takes C_m towards 0; 0 to 1.
        learning_probability: λ, chance that an opportunity to create a hypothesis is taken;
            0 to 1.
        initial_cm: C_m of a new hypothesis; 0 to 1.
        reach: how many cycles the activation traces go back, so the longest delay of a
            hypothesis; 1 or more.

    Raises:
        ValueError: if one is outside its range. The message names it.
    """

    alpha: float = 0.5
    beta: float = 0.2
    learning_probability: float = 1.0
    initial_cm: float = 0.5
    reach: int = 1

    def __post_init__(self) -> None:
        for name in ("alpha", "beta", "learning_probability", "initial_cm"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(
                    f"{name}: expected a number from 0 to 1, found {getattr(self, name)}"
                )
        if not isinstance(self.reach, int) or self.reach < 1:
            raise ValueError(
                f"reach: expected a whole number of cycles, 1 or more, found {self.reach}"
            )
