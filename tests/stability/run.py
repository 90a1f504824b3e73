"""Every kind of stiff, extreme and everyday scene, as often as the minutes allow: a table, and docs/stability.md.

python tests/stability/run.py [MINUTES [OUTPUT.md]]
"""

import os
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "benchmarks")]

import numpy as np  # noqa: E402
from judge import judge  # noqa: E402
from kinds import KINDS  # noqa: E402
from output import machine  # noqa: E402
from variants import VARIANTS, knows  # noqa: E402

HEAD = """# Stability

Made by `make stability`: {scenes} scenes of {kinds} kinds (`tests/stability/kinds.py`) at random sizes, places and
rotations, target 2 %, at most 20 s each. A furnace has radiance 1 everywhere; the others are judged by an independent
path tracer, whose noise counts twice (large in mazes and with a lamp near a ceiling: there it tells little). A scene
holds if the stated error covers the measured one, or if it is refused by name. The first table is as `solve` chooses:
by links. The second is by rays, forced: the same scenes as they are, with their planes as polygons, with meshes for
planes and balls, and with all planes as one mesh (welded or not, open, crossing itself), in turns.

{held} of {scenes} hold, {refused} of them refused. Stated over measured, where measured is above noise and 1e-4, in
{known} scenes: median {median:.1f}, 95th percentile {high:.1f}. {machine}

{tables}
"""

TABLE = """| kind | held | refused | above target | first, last extreme | worst stated / measured | median, longest s |
|---|---|---|---|---|---|---|
"""


def row(name, verdicts):
    solved = [v for v in verdicts if not v.refused]
    worst = max(solved, key=lambda v: v.measured - v.stated, default=None)
    missed = sum(v.stated > 0.02 for v in solved)
    seconds = [v.seconds for v in verdicts]
    ends = f"{solved[0].extreme}; {solved[-1].extreme}" if solved else "-"
    against = f"{worst.stated:.2%} / {worst.measured:.2%} ({worst.extreme})" if worst else "-"
    held = sum(v.holds for v in verdicts)
    return (
        f"| {name.replace('_', ' ')} | {held} of {len(verdicts)} | {len(verdicts) - len(solved)} | {missed} "
        f"| {ends} | {against} | {np.median(seconds):.2f}, {max(seconds):.1f} |"
    )


def main(minutes="30", output=ROOT / "docs" / "stability.md"):
    end, seed = time.time() + 60 * float(minutes), 0
    links, rays = {}, {}
    while time.time() < end:
        for number, kind in enumerate(KINDS):
            variant = VARIANTS[(seed + number) % len(VARIANTS)]
            for found, changed in ((links, None), (rays, variant)):
                if changed is None or knows(changed, kind):
                    verdict = judge(kind, seed, variant=changed)
                    found.setdefault(verdict.kind, []).append(verdict)
                    if not verdict.holds:
                        print(f"seed {seed}: {verdict}", flush=True)
        seed += 1
    everything = [v for found in (links, rays) for verdicts in found.values() for v in verdicts]
    known = [v for v in everything if not v.refused and v.measured > max(2 * v.noise, 1e-4)]
    ratio = np.array([v.stated / v.measured for v in known])
    about = machine()
    tables = [TABLE + "\n".join(row(*item) for item in sorted(found.items())) + "\n" for found in (links, rays)]
    text = HEAD.format(
        scenes=len(everything), kinds=len(KINDS), held=sum(v.holds for v in everything),
        refused=sum(v.refused for v in everything), known=len(known),
        median=np.median(ratio), high=np.percentile(ratio, 95),
        machine=f"Python {about['python']}, numpy {about['numpy']}, one thread.",
        tables="\n".join(tables),
    )  # fmt: skip
    failed = [v for v in everything if not v.holds]
    text += "\n## What does not hold\n\n" if failed else ""
    text += "".join(
        f"- {v.kind.replace('_', ' ')}, {v.extreme}: stated {v.stated:.2%}, measured {v.measured:.2%} "
        f"(noise {v.noise:.2%})\n" for v in failed
    )  # fmt: skip
    Path(output).write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main(*sys.argv[1:])
