"""Modified difference arrays, the form in which JPL's integrator leaves an orbit.

Source: F. T. Krogh's variable-order Adams method as described in NAIF, "SPK Required Reading",
data types 1 and 21.
"""

from farside.link.profile.statistics import Floats


def modified_differences(record: Floats, terms: int, et_s: float) -> tuple[float, float, float]:
    """The position in km that a record gives at a moment.

    Args:
        record: reference epoch, `terms` step sizes, position and velocity of each axis in turn,
            `terms` differences for each axis, the greatest order plus one, and the order for each
            axis.
        terms: how many differences there are for each axis at most.
        et_s: the moment, in the time of the reference epoch.
    """
    values = record.tolist()
    steps_s, state = values[1 : terms + 1], values[terms + 1 : terms + 7]
    flat = values[terms + 7 : 4 * terms + 7]
    highest, orders = int(values[4 * terms + 7]), [int(one) for one in values[4 * terms + 8 :]]
    delta_s = et_s - values[0]
    # Ratios of successive step sizes, from which the weights of the differences follow.
    factors, weights, past_s = [], [0.0] * (highest + 1), delta_s
    for number in range(highest - 2):
        factors.append(past_s / steps_s[number])
        weights[number] = delta_s / steps_s[number]
        past_s = delta_s + steps_s[number]
    kernel = [1.0 / (number + 1) for number in range(highest)]
    for depth in range(1, highest - 1):
        for number in range(depth):
            place = number + highest - depth
            kernel[place] = factors[number] * kernel[place - 1] - weights[number] * kernel[place]
    found = []
    for axis in range(3):
        differences = flat[axis * terms : (axis + 1) * terms]
        total = sum(
            differences[number] * kernel[number + 1] for number in reversed(range(orders[axis]))
        )
        found.append(state[2 * axis] + delta_s * (state[2 * axis + 1] + delta_s * total))
    return found[0], found[1], found[2]
