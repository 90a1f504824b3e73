"""How much of an error is left when light has gone round with it: between white walls it comes back a million times.

The mean over a scene tells nothing of a room within it, so it is worked out node by node.
"""

import numpy as np

from ..tolerances import SINGLE

BOUNCES = 4  # followed one by one; from then on each node's light falls as in the last two


def amplification(times, rho):
    """(n,) What an even error of 1 at all nodes comes to at each, over all bounces: times(value (n, c)) the rows over
    the nodes, rho (n, 3)."""
    rho = rho.max(axis=1, keepdims=True)
    terms = [np.ones_like(rho)]
    for _ in range(BOUNCES):
        terms.append(times(rho * terms[-1]))
    # over two bounces: between a white face and a grey one light falls by one and the other in turns
    falls = np.sqrt(np.divide(terms[-1], terms[-3], out=np.zeros_like(rho), where=terms[-3] > 0))
    falls = np.minimum(falls, 1 - SINGLE)  # rows are in single precision
    return (sum(terms) + terms[-1] * falls / (1 - falls))[:, 0]


def passed_on(times, rho, error, amplified):
    """(n, c) What errors (n, c) at the nodes, of either sign, come to when others have received them: the first two
    bounces as they cancel, the rest by the amplification (n,)."""
    once = times(rho * error)
    return np.abs(once) + amplified[:, None] * np.abs(times(rho * once))
