"""`bpy.ops.pdm.convergence` and the button that opens its page."""

import json
import os
import tempfile
import webbrowser
from pathlib import Path

import bpy
from bpy.props import BoolProperty, FloatProperty, StringProperty
from bpy.types import Operator

from .modal_steps import Steps, current
from .reporting.convergence import ConvergenceSettings, convergence_steps
from .reporting.convergence_page import csv_text, curves, page, text_rows
from .settings import BakeProperties
from .whole_file import whole_file
from .words import say

OBJECTS = BakeProperties.__annotations__["objects"]


class ConvergenceProperties:
    """Mixed into whatever holds the settings of a convergence run."""

    objects: OBJECTS
    time_limit: FloatProperty(
        name="Time Limit", description="Seconds that the runs may take in all: sizes the ladder of targets",
        default=60.0, min=1.0, soft_max=600.0, step=100,
    )  # fmt: skip
    tightest: FloatProperty(
        name="Tightest Target", description="The last target, where time allows it: the others are measured against it",
        default=0.0025, min=1e-5, max=0.1, precision=4, step=0.1,
    )  # fmt: skip
    published: BoolProperty(
        name="Published Method", description="Also run plain PDM radiosity at growing patches and points", default=True
    )
    cycles: BoolProperty(
        name="Cycles", description="Also bake a copy with Cycles at growing samples, in a second Blender", default=False
    )


NAMES = tuple(ConvergenceProperties.__annotations__)


class PDM_OT_convergence(ConvergenceProperties, Steps, Operator):
    """Solve this scene to ever tighter targets and show what each second buys. Nothing in the scene is changed"""

    bl_idname = "pdm.convergence"
    bl_label = "Error Against Time"
    bl_options = {"REGISTER"}

    folder: StringProperty(
        name="Folder", subtype="DIR_PATH",
        description="Where the page, JSON and CSV are written; empty: a new temporary folder",
    )  # fmt: skip
    cut_short = False

    def make_steps(self, context):
        settings = ConvergenceSettings(**{name: getattr(self, name) for name in NAMES})
        return convergence_steps(context, settings, lambda: self.cut_short)

    def stopped(self, context):
        """The first Esc keeps what is done, the second keeps nothing."""
        if self.cut_short:
            return super().stopped(context)
        self.cut_short = True
        return {"RUNNING_MODAL"}

    def done(self, context, result):
        paths = write(result, bpy.path.abspath(self.folder) if self.folder else tempfile.mkdtemp(prefix="pdm-"))
        context.scene.pdm_radiosity.last_convergence = json.dumps({
            "rows": text_rows(result), "page": str(paths["html"]), "said": result["said"], "floor": result["floor"],
            "curves": [[row[:2] for row in rows] for rows in curves(result).values()],
        })  # fmt: skip
        self.report(
            {"INFO"}, say("{} runs in {} s: {}", len(result["runs"]), f"{result['seconds']:.0f}", paths["html"])
        )
        return {"FINISHED"}


class PDM_OT_convergence_page(Operator):
    """Open the page of the last run in the browser"""

    bl_idname = "pdm.convergence_page"
    bl_label = "Open the Page"

    @classmethod
    def poll(cls, context):
        last = context.scene.pdm_radiosity.convergence()
        if last is None or not os.path.exists(last["page"]):
            cls.poll_message_set("The page is gone; run Error Against Time again")
            return False
        return current.stage is None

    def execute(self, context):
        webbrowser.open(Path(context.scene.pdm_radiosity.convergence()["page"]).as_uri())
        return {"FINISHED"}


def write(result, folder):
    """Writes convergence.html, .json and .csv, each whole or not at all -> {kind: path}."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    paths = {}
    for kind, text in (("html", page(result)), ("json", json.dumps(result, indent=1)), ("csv", csv_text(result))):
        paths[kind] = folder / f"convergence.{kind}"
        with whole_file(paths[kind]) as part:
            Path(part).write_text(text, encoding="utf-8")
    return paths
