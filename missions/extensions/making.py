"""Makes controllers and operators of one's own, as every run makes them."""

from collections.abc import Callable, Mapping
from typing import cast

from numpy.random import Generator

from farside.ground.operators.operator import Operator
from farside.places import Chart
from farside.rover.controller import Controller
from farside.settings import Options


def make_controller(
    kind: type[Controller], action_costs: Mapping[str, float], rng: Generator, options: Options
) -> Controller:
    """A controller of class `kind`, with the options that the mission has for it."""
    return cast("Callable[..., Controller]", kind)(action_costs, rng=rng, **options)


def make_operator(kind: type[Operator], chart: Chart, rng: Generator, options: Options) -> Operator:
    """An operator of class `kind`, with the options that the mission has for it."""
    return cast("Callable[..., Operator]", kind)(chart, rng=rng, **options)
