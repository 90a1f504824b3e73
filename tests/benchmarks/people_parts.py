"""What the people's scenes are put together from: materials, boxes, prisms, tubes, lamps, cameras, cuts."""

from math import cos, pi, radians, sin

import bmesh
import bpy
import numpy as np
from mathutils import Matrix, Vector


def material(name, colour=(0.7, 0.7, 0.7), glow=0.0, image=None):
    """A Principled material without gloss, `glow` its emission in its own colour; `image` instead of the colour."""
    found = bpy.data.materials.get(name)
    if found:
        return found
    made = bpy.data.materials.new(name)
    if bpy.app.version < (5, 0):
        made.use_nodes = True
    tree = made.node_tree
    shader = tree.nodes["Principled BSDF"]
    shader.inputs["Specular IOR Level"].default_value = 0.0
    shader.inputs["Roughness"].default_value = 1.0
    shader.inputs["Base Color"].default_value = (*colour, 1)
    if glow:
        shader.inputs["Emission Color"].default_value = (*colour, 1)
        shader.inputs["Emission Strength"].default_value = glow
    if image:
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
    return made


def painted(name, f, size=128):
    """A packed image of the colours f(u, v) (size, size) -> 3 arrays."""
    image = bpy.data.images.new(name, size, size)
    u, v = np.meshgrid((np.arange(size) + 0.5) / size, (np.arange(size) + 0.5) / size)
    pixels = np.ones((size, size, 4), np.float32)
    for k, channel in enumerate(f(u, v)):
        pixels[:, :, k] = channel
    image.pixels.foreach_set(pixels.ravel())
    image.pack()
    return image


def thing(name, vertices, faces, paint, smooth=False, cut=0.0, at=(0, 0, 0), turn=0.0):
    """A mesh object, normals consistent; `cut`: also cut by planes every so many metres; `turn`: degrees about z."""
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata([tuple(v) for v in vertices], [], [tuple(f) for f in faces])
    return placed(name, mesh, paint, smooth, cut, at, turn)


def placed(name, mesh, paint, smooth=False, cut=0.0, at=(0, 0, 0), turn=0.0):
    for one in paint if isinstance(paint, list) else [paint]:
        mesh.materials.append(one)
    if cut:
        cut_up(mesh, cut)
    mesh.polygons.foreach_set("use_smooth", np.full(len(mesh.polygons), smooth))
    mesh.update()
    obj = bpy.data.objects.new(name, mesh)
    obj.matrix_world = Matrix.Translation(at) @ Matrix.Rotation(radians(turn), 4, "Z")
    bpy.context.scene.collection.objects.link(obj)
    return obj


def cut_up(mesh, step):
    work = bmesh.new()
    work.from_mesh(mesh)
    corners = np.array([v.co for v in work.verts])
    low, high = corners.min(axis=0), corners.max(axis=0)
    for axis in range(3):
        count = int(np.ceil((high - low)[axis] / step - 1e-6))
        for k in range(1, count):
            co, normal = Vector((0, 0, 0)), Vector((0, 0, 0))
            co[axis], normal[axis] = low[axis] + (high - low)[axis] * k / count, 1
            geometry = [*work.verts, *work.edges, *work.faces]
            bmesh.ops.bisect_plane(work, geom=geometry, dist=1e-5, plane_co=co, plane_no=normal)
    work.to_mesh(mesh)
    work.free()


def box(name, low, size, paint, cut=0.0, turn=0.0, inward=False, leave=""):
    """`leave`: letters of faces without: w e s n b t."""
    x, y, z = size
    corners = [(i * x, j * y, k * z) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    faces = {
        "b": (0, 2, 3, 1), "t": (4, 5, 7, 6), "s": (0, 1, 5, 4), "n": (2, 6, 7, 3), "w": (0, 4, 6, 2), "e": (1, 3, 7, 5)
    }  # fmt: skip
    kept = [f[::-1] if inward else f for key, f in faces.items() if key not in leave]
    return thing(name, corners, kept, paint, cut=cut, at=low, turn=turn)


def quad(name, corner, u, v, paint, cut=0.0, uv=False):
    """Its normal along u x v."""
    corner, u, v = Vector(corner), Vector(u), Vector(v)
    made = thing(name, [corner, corner + u, corner + u + v, corner + v], [(0, 1, 2, 3)], paint)
    if uv:
        layer = made.data.uv_layers.new(name="UVMap")
        layer.uv.foreach_set("vector", np.array([0, 0, 1, 0, 1, 1, 0, 1], np.float32))
    if cut:
        cut_tilted(made.data, corner, u, v, cut)
    return made


def cut_tilted(mesh, corner, u, v, step):
    work = bmesh.new()
    work.from_mesh(mesh)
    for along in (u, v):
        count = int(np.ceil(along.length / step - 1e-6))
        for k in range(1, count):
            geometry = [*work.verts, *work.edges, *work.faces]
            bmesh.ops.bisect_plane(work, geom=geometry, dist=1e-5, plane_co=corner + along * k / count, plane_no=along)
    work.to_mesh(mesh)
    work.free()


def prism(name, outline, direction, paint, cut=0.0, at=(0, 0, 0), turn=0.0, ends=True):
    """The polygon `outline` (n, 3), counter-clockwise seen from `direction`, extruded against it; n-gon ends."""
    count, back = len(outline), [Vector(p) - Vector(direction) for p in outline]
    faces = [(k, k + count, (k + 1) % count + count, (k + 1) % count) for k in range(count)]
    if ends:
        faces += [tuple(range(count)), tuple(range(2 * count - 1, count - 1, -1))]
    return thing(name, [*map(Vector, outline), *back], faces, paint, cut=cut, at=at, turn=turn)


def pierced(name, corner, u, v, holes, paint, cut=0.0):
    """A rectangle with rectangular holes [(s0, s1, t0, t1)] in metres along u and v: a grid of quads without them."""
    corner, u, v = Vector(corner), Vector(u), Vector(v)
    lines = []
    for k, along in enumerate((u, v)):
        marks = sorted({0.0, along.length, *(h for hole in holes for h in hole[2 * k : 2 * k + 2])})
        fine = []
        for a, b in zip(marks, marks[1:]):
            parts = max(int(np.ceil((b - a) / cut)), 1) if cut else 1
            fine += [a + (b - a) * i / parts for i in range(parts)]
        lines.append([*fine, along.length])
    s, t = lines
    unit = u.normalized(), v.normalized()
    vertices = [corner + unit[0] * a + unit[1] * b for b in t for a in s]
    faces = []
    for j in range(len(t) - 1):
        for i in range(len(s) - 1):
            a, b = (s[i] + s[i + 1]) / 2, (t[j] + t[j + 1]) / 2
            if not any(h[0] < a < h[1] and h[2] < b < h[3] for h in holes):
                k = j * len(s) + i
                faces.append((k, k + 1, k + 1 + len(s), k + len(s)))
    made = thing(name, vertices, faces, paint)
    work = bmesh.new()
    work.from_mesh(made.data)
    bmesh.ops.delete(work, geom=[vertex for vertex in work.verts if not vertex.link_faces], context="VERTS")
    work.to_mesh(made.data)
    work.free()
    return made


def lathe(name, profile, paint, segments=32, smooth=True, at=(0, 0, 0)):
    """The profile [(radius, z)] turned about z; ends of radius 0 are poles. Going up, the front is outside."""
    rings, vertices, faces = [], [], []
    for radius, z in profile:
        count = segments if radius else 1
        rings.append(range(len(vertices), len(vertices) + count))
        vertices += [(radius * cos(2 * pi * k / count), radius * sin(2 * pi * k / count), z) for k in range(count)]
    for low, high in zip(rings, rings[1:]):
        for k in range(segments):
            corners = [low[k % len(low)], low[(k + 1) % len(low)], high[(k + 1) % len(high)], high[k % len(high)]]
            faces.append(list(dict.fromkeys(corners)))
    return thing(name, vertices, faces, paint, smooth, at=at)


def tube(name, at, radius, height, paint, segments=24, smooth=False):
    """A closed cylinder as Blender's own: quads and two n-gons."""
    ring = [(radius * cos(2 * pi * k / segments), radius * sin(2 * pi * k / segments)) for k in range(segments)]
    vertices = [(x, y, z) for z in (0, height) for x, y in ring]
    faces = [(k, (k + 1) % segments, (k + 1) % segments + segments, k + segments) for k in range(segments)]
    faces += [tuple(range(segments))[::-1], tuple(range(segments, 2 * segments))]
    made = thing(name, vertices, faces, paint, at=at)
    made.data.polygons.foreach_set("use_smooth", np.arange(segments + 2) < (segments if smooth else 0))
    return made


def primitive(name, operator, paint, smooth, at, turn=(0, 0, 0), **words):
    operator(location=at, rotation=[radians(a) for a in turn], **words)
    obj = bpy.context.object
    obj.name = obj.data.name = name
    obj.data.materials.append(paint)
    obj.data.polygons.foreach_set("use_smooth", np.full(len(obj.data.polygons), smooth))
    return obj


def lamp(name, kind, at, energy, towards=None, colour=(1, 1, 1), **words):
    data = bpy.data.lights.new(name, kind)
    data.energy, data.color = energy, colour
    for key, value in words.items():
        setattr(data, key, value)
    obj = bpy.data.objects.new(name, data)
    turn = (Vector(towards) - Vector(at)).to_track_quat("-Z", "Y").to_matrix().to_4x4() if towards else Matrix()
    obj.matrix_world = Matrix.Translation(at) @ turn
    bpy.context.scene.collection.objects.link(obj)
    return obj


def camera(at, towards, degrees=60.0):
    data = bpy.data.cameras.new("Camera")
    data.angle = radians(degrees)
    obj = bpy.data.objects.new("Camera", data)
    turn = (Vector(towards) - Vector(at)).to_track_quat("-Z", "Y").to_matrix().to_4x4()
    obj.matrix_world = Matrix.Translation(at) @ turn
    bpy.context.scene.collection.objects.link(obj)
    bpy.context.scene.camera = obj


def world(colour, strength=1.0, sky=False):
    made = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        made.use_nodes = True
    bpy.context.scene.world = made
    background = made.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*colour, 1)
    background.inputs["Strength"].default_value = strength
    if sky:
        node = made.node_tree.nodes.new("ShaderNodeTexSky")
        node.sky_type = "HOSEK_WILKIE"
        node.sun_direction = Vector((0.4, -0.5, 0.77)).normalized()
        made.node_tree.links.new(node.outputs["Color"], background.inputs["Color"])
