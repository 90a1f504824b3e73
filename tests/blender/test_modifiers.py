"""Every modifier that Blender lists under Generate and Deform: its light, and a bake onto what it leaves."""

import bpy
import modified
import numpy as np
import pytest
import scenes
from mathutils import Matrix

MOVES = {kind for group, kind in modified.listed() if group == "Deform"} | {"TRIANGULATE"}  # and no face changes


@pytest.fixture
def read(addon):
    module = addon("operators.reading.read_scene")
    return lambda **own_meshes: module.read_scene(bpy.context, **own_meshes)


@pytest.mark.parametrize("kind", [kind for _, kind in modified.listed()])
def test_light_is_that_of_the_mesh_it_leaves(read, kind):
    obj = modified.modified(kind)
    reading = read()
    (found,) = (each for each in reading.objects if each.name == kind)
    assert reading.refused == [] and found.bakeable == (kind in MOVES)
    assert found.bakeable or "apply or remove it" in found.reason
    (applied,) = (each for each in read(apply_modifiers=True).objects if each.name == kind)
    assert applied.bakeable and applied.is_applied == (kind not in MOVES)
    before = modified.shapes_of(reading, {kind})
    copy = modified.evaluated_copy(obj)
    after = modified.shapes_of(read(), {copy.name})
    np.testing.assert_allclose(before, after, rtol=1e-4, atol=1e-5)
    base = len(obj.data.vertices)  # each one does something here
    assert kind == "TRIANGULATE" or base != len(copy.data.vertices) or _moved(obj, copy) > 1e-3


def _moved(obj, copy):
    return np.abs(scenes.vertices(obj) - scenes.vertices(copy)).max()


def test_one_bake_applies_what_changes_faces_and_keeps_what_moves_them():
    """Some of each side by side under a white sky: whatever faces up is lit as the mesh that is left would be."""
    kinds = ["ARRAY", "DECIMATE", "MIRROR", "SKIN", "SUBSURF", "MASK", "ARMATURE", "LATTICE", "WAVE", "TRIANGULATE"]
    objects = [modified.modified(kind, Matrix.Translation((12 * k, 0, 0))) for k, kind in enumerate(kinds)]
    graph = bpy.context.evaluated_depsgraph_get()
    left = {obj.name: len(obj.evaluated_get(graph).data.vertices) for obj in objects}
    world = bpy.data.worlds.new("Sky")
    if bpy.app.version < (5, 0):
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (1, 1, 1, 1)
    bpy.context.scene.world = world
    assert bpy.ops.pdm.bake(target_error=0.2, apply_modifiers=True) == {"FINISHED"}
    for obj, kind in zip(objects, kinds, strict=True):
        assert len(obj.data.vertices) == left[obj.name], kind
        assert bool(obj.modifiers) == (kind in MOVES), kind
        colours = scenes.colours(obj)[:, 0]
        assert np.isfinite(colours).all() and 0.4 < colours.max() < 0.6, kind
