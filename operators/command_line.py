"""`blender -b scene.blend --command pdm bake ...`, and main() for a script that only has the bpy wheel."""

import argparse
import json
import math
import os
import sys
import time

import bpy

from ..pdm_core import SceneError
from ..pdm_core.signs_of_life import finish
from . import farm
from .baking.again import last
from .baking.bake import BakeSettings, bake_steps
from .baking.colour_attribute import BakeError
from .baking.report import counted, one_line, percent, version
from .convergence_operator import NAMES as CONVERGENCE_NAMES
from .convergence_operator import ConvergenceProperties, write
from .edit_mode import object_mode
from .reporting.convergence import ConvergenceSettings, convergence_steps
from .reporting.convergence_page import text_rows
from .reporting.render_image import render_image
from .settings import SETTING_NAMES, BakeProperties, settings_of
from .subdivide import BUDGET, WAYS, subdivide_steps, tell_short
from .told_to_end import told_to_end
from .whole_file import whole_file

DONE, FAILED, USAGE, INTERRUPTED = 0, 1, 2, 130
PNG_END = b"IEND\xaeB`\x82"
SUBDIVISIONS = 3  # the error between vertices falls more slowly than foreseen behind edges of shadows
PROGRESS_SECONDS = 0.5  # between two lines on stderr

_commands = []


def register():
    _commands.append(bpy.utils.register_cli_command("pdm", main))


def unregister():
    while _commands:
        bpy.utils.unregister_cli_command(_commands.pop())


def main(argv):
    """argv: the words after `pdm`. Works on the file that is open. Returns DONE, FAILED, USAGE or INTERRUPTED."""
    try:
        options = _parse(argv)
    except SystemExit as stop:
        return USAGE if stop.code else DONE
    many = getattr(options, "files", None)
    if not many and not os.path.isfile(bpy.data.filepath):
        return _fail("no .blend file was loaded; name one that exists before --command", FAILED)
    try:
        with told_to_end():
            return options.work(options) or DONE
    except KeyboardInterrupt:
        return _fail("stopped; run it again for the rest" if many else "stopped, nothing was written", INTERRUPTED)
    except (BakeError, SceneError, OSError, RuntimeError) as error:
        return _fail(error, FAILED)


def _bake_files(options):
    os.makedirs(options.folder, exist_ok=True)
    summary = farm.run(options.files, options.folder, _words(options), options.processes)
    print(farm.one_line(summary))
    return FAILED if summary["failed"] else DONE


def _words(options):
    """The settings of a bake as the command line has them."""
    words = [] if options.objects == "ALL" else ["--objects", *options.objects]
    for name in SETTING_NAMES:
        option, value = f"--{name.replace('_', '-')}", getattr(options, name)
        if isinstance(value, bool):
            words += [option] * value
        elif name == "passes":
            words += [option, *value] if value else []
        elif name != "objects":
            words.append(f"{option}={value}")
    if options.subdivide:
        words += [f"--subdivide={options.subdivide}", f"--subdivide-method={options.subdivide_method}"]
    return words


def _bake(options):
    context = bpy.context
    settings = BakeSettings(**settings_of(options))
    with object_mode(context):
        report = finish(bake_steps(context, settings, last=last if options.subdivide else None), _Progress())
        for _ in range(SUBDIVISIONS if options.subdivide else 0):
            steps = subdivide_steps(context, options.subdivide_method, options.subdivide)
            count, added, short = finish(steps, _Progress())
            if count:
                print(f"pdm: {counted(count, 'mesh', 'meshes')} subdivided, {added:,} vertices more", file=sys.stderr)
                report = finish(bake_steps(context, settings, last=last), _Progress())
            if short:
                report["warnings"].append(tell_short(context.scene, short))
            if short or not count:
                break
    if options.image:
        with whole_file(options.image) as part:
            render_image(context, settings.attribute, part)
            _check_picture(part)
    if options.report:
        with whole_file(options.report) as part, open(part, "w", encoding="utf-8") as file:
            json.dump(report, file, indent=1, allow_nan=False)
    if options.output:
        bpy.ops.wm.save_as_mainfile(filepath=os.path.abspath(options.output), copy=True)
    for entry in report["refused"]:
        print(f"pdm: refused: {entry['name']!r} {entry['reason']}", file=sys.stderr)
    for warning in report["warnings"]:
        print(f"pdm: warning: {warning}", file=sys.stderr)
    print(one_line(report))


def _converge(options):
    settings = ConvergenceSettings(**{name: getattr(options, name) for name in CONVERGENCE_NAMES})
    with object_mode(bpy.context):
        result = finish(convergence_steps(bpy.context, settings), _Progress())
    paths = write(result, options.folder)
    for text in result["said"] + result["warnings"]:
        print(f"pdm: {text}", file=sys.stderr)
    for row in text_rows(result):
        print("{:17} {:24} {:>9} {:>9}".format(*row))
    print(paths["html"])


def _check_picture(path):
    """Raises OSError where the PNG is not whole: Blender does not say that a disk is full."""
    end = b""
    if os.path.isfile(path):
        with open(path, "rb") as file:
            end = file.read()[-len(PNG_END) :]
    if end != PNG_END:
        raise OSError("the picture could not be written whole; is the disk full?")


class _Progress:
    """Lines on stderr, at most a few a second and only where something changed; what is done of a stage never falls,
    as the error does that is known at first."""

    def __init__(self):
        self.stage, self.line, self.next, self.most = "", "", 0.0, 0.0

    def __call__(self, stage):
        for text in stage.said:
            print(f"pdm: warning: {text}", file=sys.stderr, flush=True)
        now = time.perf_counter()
        self.most = max(stage.fraction, self.most if stage.text == self.stage else 0.0)
        line = f"pdm: {stage.text} {100 * self.most:3.0f} %, error {percent(stage.error)}"
        if line != self.line and (stage.text != self.stage or now >= self.next):
            self.stage, self.line, self.next = stage.text, line, now + PROGRESS_SECONDS
            print(line, file=sys.stderr, flush=True)


def _fail(error, code):
    print(f"pdm: error: {error}", file=sys.stderr)
    return code


def _parse(argv):
    """The options, checked before any work; SystemExit as argparse raises it."""
    options = _parser().parse_args(argv)
    if options.objects != "ALL":
        options.objects = tuple(options.objects)
    if options.command == "convergence":
        return options
    paths = [path for path in (options.output, options.report, options.image) if path]
    if options.files:
        _check_files(options, paths)
        options.work = _bake_files
        return options
    if options.folder:
        options.usage_error("--folder goes with --files")
    if not paths:
        options.usage_error("nothing would be written; give --output, --report, --image or --files")
    for path in paths:
        folder = os.path.dirname(os.path.abspath(path))
        if not os.path.isdir(folder):
            options.usage_error(f"the folder {folder} does not exist; make it first")
        if os.path.isdir(path):
            options.usage_error(f"{path} is a folder; name a file in it")
    if bpy.data.filepath:
        paths = [path for path in (options.report, options.image, bpy.data.filepath, options.output) if path]
        if options.output and os.path.realpath(options.output) == os.path.realpath(bpy.data.filepath):
            paths.pop()  # the file itself may be meant
    real = [os.path.realpath(path) for path in paths]
    for path in (options.report, options.image):
        if path and real.count(os.path.realpath(path)) > 1:
            options.usage_error(f"{path} is named twice or is the file itself; choose another name")
    return options


def _check_files(options, paths):
    if paths or not options.folder:
        options.usage_error("--files writes into --folder, which must be given; --output, --report, --image must not")
    if both := farm.clash(options.files):
        options.usage_error(f"{both[0]} and {both[1]} would have results of one name; use two folders")


def _parser():
    parser = argparse.ArgumentParser(
        prog="blender -b SCENE.blend --command pdm",
        description=f"PDM Radiosity {version()}: diffuse light, baked into vertex colours to a stated error.",
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    _add_convergence(commands)
    _add_bake(commands)
    return parser


def _add_bake(commands):
    bake = commands.add_parser(
        "bake",
        help="bake the loaded file",
        description="Bakes the loaded file's scene. The file itself changes only if --output names it.",
        epilog="Exit code: 0 done, 1 failed, 2 wrong usage, 130 stopped by Ctrl-C. Progress goes to stderr.",
    )
    _add_settings(bake, BakeProperties, BakeSettings)
    _add_outputs(bake)
    _add_files(bake)
    bake.set_defaults(usage_error=bake.error, work=_bake)


def _add_settings(parser, properties, settings):
    """An option for each setting, as the sidebar has it."""
    for name, each in properties.__annotations__.items():
        words, default, option = each.keywords, getattr(settings, name), f"--{name.replace('_', '-')}"
        told = words["description"].replace("%", "%%") + (f"; default {default}" if default else "")
        more = {"default": default, "help": told}
        if name == "objects":
            more |= {"nargs": "+", "metavar": "NAME", "help": "only these; all light"}
        elif isinstance(default, bool):
            more |= {"action": "store_false" if default else "store_true", "dest": name}
            option = f"--no-{name}" if default else option  # what is on unless told
        elif isinstance(default, float):
            more |= {"type": _number(words["min"], words.get("max", float("inf"))), "metavar": "NUMBER"}
        elif "items" in words:
            more |= {"choices": [item[0] for item in words["items"]]}
            more |= {"nargs": "+"} if isinstance(default, tuple) else {"type": str.upper}
        else:
            more |= {"metavar": "NAME"}
        parser.add_argument(option, **more)


def _add_outputs(bake):
    bake.add_argument("--output", type=_ending(".blend"), metavar="FILE.blend", help="save the baked file here")
    bake.add_argument("--report", metavar="FILE.json", help="write the report here")
    bake.add_argument("--image", type=_ending(".png"), metavar="FILE.png", help="render the baked scene (Cycles, CPU)")
    bake.add_argument(
        "--subdivide", type=_count, nargs="?", const=BUDGET, metavar="MOST",
        help=f"subdivide meshes that are too coarse for the target, up to MOST vertices in all, default {BUDGET}",
    )  # fmt: skip
    bake.add_argument(
        "--subdivide-method", type=str.upper, choices=[way[0] for way in WAYS], default=WAYS[0][0],
        help=f"with --subdivide: where the vertices go, default {WAYS[0][0]}",
    )  # fmt: skip


def _add_files(bake):
    bake.add_argument(
        "--files", nargs="+", type=_ending(".blend"), metavar="FILE.blend",
        help="bake these instead, each in a Blender of its own; what --folder has already is not done again",
    )  # fmt: skip
    bake.add_argument("--folder", metavar="FOLDER", help="with --files: NAME.blend, NAME.json and summary.json go here")
    bake.add_argument(
        "--processes", type=_count, default=os.cpu_count() or 1, metavar="N",
        help="with --files: how many at a time, default one a core",
    )  # fmt: skip


def _add_convergence(commands):
    converge = commands.add_parser(
        "convergence",
        help="error against run time of the loaded file",
        description="Solves the loaded file's scene to ever tighter targets and writes convergence.html, .json and "
        ".csv. The file itself never changes.",
        epilog="Exit code: 0 done, 1 failed, 2 wrong usage, 130 stopped by Ctrl-C. Progress goes to stderr.",
    )
    converge.add_argument("folder", metavar="FOLDER", help="where the page and its data go; made if missing")
    _add_settings(converge, ConvergenceProperties, ConvergenceSettings)
    converge.set_defaults(work=_converge)


def _number(low, high):
    def number(text):
        value = float(text)
        if not (low <= value <= high and math.isfinite(value)):
            raise argparse.ArgumentTypeError(f"{text} is not between {low} and {high}")
        return value

    return number


def _count(text):
    if not text.isdecimal() or int(text) < 1:
        raise argparse.ArgumentTypeError(f"{text} is no whole number from 1 on")
    return int(text)


def _ending(suffix):
    def path(text):
        if not text.lower().endswith(suffix):
            raise argparse.ArgumentTypeError(f"{text!r} must end in {suffix}")
        return text

    return path
