"""What shines in vain."""

import numpy as np


def idle_of(state):
    """Names of what shines but comes to no place of any node: all of it is hidden, or what it lights is smaller.
    Not a side or a face of a lamp, of which others light something."""
    seen = (state.lit.factor > 0).any(axis=(0, 2)) | state.lit.beamed
    lamps = list(zip(state.lit.sources[: len(seen) - len(state.lit.spots)], seen)) if len(state.lit.factor) else []
    whole = {id(s.whole) for s, some in lamps if some}
    useful = [s for s, some in lamps if s.is_surface and some]
    parts, bounds = {s.index for s in useful}, [s.shape.bounds for s in useful]
    centre, radius = np.array([c for c, _ in bounds]).reshape(-1, 3), np.array([r for _, r in bounds])

    def has_others(source):
        own, reach = source.shape.bounds
        return bool((np.linalg.norm(centre - own, axis=1) <= radius + reach).any())

    idle = [s for s, some in lamps if not some and s.colour.any() and id(s.whole) not in whole]
    return list(dict.fromkeys(s.name for s in idle if not (s.is_surface and (s.index in parts or has_others(s)))))
