"""Light linking: which objects alone a lamp lights directly, and which alone block it."""


class Members:
    """Of a collection of light linking, by its members' switches: the included alone, or where none is, all but the
    excluded; nested collections count with all that is in them."""

    def __init__(self, collection):
        self.included, self.excluded = set(), set()
        for obj, entry in zip(collection.objects, collection.collection_objects):
            self._of(entry).add(obj.original)
        for child, entry in zip(collection.children, collection.collection_children):
            self._of(entry).update(obj.original for obj in child.all_objects)

    def _of(self, entry):
        return self.included if entry.light_linking.link_state == "INCLUDE" else self.excluded

    def __contains__(self, obj):
        return (not self.included or obj in self.included) and obj not in self.excluded


def linking_of(obj):
    """(receivers, blockers) of a lamp's object: Members, or None for all."""
    linking = obj.original.light_linking
    return tuple(made and Members(made) for made in (linking.receiver_collection, linking.blocker_collection))


def is_linked(obj):
    return any(linking_of(obj))


def link(found, accepted):
    """Tells the lights of ReadLights the core's shapes that they are linked to, of Accepted."""
    for light, links in zip(found.lights, found.links, strict=True):
        for name, members in zip(("receivers", "blockers"), links):
            if members is None:
                continue
            shapes = [
                accepted.pieces[k].shape
                for (mesh, _), place in zip(accepted.taken, accepted.place, strict=True)
                if mesh.raw.object in members
                for k in place.tolist()
            ]
            setattr(light, name, frozenset(shapes))
