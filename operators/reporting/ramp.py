"""The colours of heat maps: from violet over green to yellow, even to the eye, and apart to colour-blind ones."""

import numpy as np

STOPS = ((68, 1, 84), (59, 82, 139), (33, 145, 140), (94, 201, 98), (253, 231, 37))  # viridis, sRGB


def ramp(share):
    """share (...) of 0 to 1 -> (..., 3) sRGB from 0 to 1"""
    place = np.clip(share, 0.0, 1.0) * (len(STOPS) - 1)
    return np.stack([np.interp(place, range(len(STOPS)), stop) for stop in np.array(STOPS).T / 255], axis=-1)


def css(share):
    """CSS colour of 0 to 1"""
    return "rgb({:.0f},{:.0f},{:.0f})".format(*255 * ramp(share))


def css_stops():
    """The ramp as those of a CSS gradient."""
    return ",".join(f"rgb{stop}" for stop in STOPS)
