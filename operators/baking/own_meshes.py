"""Meshes of their own for objects that are baked with their modifiers applied, or share theirs with others."""

import bpy

from ..reading.render_visible import evaluated, mesh_shown
from .colour_attribute import BakeError, object_of


class OwnMeshes:
    """Gives ReadObjects that need it a mesh of their own. undo() puts all back, commit() makes it last."""

    def __init__(self, context, targets):
        self._given = []  # (object, its mesh before, its own, whether its modifiers are in that)
        try:
            for target in reversed(targets):  # of those that share a mesh the first keeps it
                if target.is_applied or target.is_single_user:
                    self._give(context, target)
        except Exception:
            self.undo()
            raise

    def _give(self, context, target):
        obj = object_of(target.name)
        old = obj.data
        if target.is_applied:
            with evaluated(context, [obj]) as depsgraph:
                own = mesh_shown(obj, depsgraph)
        elif old.users - old.use_fake_user > 1:
            own = old.copy()
        else:
            return
        self._given.append((obj, old, own, target.is_applied))
        obj.data = own
        if len(own.vertices) != len(target.base.vertices):
            raise BakeError(f"Object {target.name!r} was edited during the bake; bake again")

    def undo(self):
        for obj, old, own, _ in reversed(self._given):
            obj.data = old
            bpy.data.meshes.remove(own)

    def commit(self):
        """Removes the modifiers that are in the meshes now, and meshes that nothing uses any more."""
        for obj, old, own, is_applied in self._given:
            if is_applied:
                for modifier in [m for m in obj.modifiers if m.show_viewport]:
                    obj.modifiers.remove(modifier)
            if not old.users:
                name = old.name
                bpy.data.meshes.remove(old)
                own.name = name
