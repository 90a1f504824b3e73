"""A bake by the button beside one by script: how much longer, and the longest time without an answer to input. Not a
test: prints figures, for `tests/window/shot.sh`."""

import math
import statistics
import time

import bmesh
import bpy
from hands import clear, module, panel, press, running, say, settings, until, view
from mathutils import Matrix

CELLS, ROUNDS, GAP = 34, 3, 0.005
WALLS = ((0, 0), (math.pi, 0), (math.pi / 2, 0), (-math.pi / 2, 0), (0, math.pi / 2), (0, -math.pi / 2))  # turns x, y


def material(name, colour, light=None):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    kind = "ShaderNodeEmission" if light else "ShaderNodeBsdfDiffuse"
    shader, output = tree.nodes.new(kind), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*(light or colour), 1)
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
    return made


def add(name, build, matrix, made_of):
    mesh, work = bpy.data.meshes.new(name), bmesh.new()
    build(work)
    work.to_mesh(mesh)
    work.free()
    mesh.materials.append(made_of)
    obj = bpy.data.objects.new(name, mesh)
    obj.matrix_world = matrix
    bpy.context.collection.objects.link(obj)


def room(balls):
    """A closed room of 6 m whose normals face inward, with balls [(centre, radius)], the last of which shines."""
    grey, lamp = material("Grey", (0.6, 0.6, 0.6)), material("Lamp", None, (4.0, 4.0, 4.0))
    for k, (x, y) in enumerate(WALLS):
        turn = Matrix.Rotation(x, 4, "X") @ Matrix.Rotation(y, 4, "Y")
        build = lambda work: bmesh.ops.create_grid(work, x_segments=CELLS, y_segments=CELLS, size=3.0)  # noqa: E731
        add(f"Wall {k}", build, turn @ Matrix.Translation((0, 0, -3)), lamp if k == 1 and len(balls) == 1 else grey)
    for k, (centre, radius) in enumerate(balls):
        build = lambda work, r=radius: bmesh.ops.create_uvsphere(work, u_segments=24, v_segments=12, radius=r)  # noqa: E731
        own = lamp if k == len(balls) - 1 and k else grey
        add(f"Ball {k}", build, Matrix.Translation(centre), own)
    world = bpy.context.scene.world
    if world is not None:
        bpy.data.worlds.remove(world)


THIRTEEN = [((2 * i, 2 * j, -1.8 if (i + j) % 2 else 0.6), 0.55) for i in (-1, 0, 1) for j in (-1, 0, 1)]
THIRTEEN += [((-1, -1, -0.5), 0.4), ((1, 1, -0.5), 0.4), ((-1, 1, 2.0), 0.4), ((1, -1, 2.0), 0.5)]
ROOMS = {"closed room": [((0, 0, 0), 1.0)], "13 balls": THIRTEEN}


def steps():
    yield from panel()
    for name, balls in ROOMS.items():
        clear()
        room(balls)
        yield 2.0
        scripts, modals, gaps, work = [], [], [], []
        for _ in range(ROUNDS):
            with bpy.context.temp_override(**view()):
                begun, cpu = time.perf_counter(), time.process_time()
                bpy.ops.pdm.bake(target_error=0.01)
                scripts.append(time.perf_counter() - begun)
                work.append([time.process_time() - cpu])
            yield 2.0
            settings().preset = "GOOD"
            yield 0.5
            seen = []

            def look(seen=seen):
                if running():
                    seen.append((time.perf_counter(), time.process_time()))
                return GAP

            bpy.app.timers.register(look)
            yield from press("pdm.bake")
            yield from until(lambda: not running())
            bpy.app.timers.unregister(look)
            current = module("operators.modal_steps").current
            modals.append(seen[-1][0] - current.begun)
            work[-1].append(seen[-1][1] - seen[0][1])
            gaps.append(max(b[0] - a[0] for a, b in zip(seen, seen[1:])))
            say(f"{name}: longest slice {1000 * max(current.slices):.0f} ms of {len(current.slices)}")
        (script, modal), (cpu, of_modal) = map(statistics.median, (scripts, modals)), map(statistics.median, zip(*work))
        say(
            f"{name}: script {script:.2f} s, window {modal:.2f} s, {modal / script:.2f} times, {of_modal / cpu:.2f} of "
            f"CPU time with all that draws; longest without an answer {1000 * max(gaps):.0f} ms, median of each bake's "
            f"{1000 * statistics.median(gaps):.0f}; {settings().report()['vertices']} vertices"
        )
