"""Whole scenes at random: crossing, coplanar, touching, turned, two-sided, domes. Each is a furnace: radiance is 1.

    python tests/stability/fuzz.py [SCENES [FIRST SEED [rays]]]

A scene fails if it ends in anything but a SceneError, is not finite, or is further off than what is stated. The seed of
each failure is printed: it makes the same scene anywhere. rays: by these, whatever is chosen, as polygons and meshes in
turns.
"""

import os
import sys
import time
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path.insert(0, str(ROOT))

import numpy as np  # noqa: E402
from judge import judge  # noqa: E402
from kinds import Place, between, furnace  # noqa: E402
from variants import VARIANTS  # noqa: E402

TARGET, SECONDS = 0.1, 60.0
LAMPS = 0.2  # of the shapes, in half of the scenes
LATTICE = 0.5  # m: half of all coordinates lie on it, so that shapes touch and coincide


def anywhere(rng):
    """Numbers (3,), on the lattice or not."""
    at = rng.uniform(-2, 2, 3)
    return np.where(rng.random(3) < 0.5, np.round(at / LATTICE) * LATTICE, at)


def some_shape(place, rng):
    """[shapes] of one object."""
    kind, at = rng.integers(0, 5), anywhere(rng)
    size = np.maximum(np.abs(anywhere(rng)), 0.1)
    if kind == 0:
        u, v = np.diag(size)[rng.permutation(3)[:2]]
        return [place.plane(at, u, v)]
    if kind == 1:
        return place.box(at, at + size, rng.choice([0.0, between(rng, 1e-3, 3)]))
    if kind == 2:
        return [place.ball(at, rng.choice([0.5, 1.0, rng.uniform(0.1, 1.5)]))]
    if kind == 3:
        return [place.ellipsoid(at, size * between(rng, 1e-2, 1) ** rng.random(3), rng)]
    return [place.ball(at, rng.uniform(3, 6))]


def scene(rng, lamps=None):
    """lamps: whether some shapes shine brighter than all in the mean; None: so it is in half of the scenes."""
    place = Place(rng, rng.choice([0.0, between(rng, 1, 1e3)]), rng.choice([1.0, between(rng, 1e-3, 1e3)]))
    if rng.random() < 0.5:
        place.turn = place.scale * np.eye(3)
    shapes = [s for _ in range(rng.integers(1, 6)) for s in some_shape(place, rng)]
    rounding = rng.choice([2.0**-53, 2.0**-24])
    rho = rng.uniform(0.1, 0.9)
    drawn = rng.random() < 0.5
    if drawn if lamps is None else lamps:
        rho = np.where(rng.random(len(shapes)) < LAMPS, rho, rng.uniform(0.8, 0.97))
    return f"{len(shapes)} shapes", furnace(shapes, rho, rounding=rounding), "furnace"


def main(scenes="1000", first="0", by="links"):
    failed = refused = late = 0
    slowest, start = 0.0, time.process_time()
    for seed in range(int(first), int(first) + int(scenes)):
        try:
            variant = VARIANTS[seed % len(VARIANTS)] if by == "rays" else None
            verdict = judge(scene, seed, TARGET, SECONDS, variant)
        except Exception:
            failed += 1
            print(f"seed {seed}: {traceback.format_exc(limit=-2)}", flush=True)
            continue
        refused += verdict.refused
        slowest = max(slowest, verdict.seconds)
        late += verdict.said.startswith("time_limit")
        if not verdict.holds:
            failed += 1
            print(f"seed {seed}: {verdict}", flush=True)
    print(
        f"{scenes} scenes from seed {first} by {by}: {failed} failed, {refused} refused ({late} out of time), the "
        f"slowest {slowest:.1f} s, {time.process_time() - start:.0f} s in all"
    )
    return int(failed > 0)


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
