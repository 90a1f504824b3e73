"""The two demo rooms from plain Blender primitives: grids, UV spheres, one camera each.

Cornell: the box of the Cornell University Program of Computer Graphics (1 unit = 100 mm, exactly rectangular, open in
front, black outside), its blocks replaced by spheres of their heights, its spectra as linear Rec.709.
Paper: the closed room of the published method, a unit sphere in a cube of side 6, walls coloured, the ceiling emitting.
"""

import math

import bpy
from mathutils import Matrix, Vector

WHITE, RED, GREEN = (0.7369, 0.7365, 0.7384), (0.4926, 0.0490, 0.0511), (0.0679, 0.3988, 0.0863)
LIGHT, LIGHT_REFLECTANCE = (20.737, 10.861, 2.772), (0.78, 0.78, 0.78)
SEGMENTS, RINGS = 64, 32


def cornell(cells):
    """5.528 x 5.592 x 5.488, the light 1 cm under the ceiling, the spheres 1 mm over the floor."""
    x, y, z = 5.528, 5.592, 5.488
    white, red, green = diffuse("White", WHITE), diffuse("Red", RED), diffuse("Green", GREEN)
    wall("Floor", (0, 0, 0), (x, 0, 0), (0, y, 0), white, cells)
    wall("Ceiling", (0, 0, z), (0, y, 0), (x, 0, 0), white, cells)
    wall("Left", (0, 0, 0), (0, y, 0), (0, 0, z), red, cells)
    wall("Right", (x, 0, 0), (0, 0, z), (0, y, 0), green, cells)
    wall("Back", (0, y, 0), (x, 0, 0), (0, 0, z), white, cells)
    lamp = diffuse("Light", LIGHT_REFLECTANCE, LIGHT, front_only=True)
    wall("Light", (2.098, 2.27, 5.478), (0, 1.05, 0), (1.3, 0, 0), lamp, 8)
    ball("Small", (3.673, 1.69, 0.835), 0.825, white)
    ball("Big", (1.843, 3.5125, 1.66), 1.65, white)
    camera((2.78, -8.0, 2.73), (2.78, 2.8, 2.73), 39.3)


def paper(cells):
    """The ceiling emits 1, the ball reflects .8, the walls .5 but for two coloured ones."""
    grey = diffuse("Grey", (0.5, 0.5, 0.5))
    a = 3.0
    wall("Floor", (-a, -a, -a), (6, 0, 0), (0, 6, 0), grey, cells)
    wall("Ceiling", (-a, -a, a), (0, 6, 0), (6, 0, 0), diffuse("Ceiling", (0.5, 0.5, 0.5), (1, 1, 1)), cells)
    wall("Left", (-a, -a, -a), (0, 6, 0), (0, 0, 6), diffuse("Red", (0.6, 0.1, 0.1)), cells)
    wall("Right", (a, -a, -a), (0, 0, 6), (0, 6, 0), diffuse("Green", (0.1, 0.55, 0.12)), cells)
    wall("Back", (-a, a, -a), (6, 0, 0), (0, 0, 6), grey, cells)
    wall("Front", (-a, -a, -a), (0, 0, 6), (6, 0, 0), grey, cells)
    ball("Ball", (0, 0, 0), 1.0, diffuse("Ball", (0.8, 0.8, 0.8)))
    camera((0, -2.95, 0), (0, 0, 0), 95)


ROOMS = {"cornell": cornell, "paper": paper}


def build(name, size=600, cells=60):
    """Replaces the open file by the room `name`, `cells` x `cells` a wall, `size` x `size` pixels a picture."""
    bpy.ops.wm.read_homefile(use_empty=True)
    ROOMS[name](cells)
    render = bpy.context.scene.render
    render.resolution_x = render.resolution_y = size
    render.resolution_percentage = 100
    bpy.context.view_layer.update()


def wall(name, corner, u, v, material, cells):
    """A grid over corner + s u + t v, its normals along u x v."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=cells, y_subdivisions=cells, size=1.0)
    corner, u, v = Vector(corner), Vector(u), Vector(v)
    normal = u.cross(v).normalized()
    matrix = Matrix([u, v, normal]).transposed().to_4x4()
    matrix.translation = corner + (u + v) / 2
    finish(name, matrix, material)


def ball(name, center, radius, material):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=SEGMENTS, ring_count=RINGS, radius=radius)
    bpy.ops.object.shade_smooth()
    finish(name, Matrix.Translation(center), material)


def finish(name, matrix, material):
    obj = bpy.context.object
    obj.name = obj.data.name = name
    obj.matrix_world = matrix
    obj.data.materials.append(material)


def diffuse(name, reflectance, emission=None, front_only=False):
    """A Diffuse material, plus Emission of that radiance; front_only: Geometry > Backfacing switches the light off."""
    material = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    output, shader = nodes.new("ShaderNodeOutputMaterial"), nodes.new("ShaderNodeBsdfDiffuse")
    shader.inputs["Color"].default_value = (*reflectance, 1)
    top = shader
    if emission is not None:
        light, top = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeAddShader")
        light.inputs["Color"].default_value = (*(e / max(emission) for e in emission), 1)
        light.inputs["Strength"].default_value = max(emission)
        links.new(shader.outputs[0], top.inputs[0])
        if front_only:
            side, switch = nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeMixShader")
            links.new(side.outputs["Backfacing"], switch.inputs[0])
            links.new(light.outputs[0], switch.inputs[1])
            light = switch
        links.new(light.outputs[0], top.inputs[1])
    links.new(top.outputs[0], output.inputs["Surface"])
    return material


def camera(position, target, degrees):
    data = bpy.data.cameras.new("Camera")
    data.angle, data.clip_start = math.radians(degrees), 0.01
    obj = bpy.data.objects.new("Camera", data)
    turn = (Vector(target) - Vector(position)).to_track_quat("-Z", "Y")
    obj.matrix_world = Matrix.Translation(position) @ turn.to_matrix().to_4x4()
    bpy.context.collection.objects.link(obj)
    bpy.context.scene.camera = obj
