"""A convergence result (see convergence.result_steps) as one self-contained HTML page, CSV and rows of text. No bpy."""

import csv
import io
import math
from html import escape

from .ramp import css, css_stops

WIDTH, HEIGHT, LEFT, RIGHT, TOP, BOTTOM = 720, 428, 70, 16, 16, 60  # of the plot, in its own units
EXACT, PUBLISHED, CYCLES = "this bake", "published method", "Cycles"
STYLES = {  # colour (light, dark), marker, name: told apart without colour too
    EXACT: ("#0b62b8", "#6cb4ff", "circle"),
    PUBLISHED: ("#b04a00", "#ffa45c", "square"),
    CYCLES: ("#4a7a1e", "#a3d977", "triangle"),
}
COLUMNS = (
    ("method", "Method"), ("setting", "Setting"), ("seconds", "Seconds"), ("cpu_seconds", "CPU s"),
    ("stated", "Stated"), ("surfaces", "Surfaces L2"), ("l2", "Vertices L2"), ("p95", "95th percentile"),
    ("worst", "Worst"), ("noise", "Noise"), ("bias", "Bias"), ("peak_megabytes", "Peak MB"), ("nodes", "Nodes"),
    ("links", "Links"), ("visibility_done", "Visibility tests"), ("visibility_left_out", "left out"),
    ("rays", "Rays"), ("shadow_rays", "Shadow rays"),
)  # fmt: skip
SHARES = {"stated", "surfaces", "l2", "p95", "worst", "noise", "bias"}  # columns of relative errors

STYLE = """
:root{--ink:#1b1d21;--paper:#fff;--soft:#5c6370;--line:#d8dce3;--shade:#8884}
@media(prefers-color-scheme:dark){:root{--ink:#e6e8ec;--paper:#16181c;--soft:#a0a7b4;--line:#343943;
--shade:#8883}}
@media print{:root{--ink:#000;--paper:#fff;--soft:#333;--line:#bbb;--shade:#8884}section{break-inside:avoid}}
body{font:16px/1.5 system-ui,sans-serif;color:var(--ink);background:var(--paper);max-width:60rem;margin:0 auto;
padding:1rem}h1{font-size:1.5rem;margin:.2rem 0}h2{font-size:1.15rem;margin:1.6rem 0 .4rem}p{margin:.4rem 0}
.scroll{overflow-x:auto}.wide{width:max-content;max-width:calc(100vw - 2.5rem);position:relative;left:50%;
transform:translateX(-50%)}.hint{display:none}
.soft,figcaption{color:var(--soft);font-size:.9rem}table{border-collapse:collapse;
font-size:.8rem;font-variant-numeric:tabular-nums}th,td{padding:.25rem .4rem;border-bottom:1px solid var(--line);
text-align:right;vertical-align:bottom}td{white-space:nowrap}
th:first-child,td:first-child,th:nth-child(2),td:nth-child(2){text-align:left}
svg{width:100%;height:auto;display:block}svg text{fill:var(--ink);font:13px system-ui,sans-serif}
.grid{stroke:var(--line)}figure{margin:0}.key span{display:inline-block;margin-right:1.2em}
svg.plot{overflow:visible}svg.sign{display:inline;width:1em;height:1em;vertical-align:-.1em}
@media(max-width:70rem){.hint{display:block}}
@media(max-width:32rem){svg text{font-size:20px}}
@media print{.hint{display:none}.wide{overflow:visible;transform:none;left:0}
.wide table{font-size:.5rem}.wide th,.wide td{padding:.15rem .25rem}}
svg.map{max-width:34rem;background:#222;border-radius:4px;margin:.4rem 0}
.ramp{height:1rem;border-radius:3px;max-width:24rem}
.ends{display:flex;justify-content:space-between;max-width:24rem}li{margin:.15rem 0}
"""


def page(result):
    """The HTML text."""
    parts = [
        _section("Error against run time", f"{plot(result)}{_slopes(result)}", "fig"),
        _section("In numbers", _table(result)),
        _section("What was left out, because the scene does not need it", _items(result["plan"] + _saved(result))),
        _section("Where the error sits", _where(result)),
        _section("To tighter targets", _foretold(result)),
        _section("Said", _items(result["said"] + result["warnings"] + _refused(result))),
        _section("Made with", _about(result)),
    ]
    name = escape(result["about"]["file"] or result["about"]["scene"])
    colours = "".join(
        f".m{k}{{stroke:{light};fill:{light}}}@media(prefers-color-scheme:dark){{.m{k}{{stroke:{dark};fill:{dark}}}}}"
        f"@media print{{.m{k}{{stroke:{light};fill:{light}}}}}"
        for k, (light, dark, _) in enumerate(STYLES.values())
    )
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width,initial-scale=1">'
        f"<title>Error against run time: {name}</title><style>{STYLE}{colours}</style></head><body>"
        f"<h1>Error against run time: {name}</h1><p>{_summary(result)}</p>{''.join(parts)}</body></html>\n"
    )


def csv_text(result):
    """One row a run, the columns of the table; relative errors as fractions."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow([key for key, _ in COLUMNS])
    writer.writerows([[_cell(run, key) for key, _ in COLUMNS] for run in result["runs"]])
    return out.getvalue()


def text_rows(result):
    """[(method, setting, seconds, error)] as texts, for the sidebar and the terminal."""
    return [(r["method"], r["setting"], f"{r['seconds']:.2f} s", shown(error_of(r), result)) for r in result["runs"]]


def error_of(run):
    """The measured relative L2 error: over the surfaces, of Cycles at the vertices; the reference's is its stated."""
    if run["reference"]:
        return run["stated"]
    return run["measured"].get("surfaces", run["measured"]["vertices"])["l2"]


def shown(error, result):
    """0.83 %, with < where differences from the reference mean nothing."""
    below = error < result["floor"]
    return f"{'< ' if below else ''}{percent(max(error, result['floor']) if below else error)}"


def percent(value):
    return "" if value is None else f"{100 * value:.0f} %" if value >= 0.995 else f"{100 * value:.2g} %"


def slope(run_seconds, errors):
    """Of log error over log seconds, least squares; None for fewer than two."""
    x, y = [math.log(s) for s in run_seconds], [math.log(e) for e in errors]
    n, spread = len(x), sum((v - sum(x) / max(len(x), 1)) ** 2 for v in x)
    if n < 2 or not spread > 0:
        return None
    mean_x, mean_y = sum(x) / n, sum(y) / n
    return sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y)) / spread


def curves(result):
    """{method: [(seconds, error, run)]} of what is measured above the floor, and of the reference."""
    found = {}
    for run in result["runs"]:
        error = error_of(run)
        if run["seconds"] > 0 and error > 0:
            found.setdefault(run["method"], []).append((run["seconds"], error, run))
    return found


# -- the plot --------------------------------------------------------------------------------------------------------


class _Axes:
    """Seconds and errors on two logarithmic axes of whole decades."""

    def __init__(self, result):
        rows = [row for rows in curves(result).values() for row in rows]
        stated = [r["stated"] for r in result["runs"] if r["stated"]]
        self.x = _decades([s for s, _, _ in rows])
        self.y = _decades([e for _, e, _ in rows] + stated + [result["floor"]])

    def at(self, seconds, error):
        (x0, x1), (y0, y1) = self.x, self.y
        across = (math.log10(seconds) - x0) / (x1 - x0)
        down = (y1 - math.log10(max(error, 10**y0))) / (y1 - y0)
        return LEFT + across * (WIDTH - LEFT - RIGHT), TOP + down * (HEIGHT - TOP - BOTTOM)


def _decades(values):
    low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    return low, max(high, low + 1)


def plot(result):
    """The log-log plot as SVG; every point says its values when pointed at, and the table has them all."""
    axes = _Axes(result)
    parts = [_grid(axes), _floor(axes, result["floor"])]
    for k, (method, style) in enumerate(STYLES.items()):
        rows = curves(result).get(method, [])
        if not rows:
            continue
        line = " ".join("{:.1f},{:.1f}".format(*axes.at(s, e)) for s, e, run in rows if not run["reference"])
        parts.append(f'<polyline class="m{k}" style="fill:none;stroke-width:2.5" points="{line}"/>')
        parts += [_marker(style[2], *axes.at(s, e), k, _hover(run, result), run["reference"]) for s, e, run in rows]
        told = [(r["seconds"], r["stated"]) for _, _, r in rows if r["stated"]]
        if told:
            line = " ".join("{:.1f},{:.1f}".format(*axes.at(*row)) for row in told)
            parts.append(f'<polyline class="m{k}" style="fill:none;stroke-dasharray:5 4" points="{line}"/>')
    label = "Relative L2 error against seconds, logarithmic; the table below has all values"
    size = f'viewBox="0 0 {WIDTH} {HEIGHT}"'
    return f'{_key(result)}<svg class="plot" {size} role="img" aria-label="{label}">{"".join(parts)}</svg>'


def _grid(axes):
    parts = []
    for decade in range(axes.x[0], axes.x[1] + 1):
        x = axes.at(10.0**decade, 10.0 ** axes.y[0])[0]
        parts.append(f'<line class="grid" x1="{x:.1f}" x2="{x:.1f}" y1="{TOP}" y2="{HEIGHT - BOTTOM}"/>')
        parts.append(f'<text x="{x:.1f}" y="{HEIGHT - BOTTOM + 24}" text-anchor="middle">{10.0**decade:g}</text>')
    for decade in range(axes.y[0], axes.y[1] + 1):
        y = axes.at(10.0 ** axes.x[0], 10.0**decade)[1]
        parts.append(f'<line class="grid" x1="{LEFT}" x2="{WIDTH - RIGHT}" y1="{y:.1f}" y2="{y:.1f}"/>')
        parts.append(f'<text x="{LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{100 * 10.0**decade:g} %</text>')
    middle = (LEFT + WIDTH - RIGHT) / 2
    parts.append(f'<text x="{middle}" y="{HEIGHT - 10}" text-anchor="middle">seconds, with the vertices</text>')
    return "".join(parts)


def _floor(axes, floor):
    x, y = axes.at(10.0 ** axes.x[0], floor)
    height = HEIGHT - BOTTOM - y
    return f'<rect x="{x}" y="{y:.1f}" width="{WIDTH - LEFT - RIGHT}" height="{height:.1f}" fill="var(--shade)"/>'


def _marker(shape, x, y, k, title, is_open=False):
    body = {
        "circle": f'<circle cx="{x:.1f}" cy="{y:.1f}" r="5"',
        "square": f'<rect x="{x - 4.5:.1f}" y="{y - 4.5:.1f}" width="9" height="9"',
        "triangle": f'<path d="M{x:.1f} {y - 6:.1f}l6 10h-12z"',
    }[shape]
    tag = body[1 : body.index(" ")]
    hollow = ' style="fill:var(--paper);stroke-width:2"' if is_open else ""
    return f'{body} class="m{k}"{hollow}><title>{escape(title)}</title></{tag}>'


def _hover(run, result):
    stated = f", stated {percent(run['stated'])}" if run["stated"] else ""
    return f"{run['method']}, {run['setting']}: {run['seconds']:.2f} s, {shown(error_of(run), result)}{stated}"


def _key(result):
    """The legend, as HTML above the plot: nothing there lies over a curve."""
    parts = []
    for k, (method, style) in enumerate(STYLES.items()):
        if method in curves(result):
            told = ", measured; dashed: stated; hollow: the reference" if method == EXACT else ""
            sign = _marker(style[2], 8, 8, k, method)
            parts.append(_signed(sign, f"{escape(method)}{told}"))
    shade = '<rect x="0" y="3" width="16" height="10" fill="var(--shade)"/>'
    parts.append(_signed(shade, "below the stated error of the tightest run, where differences tell nothing"))
    return f'<p class="key soft">{" ".join(parts)}</p>'


def _signed(sign, text):
    return f'<span><svg viewBox="0 0 16 16" class="sign" aria-hidden="true">{sign}</svg> {text}</span>'


# -- texts -----------------------------------------------------------------------------------------------------------


def _section(title, body, kind=""):
    if not body:
        return ""
    body = f"<figure>{body}</figure>" if kind == "fig" else body
    return f"<section><h2>{escape(title)}</h2>{body}</section>"


def _items(texts):
    return f"<ul>{''.join(f'<li>{escape(text)}</li>' for text in texts)}</ul>" if texts else ""


def _summary(result):
    mine = [run for run in result["runs"] if run["method"] == EXACT]
    last = mine[-1]
    text = (
        f"{result['vertices']:,} places of {len(result['objects'])} objects were compared. The tightest run states an "
        f"error of {percent(result['floor'])} after {last['seconds']:.1f} s; the others are measured against it."
    )
    fair = [run for run in mine if run["measured"] and error_of(run) > result["floor"]]
    true = sum(run["stated"] >= error_of(run) for run in fair)
    return text + (f" The stated error covered the measured one in {true} of {len(fair)} runs." if fair else "")


def _slopes(result):
    told = []
    for method, rows in curves(result).items():
        rows = [row for row in rows if row[1] > result["floor"]]
        steep = slope([s for s, _, _ in rows], [e for _, e, _ in rows])
        if steep is not None:
            told.append(f"{method}: error goes as seconds to the power {steep:.2f}")
    return f"<figcaption>{escape('; '.join(told))}.</figcaption>" if told else ""


def _cell(run, key):
    if key in ("l2", "p95", "worst"):
        return run["measured"]["vertices"][key] if run["measured"] else None
    if key == "surfaces":
        return run["measured"].get("surfaces", {}).get("l2") if run["measured"] else None
    if key == "bias":
        noise = run.get("noise")
        return None if noise is None else math.sqrt(max(run["measured"]["vertices"]["l2"] ** 2 - noise**2, 0.0))
    return run.get(key)


def _table(result):
    used = [(key, name) for key, name in COLUMNS if any(_cell(run, key) not in (None, "") for run in result["runs"])]
    head = "".join(f'<th scope="col">{name}</th>' for _, name in used)
    rows = "".join(
        "<tr>" + "".join(f"<td>{escape(_text(key, _cell(run, key)))}</td>" for key, _ in used) + "</tr>"
        for run in result["runs"]
    )
    note = (
        "Errors are of the reflected light, relative to it: L2 over random places of all surfaces and over the baked "
        "vertices, the 95th percentile and the worst of these. Noise of Cycles is from two seeds; its bias is what is "
        "left, the mesh's facets instead of round balls above all. Peak MB is what a run took at the most "
        "beside what Blender held before it."
    )
    return (
        '<p class="soft hint">Scroll the table sideways for all its columns.</p><div class="scroll wide" tabindex="0" '
        f'role="region" aria-label="Table"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'
        f'<p class="soft">{note}</p>'
    )


def _text(key, value):
    if value is None:
        return ""
    if key in SHARES:
        return percent(value)
    if isinstance(value, str):
        return value
    return f"{value:,.0f}" if key not in ("seconds", "cpu_seconds") else f"{value:.2f}"


def _saved(result):
    return [
        f"{item['what']}, done all the same to {percent(item['target'])}: {item['seconds']:.2f} s instead of "
        f"{item['without']:.2f} s"
        for item in result.get("saved", [])
    ]


def _where(result):
    top = max((item["error"] for item in result["worst"]), default=0.0)
    if not top > 0:
        return ""
    rows = "".join(
        f"<tr><td>{escape(item['object'])}</td><td>{', '.join(f'{v:g}' for v in item['at'])}</td>"
        f'<td><span style="display:inline-block;width:1em;height:1em;background:{css(item["error"] / top)}"></span>'
        f" {percent(item['error'])}</td></tr>"
        for item in result["worst"]
    )
    return (
        f'{_map(result["map"], top)}<div class="ramp" style="background:linear-gradient(90deg,{css_stops()})"></div>'
        f'<div class="ends soft"><span>0 %</span><span>{percent(top)} of the mean light</span></div>'
        '<div class="scroll"><table><thead><tr><th scope="col">Object</th><th scope="col">Worst vertex, m</th>'
        f'<th scope="col">Estimated error</th></tr></thead><tbody>{rows}</tbody></table></div>'
        '<p class="soft">Estimated, of the tightest run: where the field is coarse and what it passes on.</p>'
    )


def _map(dots, top):
    """The places that face the eye as dots, coloured by their estimated errors; SVG, in hundredths."""
    if not dots:
        return ""
    high = max(up for _, up, _ in dots)
    body = "".join(
        f'<circle cx="{100 * across:.1f}" cy="{100 * (high - up):.1f}" r=".55" fill="{css(error / top)}"/>'
        for across, up, error in dots
    )
    label = "Places that face the eye, coloured by estimated error; the table below names the worst"
    return f'<svg class="map" viewBox="-1 -1 102 {100 * high + 2:.0f}" role="img" aria-label="{label}">{body}</svg>'


def _foretold(result):
    rows = [(t, s) for t, s in result["foretold"].items() if s is not None and float(t) < result["floor"]]
    return _items([f"{percent(float(target))}: about {seconds:.1f} s" for target, seconds in rows])


def _refused(result):
    return [f"{entry['name']!r} {entry['reason']}" for entry in result["refused"]]


def _about(result):
    about, settings = result["about"], result["settings"]
    return _items([
        f"PDM Radiosity {about['extension']}, Blender {about['blender']}, numpy {about['numpy']}, Python "
        f"{about['python']}",
        f"{about['machine']}, {about['cores']} cores, {about['system']}; {about['date']}",
        f"time limit {settings['time_limit']:g} s, {result['seconds']:.1f} s used",
    ])  # fmt: skip
