"""How much of an error is left when light has gone round with it: between white walls it comes back a million times.

The mean over a scene tells nothing of a room within it, so it is worked out node by node.
"""

import numpy as np

BOUNCES = 4  # followed one by one; from then on each node's light falls as in the last
CLOSEST = 1e-7  # to 1 that it falls by: single precision


def amplification(times, rho):
    """(n,) What an even error of 1 at all nodes comes to at each, over all bounces: times(value (n, c)) the rows over
    the nodes, rho (n, 3)."""
    rho = rho.max(axis=1, keepdims=True)
    term = np.ones_like(rho)
    total = term.copy()
    for _ in range(BOUNCES):
        before, term = term, times(rho * term)
        total += term
    falls = np.minimum(np.divide(term, before, out=np.zeros_like(term), where=before > 0), 1 - CLOSEST)
    return (total + term * falls / (1 - falls))[:, 0]


def passed_on(times, rho, error, amplified):
    """(n, 3) What errors (n, 3) at the nodes, of either sign, come to when others have received them: the first two
    bounces as they cancel, the rest by the amplification (n,)."""
    once = times(rho * error)
    return np.abs(once) + amplified[:, None] * np.abs(times(rho * once))
