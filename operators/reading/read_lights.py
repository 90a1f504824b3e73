"""Blender's lights as those of pdm_core, in Cycles' units; what of them is left out is said."""

from dataclasses import dataclass, field

import numpy as np

from ...pdm_core import AreaLight, PointLight, SceneError, SpotLight, SunLight
from .light_linking import linking_of
from .materials import node_emission

LEAST_SPREAD = 1e-3  # radians; Blender's 0 are parallel beams
MANY_BOUNCES = 16  # after which what is left of a light is not missed


@dataclass(eq=False)
class ReadLights:
    """lights: [Light], all that shine; kinds: Blender's type of each; links: what each is linked to, see linking_of;
    told: {sentence: [names]}, which goes on after the names of the lights that it is about."""

    lights: list = field(default_factory=list)
    kinds: list = field(default_factory=list)
    links: list = field(default_factory=list)
    told: dict = field(default_factory=dict)

    def tell(self, name, text):
        self.told.setdefault(text, []).append(name)


def read_lights(visible, depsgraph):
    """The ReadLights of render-visible objects, and of what their instancers make."""
    found = ReadLights()
    for obj in visible:
        if obj.type == "LIGHT":
            shown = obj.evaluated_get(depsgraph)
            _read(found, obj.name, shown, np.array(shown.matrix_world, float))
    instancers = set(visible)
    for instance in depsgraph.object_instances:
        if instance.is_instance and instance.object.type == "LIGHT" and instance.parent.original in instancers:
            name = f"{instance.object.name} ({instance.parent.name})"
            _read(found, name, instance.object, np.array(instance.matrix_world, float))
    return found


def _read(found, name, obj, matrix):
    """Adds the light of an evaluated object, at matrix (4, 4), if it shines."""
    data = obj.data
    if data.type == "AREA" and data.cycles.is_portal:  # guides Cycles' rays, and sends nothing
        return
    if not obj.visible_diffuse:
        found.tell(name, "is not visible to diffuse rays: it lights nothing; switch Ray Visibility > Diffuse on")
        return
    strength = _strength(found, name, data)
    if strength is None:
        return
    if data.cycles.max_bounces < MANY_BOUNCES:
        found.tell(name, f"is limited to {data.cycles.max_bounces} bounces: its light goes on beyond them")
    try:
        light = _LIGHTS[data.type](data, matrix, strength, shadows=data.use_shadow, name=name)
    except SceneError as error:
        what, _, advice = str(error).partition(": ")[2].partition("; ")
        found.tell(name, f"cannot shine, {what}: it is left out; {advice}")
        return
    found.lights.append(light)
    found.kinds.append(data.type)
    found.links.append(linking_of(obj))


def _strength(found, name, data):
    """(3,) Blender's power, or the sun's strength, times its colours and nodes; None where it sends nothing."""
    nodes, texts = node_emission(data)
    for text in texts:
        found.tell(name, text)
    strength = data.energy * 2.0 ** getattr(data, "exposure", 0.0) * np.array(data.color, float)
    if getattr(data, "use_temperature", False):
        strength *= data.temperature_color
    if nodes is not None:
        strength *= nodes
    if (strength < 0).any():
        found.tell(name, "takes light away: that is left out; use a strength above 0")
        strength = np.maximum(strength, 0.0)
    elif not strength.any():
        found.tell(name, "has no strength: it lights nothing; raise it above 0")
    return strength if strength.any() else None


def _is_normalised(data):
    return getattr(data, "normalize", True)  # 4.2 has no choice


def _point(data, matrix, strength, **rest):
    return PointLight(matrix[:3, 3], **_bulb(data, strength), **rest)


def _spot(data, matrix, strength, **rest):
    axes = matrix[:3, :3]
    bulb = _bulb(data, strength)
    return SpotLight(matrix[:3, 3], -axes[:, 2], angle=data.spot_size, blend=data.spot_blend, axes=axes, **bulb, **rest)


def _bulb(data, strength):
    """Arguments of a point or spot: their radius is in metres, whatever the object's scale."""
    radius = data.shadow_soft_size
    if not _is_normalised(data):  # then it is a ball's radiance times pi, and a point's intensity
        strength = strength * (4 * np.pi * radius**2 if radius > 0 else 4.0)
    return {"power": strength, "radius": radius, "faces": getattr(data, "use_soft_falloff", True)}


def _sun(data, matrix, strength, **rest):
    angle = min(data.angle, np.pi)
    if not _is_normalised(data) and angle > 0:
        strength = strength * np.pi * np.sin(angle / 2) ** 2
    return SunLight(-matrix[:3, 2], strength, angle, **rest)


def _area(data, matrix, strength, **rest):
    height = data.size_y if data.shape in ("RECTANGLE", "ELLIPSE") else data.size
    u, v, away = matrix[:3, 0] * data.size, matrix[:3, 1] * height, matrix[:3, 2]
    if np.cross(u, v) @ away > 0:  # it shines along its own -z, mirrored or not
        u, v = v, u
    round_ = data.shape in ("DISK", "ELLIPSE")
    spread = max(data.spread, LEAST_SPREAD)
    light = AreaLight(matrix[:3, 3], u, v, strength, round_, spread, **rest)
    if not _is_normalised(data):
        light = AreaLight(matrix[:3, 3], u, v, strength * light.area, round_, spread, **rest)
    return light


_LIGHTS = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}
