"""Materials, and what the nodes of lights and worlds emit, as diffuse reflectance and emission, by their nodes.

Cycles calls the side that a mesh's normals face the front, under mirroring object matrices too.
"""

from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from ...pdm_core.scene import MAX_REFLECTANCE
from . import node_colour, node_images, node_math, node_patterns, node_places, shaders
from .node_values import Value, constant, evaluate
from .node_walk import Circle, Socket, Walk
from .shaders import BLACK, NOT_LIGHT, Light
from .varying import Places, Varying

NO_MATERIAL = 0.8  # the grey that Blender gives an object without material
CLEAR = 0.5  # of the light: what lets more than that straight through is nearer to nothing than to a wall
FRONT, BACK = 0, 1
EVERYWHERE = node_math.READERS | node_colour.READERS | shaders.READERS
ON_MESHES = EVERYWHERE | node_places.READERS | node_images.READERS | node_patterns.READERS
IN_WORLDS = EVERYWHERE | {"ShaderNodeLightPath": node_places.READERS["ShaderNodeLightPath"]}


@dataclass(frozen=True, eq=False)
class Appearance:
    """reflectance of front and back, at most MAX_REFLECTANCE, and emission of both as radiance: each (3,), or where it
    varies a Value, and a Varying once it is on a mesh; warnings: sentences that go on after the material's name.

    absent: why it is no surface at all, or ''. is_picture: emits an image and nothing else, at a strength of 1 at most.
    """

    reflectance: tuple
    emission: tuple
    warnings: list = field(default_factory=list)
    absent: str = ""
    is_picture: bool = False

    @property
    def needs(self):
        """{(kind, name)} of what it reads at a place."""
        return frozenset().union(*(side.needs for side in (*self.reflectance, *self.emission) if _varies(side)))

    @property
    def shines(self):
        return any(_varies(side) or callable(side) or (side > 0).any() for side in self.emission)

    def on(self, faces):
        """The same on the Faces of a mesh: what varies becomes a function of points in the world."""

        def on(side, most):
            if not _varies(side):
                return side
            if all(kind == "object" for kind, _ in side.needs):
                return np.clip(evaluate(side, Places(faces, np.zeros((1, 3))))[0], 0.0, most)
            return Varying(side, faces)

        return replace(
            self,
            reflectance=tuple(on(side, MAX_REFLECTANCE) for side in self.reflectance),
            emission=tuple(on(side, np.inf) for side in self.emission),
        )


def _varies(side):
    return isinstance(side, Value)


def read_material(material, baked=frozenset(), images=None):
    """The Appearance of a Material, or of None for an object without one. baked: names of colour attributes that hold
    bakes: emission by them is not light. images: a dict kept over all materials, so that each image is read once."""
    if material is None or not _uses_nodes(material):
        colour = np.full(3, NO_MATERIAL) if material is None else np.array(material.diffuse_color[:3], float)
        return _appearance([Light(constant(colour))] * 2, [])
    output = material.node_tree.get_output_node("CYCLES")
    notes, images = [], {} if images is None else images
    walk = Walk(material.node_tree, ON_MESHES, FRONT, baked, images)
    if output and _is_fed(walk, output, "Volume") and not _is_fed(walk, output, "Surface"):
        return replace(_appearance([Light()] * 2, []), absent="has only a volume shader")
    sides = [_surface(output, walk)] * 2
    if walk.has_sides:
        sides[BACK] = _surface(output, Walk(material.node_tree, ON_MESHES, BACK, baked, images))
    for name in ("Volume", "Displacement"):
        if output and _is_fed(walk, output, name):
            notes.append(f"it has {name.lower()}: that is left out")
    return _appearance(sides, notes)


def _appearance(sides, notes):
    """The Appearance of the Lights of both sides, and of what else is to be said."""
    clear = min(_clear(side) for side in sides)
    if clear > CLEAR:
        share = "is wholly transparent" if clear >= 1 else f"lets {100 * clear:.0f} % of the light straight through"
        return Appearance((np.zeros(3),) * 2, (np.zeros(3),) * 2, [], share)
    warnings = [note for side in sides for note in side.notes] + notes
    constants = [v.constant for side in sides for v in (side.reflected, side.emitted) if not v.varies]
    high = max((side.reflected.constant.max() for side in sides if not side.reflected.varies), default=0.0)
    if any((array < 0).any() for array in constants):
        warnings.append("it has colours below 0: they are taken as 0")
    if high > MAX_REFLECTANCE:
        warnings.append(f"it reflects {high:.4g} of the light: that is limited to {MAX_REFLECTANCE}")
    return Appearance(
        tuple(_within(side.reflected, MAX_REFLECTANCE) for side in sides),
        tuple(_within(side.emitted, np.inf) for side in sides),
        list(dict.fromkeys(warnings)),
        is_picture=_is_picture(sides),
    )


def _is_picture(sides):
    """Whether it shows an image by its own light alone, on either side, and reflects nothing."""
    shows = any(side.emitted.varies for side in sides)
    return shows and not any(side.is_lamp or not _is_black(side.reflected) for side in sides)


def _clear(side):
    """The share that a Light lets straight through, 0 where it varies or something shines."""
    return 0.0 if side.clear.varies or not _is_black(side.emitted) else float(side.clear.constant.min())


def _is_black(value):
    return not value.varies and not value.constant.any()


def _within(value, most):
    return value if value.varies else np.clip(np.broadcast_to(value.constant[0], 3), 0.0, most)


def node_emission(data):
    """(what the nodes of a light or world emit (3,), or None where it uses none; warnings), by their plain values."""
    if not _uses_nodes(data):
        return None, []
    output = data.node_tree.get_output_node("CYCLES")
    walk = Walk(data.node_tree, IN_WORLDS)
    light = _surface(output, walk)
    has_volume = output and "Volume" in output.inputs and _is_fed(walk, output, "Volume")
    notes = ["it has a volume: that is left out"] if has_volume else []
    return np.broadcast_to(light.emitted.constant[0], 3), [*light.notes, *notes]


def _uses_nodes(data):
    if data.node_tree is None:
        return False
    # materials and worlds always have nodes from 5.0 on, lights later, and asking is deprecated where they do
    always = bpy.app.version >= (5, 0) and not isinstance(data, bpy.types.Light)
    return always or getattr(data.bl_rna.properties["use_nodes"], "is_deprecated", False) or data.use_nodes


def _is_fed(walk, output, name):
    try:
        return walk.is_linked(Socket((), output.inputs[name]))
    except Circle:
        return False


def _surface(output, walk):
    """The Light of the side that is walked for."""
    if output is None or not _is_fed(walk, output, "Surface"):
        return Light(BLACK.noted("it has no surface shader: it is taken as black; link one to its output"))
    try:
        light = walk.read(walk.source(Socket((), output.inputs["Surface"]))[0])
    except Circle:
        return Light(BLACK.noted("its nodes are linked in a circle: it is taken as black; remove one of the links"))
    if not isinstance(light, Light):  # a colour linked into a shader's socket shines, as in Cycles
        return Light(emitted=light, is_lamp=True) if isinstance(light, Value) else Light()
    if _is_black(light.reflected) and any(NOT_LIGHT in note for note in light.notes):
        grey = constant(np.full(3, NO_MATERIAL))
        return replace(light, reflected=grey.noted(*light.notes, "nothing tells what it reflects: grey is taken"))
    return light
