"""The settings of a bake: one definition for the operator, the sidebar and the command line."""

import json

from bpy.props import (
    BoolProperty,
    CollectionProperty,
    EnumProperty,
    FloatProperty,
    IntProperty,
    StringProperty,
)
from bpy.types import PropertyGroup

from .listed import PDM_PG_listed, fill, select_listed


class BakeProperties:
    """Mixed into whatever holds the settings."""

    objects: EnumProperty(
        name="Objects",
        description="Which objects receive colours. Every recognised object lights the others either way",
        items=[
            ("ALL", "All", "Every recognised object"),
            ("SELECTED", "Selected", "The recognised objects among those selected"),
        ],
        default="ALL",
    )
    target_error: FloatProperty(
        name="Target Error",
        description=(
            "Relative error of the indirect and direct light at which the solver stops: 0.01 is 1 % of the mean, "
            "halving it costs about twice the time"
        ),
        default=0.01,
        min=1e-6,
        max=1.0,
        soft_min=1e-3,
        soft_max=0.1,
        precision=5,
        step=0.1,
    )
    time_limit: FloatProperty(
        name="Time Limit",
        description=(
            "Seconds of reading and solving, then the best result so far is baked with its estimated error. "
            "0 sets no limit"
        ),
        min=0.0,
        soft_max=600.0,
        step=100,
    )
    attribute: StringProperty(
        name="Attribute",
        description="Name of the colour attribute to write. One of the same name is replaced, no other is touched",
        default="Radiosity",
    )
    quantity: EnumProperty(
        name="Quantity",
        description="What the colours mean",
        items=[
            ("RADIANCE", "Radiance", "What a camera sees: emission and reflected light, with the surface's own colour"),
            (
                "IRRADIANCE",
                "Irradiance",
                "Arriving light (irradiance / pi), without the surface's own colour and emission: multiply it by a "
                "texture",
            ),
        ],
        default="RADIANCE",
    )
    domain: EnumProperty(
        name="Domain",
        description="Where the colours are stored",
        items=[
            ("AUTO", "Automatic", "Per point where one smooth surface covers the object, else per face corner"),
            ("POINT", "Point", "One colour a vertex; where surfaces meet in an edge, their mean"),
            ("CORNER", "Face Corner", "One colour a face corner: hard edges stay hard"),
        ],
        default="AUTO",
    )
    data_type: EnumProperty(
        name="Data Type",
        description="How the colours are stored",
        items=[
            ("FLOAT_COLOR", "Color", "Linear floating point, any brightness"),
            ("BYTE_COLOR", "Byte Color", "8 bits a channel, values above 1 are clipped (and counted)"),
        ],
        default="FLOAT_COLOR",
    )
    exposure: FloatProperty(
        name="Exposure",
        description="Stops: the colours are multiplied by 2 to the power of this. 0 keeps the physical values",
        min=-32.0,
        max=32.0,
        soft_min=-10.0,
        soft_max=10.0,
        step=10,
    )
    blend: EnumProperty(
        name="Blend",
        description="What becomes of a colour layer that the meshes have already",
        items=[
            ("REPLACE", "None", "The light alone"),
            ("MULTIPLY", "Multiply into", "The layer times the light. The layer stays, Attribute gets the result"),
            ("ADD", "Add to", "The layer and the light. The layer stays, Attribute gets the result"),
        ],
        default="REPLACE",
    )
    layer: StringProperty(
        name="Layer",
        description="Name of the colour layer that the light is multiplied into or added to. It stays as it is",
    )
    heat_map: BoolProperty(
        name="Error Map",
        description=(
            "Also write a second attribute, its name followed by Error: each vertex's estimated error as a colour, "
            "from violet, none, to yellow, the largest"
        ),
    )
    passes: EnumProperty(
        name="Passes",
        description="Also write these, as attributes of the same name followed by the pass's",
        items=[
            ("DIRECT", "Direct", "Light straight from lamps, emission and the world"),
            ("INDIRECT", "Indirect", "Light by way of reflections: with Direct and the own emission all there is"),
            ("SKY", "Sky", "The share of the sky that is seen, weighted by the cosine: 1 in the open"),
            ("AO", "AO", "Ambient occlusion: the same share of where nothing is within the distance"),
        ],
        options={"ENUM_FLAG"},
        default=set(),
    )
    ao_distance: FloatProperty(
        name="AO Distance",
        description="How far ambient occlusion looks",
        default=1.0,
        min=1e-6,
        soft_max=100.0,
        unit="LENGTH",
    )
    make_single_user: BoolProperty(
        name="Make Single User",
        description=(
            "Objects that share a mesh are each baked on a copy of their own. Otherwise the first one's bake is all's"
        ),
    )
    apply_modifiers: BoolProperty(
        name="Apply Modifiers",
        description=(
            "Modifiers that add, remove or join vertices or faces are applied, and the result is baked. "
            "Otherwise such an object takes part in the light and is not baked"
        ),
    )


SETTING_NAMES = tuple(BakeProperties.__annotations__)

PRESETS = {"DRAFT": 0.05, "GOOD": 0.01, "FINE": 0.0025}  # target errors
CUSTOM = len(PRESETS)


def settings_of(holder):
    """{name: value} of whatever holds the settings."""
    return {name: getattr(holder, name) for name in SETTING_NAMES}


def _preset(self):
    """The number of the preset that the target error is, unless another was asked for."""
    numbers = [k for k, error in enumerate(PRESETS.values()) if abs(self.target_error - error) < 1e-6 * error]
    return CUSTOM if self.custom_target or not numbers else numbers[0]


def _set_preset(self, number):
    self.custom_target = number == CUSTOM
    if number < CUSTOM:
        self.target_error = list(PRESETS.values())[number]


def _switch_live(self, context):
    from .live import live  # with it above, 4.2 crashes at exit: modules are taken down in another order

    if not self.live:
        live.drop()


class PDM_PG_scene(BakeProperties, PropertyGroup):
    """`scene.pdm_radiosity`: the sidebar's settings, and what was last found and done, saved with the file."""

    preset: EnumProperty(
        name="Target Error",
        description="How far off the light may be, relative to its mean",
        items=[
            ("DRAFT", "Draft 5 %", "To place lights by"),
            ("GOOD", "Good 1 %", "Hardly to be told from exact by eye"),
            ("FINE", "Fine .25 %", "Exact to the eye in flat gradients too"),
            ("CUSTOM", "Custom", "Any other target error"),
        ],
        get=_preset,
        set=_set_preset,
    )
    custom_target: BoolProperty(options={"HIDDEN"})
    show_after_bake: BoolProperty(
        name="Show When Done",
        description="After a bake by the button, switch the 3D views of the screen to the baked colours",
        default=True,
    )
    live: BoolProperty(
        name="Live",
        description=(
            "Keep what the next bake finds out about the geometry in memory: then a new colour, emission, light or "
            "world strength is in the colours at once, until something moves"
        ),
        update=_switch_live,
    )
    last_report: StringProperty(
        name="Last Report",
        description="The report of the last bake of this scene as JSON, the same as --report writes",
    )
    last_scan: StringProperty(
        name="Last Scan",
        description="The objects recognised and refused in this scene when last looked at, as JSON",
    )
    last_convergence: StringProperty(
        name="Last Convergence",
        description="The last run of Error Against Time of this scene as JSON: its rows and where its page is",
    )
    listed: CollectionProperty(type=PDM_PG_listed)
    listed_index: IntProperty(update=select_listed)

    def keep(self, report):
        """Stores a bake's report, which is also the latest scan; its warnings stand in the report."""
        self.last_report = json.dumps(report)
        found = {key: report[key] for key in ("objects", "refused", "hidden", "lights", "shining")}
        self.keep_scan({**found, "warnings": []})

    def keep_scan(self, scan):
        """Stores what was found in the scene, and lists it; nothing is touched where it is as before."""
        text = json.dumps(scan)
        fill(self.listed, scan, self.report())
        if text != self.last_scan:
            self.last_scan = text

    def report(self):
        """The last bake's report as a dict, or None."""
        return json.loads(self.last_report) if self.last_report else None

    def convergence(self):
        """The last run of Error Against Time as a dict with `rows`, `curves`, `floor`, `page`, `said`, or None."""
        return json.loads(self.last_convergence) if self.last_convergence else None

    def scan(self):
        """The last scan as a dict with `objects`, `refused`, `hidden`, `lights` and `warnings`, or None."""
        return json.loads(self.last_scan) if self.last_scan else None
