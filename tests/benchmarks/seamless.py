"""Do directions leave bands, blotches or speckles? Pictures of the rooms of many shapes by rays, contrast raised.

    python tests/benchmarks/seamless.py [FOLDER]

Writes FOLDER/seamless_<room>.png: on the left what a camera sees at the coarser target, each pixel read at the point
that it shows; then a part of it, enlarged, at both TARGETS, with what the light of each surface differs there from what
is linear across the picture CONTRAST times as large. What a pixel shows is found by the tests' own tracer.
"""

import sys
import time
from pathlib import Path

import numpy as np
from output import ROOT

sys.path[:0] = [str(ROOT / "tests" / "core"), str(ROOT / "tests" / "stability")]

import references  # noqa: E402
from matplotlib.image import imsave  # noqa: E402
from tracer import Tracer  # noqa: E402

from pdm_core import solve  # noqa: E402

WIDE, HIGH = 320, 240
TARGETS = 0.04, 0.01
CONTRAST = 5.0
# eye, what it looks at (m), width over distance, brightness, the part that is enlarged (left, top, width of the whole)
CAMERAS = {
    "boxes50": ((9.0, -14.0, 9.0), (0.0, -1.0, 0.0), 1.2, 0.6, (0.42, 0.42, 0.25)),
    "furnished_room": ((2.35, -1.85, 1.75), (-0.6, 0.5, 0.8), 1.7, 0.9, (0.12, 0.1, 0.36)),
}


def rays(eye, aim, spread, window, wide, high):
    """Directions (high * wide, 3) of the pixels of a window (left, top, width) of the picture."""
    forward = np.subtract(aim, eye)
    right = np.cross(forward, (0, 0, 1))
    forward, right = forward / np.linalg.norm(forward), right / np.linalg.norm(right)
    left, top, width = window
    x = left + width * (np.arange(wide) + 0.5) / wide - 0.5
    y = (top + width * (np.arange(high) + 0.5) / high - 0.5) * HIGH / WIDE
    way = forward + spread * (x[None, :, None] * right - y[:, None, None] * np.cross(right, forward))
    return (way / np.linalg.norm(way, axis=2, keepdims=True)).reshape(-1, 3)


def picture(solution, tracer, camera, window, wide=WIDE, high=HIGH):
    """Surface (n,) that each pixel shows, -1 for none, and its radiance (n, 3)."""
    eye, aim, spread = camera[:3]
    way = rays(eye, aim, spread, window, wide, high)
    surface, points = tracer.hit(np.tile(np.array(eye), (len(way), 1)), way)
    light, seen = np.tile(solution.scene.background, (len(way), 1)), np.flatnonzero(surface >= 0)
    light[seen] = solution.radiance(surface[seen], points[seen])
    return surface, light


def raised(surface, light, wide=WIDE, high=HIGH):
    """Radiance (n, 3) with what differs from a linear fit over its surface's pixels as much larger."""
    y, x = np.divmod(np.arange(len(light)), wide)
    terms, out = np.stack([np.ones(len(light)), x / wide, y / high], axis=1), light.copy()
    for k in np.unique(surface[surface >= 0]):
        mine = surface == k
        fit = terms[mine] @ np.linalg.lstsq(terms[mine], light[mine], rcond=None)[0]
        out[mine] = fit + CONTRAST * (light[mine] - fit)
    return np.maximum(out, 0.0)


def shown(light, brightness, wide=WIDE, high=HIGH):
    """Radiance (n, 3) as a picture (high, wide, 3) in sRGB, the brightest pressed together."""
    light = brightness * light
    light = (light / (1 + light)).reshape(high, wide, 3)
    return np.where(light <= 0.0031308, 12.92 * light, 1.055 * np.maximum(light, 1e-9) ** (1 / 2.4) - 0.055)


def main(folder="build/bench"):
    for name, camera in CAMERAS.items():
        scene, (*_, brightness, part) = references.load(name)[1], camera
        tracer, views = Tracer(scene), []
        for target in TARGETS:
            start = time.process_time()
            solution = solve(scene, target)
            solved = time.process_time()
            views.append(raised(*picture(solution, tracer, camera, part)))
            if target == TARGETS[0]:
                views.insert(0, picture(solution, tracer, camera, (0.0, 0.0, 1.0))[1])
            read = time.process_time() - solved
            print(f"{name}: stated {solution.error:.4f}, {solved - start:.1f} s, reading {read:.0f} s", flush=True)
        out = Path(folder) / f"seamless_{name}.png"
        out.parent.mkdir(parents=True, exist_ok=True)
        imsave(out, np.clip(np.concatenate([shown(v, brightness) for v in views], axis=1), 0, 1))
        print(out, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
