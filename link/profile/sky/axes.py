"""The axes in which positions are given, and how to turn them into those of the ICRF."""

import math

import numpy as np

from farside.link.profile.statistics import Floats

_OBLIQUITY_RAD = math.radians(84_381.448 / 3600)
"""Between the ecliptic and the equator of J2000 (IAU 1976), as SPICE and Horizons have it."""

_COSINE, _SINE = math.cos(_OBLIQUITY_RAD), math.sin(_OBLIQUITY_RAD)

EQUATOR: Floats = np.eye(3)
"""Turns nothing: the axes of the ICRF, from which those of J2000 differ by 0.02 arcseconds."""

ECLIPTIC: Floats = np.array([[1.0, 0.0, 0.0], [0.0, _COSINE, -_SINE], [0.0, _SINE, _COSINE]])
"""From the ecliptic of J2000 to the ICRF."""

FRAMES = {1: EQUATOR, 17: ECLIPTIC}
"""By the numbers of these frames in SPICE."""
