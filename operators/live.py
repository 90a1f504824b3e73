"""Live light: what a bake knows of the geometry, kept so that other light is written to its colours at once."""

import copy
from collections import Counter
from contextlib import contextmanager
from dataclasses import dataclass, field

import bpy
import numpy as np

from ..pdm_core.kept import Kept, under_light
from ..pdm_core.rays.solution import same_light
from ..pdm_core.signs_of_life import finish
from .baking.bake_points import each_of
from .baking.colour_attribute import BakeError, Colours
from .baking.error_map import names_written
from .baking.layer import blended
from .reading.materials import read_material
from .reading.node_values import Value
from .reading.read_lights import read_lights
from .reading.read_world import world_steps
from .reading.render_visible import evaluated, render_visible, world_of
from .reading.world_nodes import NotPlain, terms_of

AGAIN = "bake again to see it"
UNSEEN = {"CAMERA", "SPEAKER", "LIGHT_PROBE"}  # types of objects that are nothing to the light


@dataclass(eq=False)
class Held:
    """What the last bake left. kept: Kept of its points; lit: the Scene whose light the colours show; materials: as of
    a Reading; lamps: how many of the lights are Blender's, the others are suns of the world; objects [(name,
    BakePoints)]; shown: hash of what a render shows. stale: what has changed since, names of materials, 'LIGHT' and
    'WORLD'; problem: why the colours do not show it, or ''; seconds that the last change took."""

    scene: str
    settings: object  # BakeSettings
    kept: Kept
    lit: object
    materials: list
    lamps: int
    objects: list
    shown: int
    stale: set = field(default_factory=set)
    problem: str = ""
    seconds: float = 0.0


class _Live:
    """held: Held or None; dropped: why it is no more, or ''; is_own: whether changes are the add-on's own."""

    held, dropped, is_own = None, "", False

    def drop(self, reason=""):
        self.held, self.dropped = None, reason


live = _Live()


@contextmanager
def own_changes(context):
    """What changes within is no change of the user's."""
    before, live.is_own = live.is_own, True
    try:
        yield
        context.view_layer.update()
    finally:
        live.is_own = before


def hold(context, settings, reading, solved, targets, points, kept):
    """Keeps what a bake knows, its colours written; solved: its solution's Scene; kept: its Kept, None: nothing."""
    live.drop()
    if kept is None:
        return
    with own_changes(context):
        suns = sum(light.name.startswith("Sun of world") for light in solved.lights)
        live.held = Held(
            context.scene.name, settings, kept, solved, reading.materials, len(solved.lights) - suns,
            [(target.name, p) for target, p in zip(targets, points, strict=True)], shown_by(context.view_layer),
        )  # fmt: skip


def shown_by(view_layer):
    """hash of the names of what a render shows, instanced collections' objects too: a change of a collection may be
    anything."""
    visible = [obj for obj in render_visible(view_layer) if obj.type not in UNSEEN]
    made = [obj.instance_collection.all_objects for obj in visible if obj.instance_collection]
    return hash(tuple(obj.name for objects in (visible, *made) for obj in objects))


def relight(context):
    """Writes the colours under the light as it is now, if it has changed. BakeError, SceneError where it cannot."""
    held = live.held
    if held is None or not held.stale:
        return
    stale, held.stale = held.stale, set()
    materials = _materials(held, stale)
    background, lights = _background(context, held, stale)
    lamps = held.lit.lights[: held.lamps]
    if "LIGHT" in stale:
        with own_changes(context):
            lamps = _lamps(context, lamps)
    scene = under_light(held.lit, materials, background, [*lamps, *lights])
    radiant = held.settings.quantity == "RADIANCE"
    values = held.kept.radiance(scene) if radiant else held.kept.incident(scene)
    held.lit = scene
    with own_changes(context):
        _write(held, values * 2.0**held.settings.exposure)


def _materials(held, stale):
    """{surface: (reflectance, emission)} of materials that have changed."""
    baked, looks, found = frozenset(names_written(held.settings.attribute)), {}, {}
    for k, (name, side) in enumerate(held.materials):
        if name not in stale:
            continue
        if name not in looks:
            looks[name] = _look(name, baked)
        found[k] = looks[name].reflectance[side], looks[name].emission[side]
    return found


def _look(name, baked):
    material = next((m for m in bpy.data.materials if m.name_full == name), None)
    if material is None:
        raise BakeError(f"Material {name!r} was removed or renamed; {AGAIN}")
    look = read_material(material, baked)
    if look.absent or any(isinstance(value, Value) for value in (*look.reflectance, *look.emission)):
        raise BakeError(f"Material {name!r} {look.absent or 'varies from place to place'}; {AGAIN}")
    return look


def _background(context, held, stale):
    """The background and the world's suns."""
    suns = held.lit.lights[held.lamps :]
    if "WORLD" not in stale:
        return held.lit.sky or held.lit.background, suns
    world = world_of(context.scene, context.view_layer)
    try:
        if world is not None and world.node_tree is not None:
            terms_of(world.node_tree, [])
    except NotPlain as reason:
        raise BakeError(f"{reason} of the world takes long to read; {AGAIN}") from None
    found = finish(world_steps(world))
    return found.background, _same_lights(suns, found.suns)


def _lamps(context, old):
    """The lights of the scene's lamps, those that have gone dark too."""
    visible = render_visible(context.view_layer)
    with evaluated(context, visible) as depsgraph:
        return _same_lights(old, read_lights(visible, depsgraph).lights)


def _same_lights(old, new):
    """[Light] in the order of the old ones, which they are but for their colour; those that are gone are dark."""
    left, out, number = {}, [], Counter()
    for light in new:
        left[light.name, number[light.name]] = light
        number[light.name] += 1
    number.clear()
    for light in old:
        found = left.pop((light.name, number[light.name]), None)
        number[light.name] += 1
        if found is None:
            found = copy.copy(light)
            found.colour = np.zeros(3)
        elif not same_light(light, found):
            raise BakeError(f"Light {light.name!r} has another shape; {AGAIN}")
        out.append(found)
    if left:
        raise BakeError(f"Light {next(iter(left))[0]!r} shines now and did not; {AGAIN}")
    return out


def _write(held, values):
    """values (n, 3) of all objects in turn."""
    each = each_of(values, [points for _, points in held.objects])
    for (name, points), value in zip(held.objects, each, strict=True):
        obj = bpy.data.objects.get((name, None))
        attribute = obj and obj.data.color_attributes.get(held.settings.attribute)
        if not attribute or len(attribute.data) != points.size:
            raise BakeError(f"Object {name!r} has lost its colours; {AGAIN}")
        item = blended(held.settings, Colours(name, points.domain, points.colours(value)))
        attribute.data.foreach_set("color", item.colours.ravel())
        obj.data.update()
