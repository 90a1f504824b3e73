"""Which objects a render of the view layer shows, and a depsgraph in which all of them are evaluated."""

from contextlib import contextmanager

import bpy


def render_visible(view_layer):
    """Objects of the view layer that a final render shows, in the view layer's order, whatever the viewport hides."""
    shown = set()

    def visit(layer_collection, visible):
        visible = visible and not layer_collection.collection.hide_render
        if visible and not layer_collection.exclude:
            shown.update(layer_collection.collection.objects)
        for child in layer_collection.children:
            visit(child, visible)

    visit(view_layer.layer_collection, True)
    return [obj for obj in view_layer.objects if obj in shown and not obj.hide_render and not _only_instanced(obj)]


def world_of(scene, view_layer):
    """The World that lights a render of the view layer: its override, if it has one; None with its Environment off."""
    return (view_layer.world_override or scene.world) if view_layer.use_sky else None


def _only_instanced(obj):
    """Instancers on vertices and faces show their children at the instances only, and themselves if told so."""
    if obj.parent is not None and obj.parent.instance_type in {"VERTS", "FACES"}:
        return True
    return obj.is_instancer and obj.type == "MESH" and not obj.show_instancer_for_render


@contextmanager
def evaluated(context, objects):
    """The depsgraph with all of `objects` evaluated: what is hidden in the viewport is shown until the end.

    The viewport's depsgraph, the only one that scripts get, leaves out what has its monitor icon off.
    """
    view_layer = context.view_layer
    hidden = [obj for obj in objects if not obj.visible_get(view_layer=view_layer)]
    switched = []  # (owner, attribute), all of which were True
    if hidden:
        switched = [(obj, "hide_viewport") for obj in hidden if obj.hide_viewport]
        switched += _hiding_collections(view_layer.layer_collection, set(hidden))
    closed_eyes = [obj for obj in hidden if obj.hide_get(view_layer=view_layer)]
    try:
        for owner, attribute in switched:
            setattr(owner, attribute, False)
        for obj in closed_eyes:
            obj.hide_set(False, view_layer=view_layer)
        yield context.evaluated_depsgraph_get()
    finally:
        for owner, attribute in reversed(switched):
            setattr(owner, attribute, True)
        for obj in closed_eyes:
            obj.hide_set(True, view_layer=view_layer)


def mesh_shown(obj, depsgraph):
    """A new Mesh of what an object is evaluated to, with all its layers."""
    shown = obj.evaluated_get(depsgraph)
    return bpy.data.meshes.new_from_object(shown, preserve_all_data_layers=True, depsgraph=depsgraph)


def _hiding_collections(layer_collection, objects):
    """The switches that hide this collection or those below it, where one of `objects` is among all their objects."""
    collection = layer_collection.collection
    if objects.isdisjoint(collection.all_objects):
        return []
    found = [(owner, "hide_viewport") for owner in (layer_collection, collection) if owner.hide_viewport]
    for child in layer_collection.children:
        found += _hiding_collections(child, objects)
    return found
