"""A node tree read from an output back to its sources: through reroutes, groups, muted nodes and our preview.

Readers say of a node what it needs and how its outputs come from that; the walk brings them in order, so that no chain
is too deep, no socket is read twice, and links in a circle are found.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .node_values import Value, constant, converted
from .preview_nodes import before_preview

_PLACES = {}  # (bl_idname, identifier of an input): its number, the same in all nodes of that kind that readers know


class Socket:
    """A node's socket, and the group nodes that one is inside of."""

    def __init__(self, path, socket, node=None):
        self.path, self.socket, self.node = path, socket, node or socket.node

    @cached_property
    def key(self):
        return self.socket.as_pointer(), *[group.as_pointer() for group in self.path]

    def input(self, identifier):
        """The input with this identifier of the same node."""
        kind = self.node.bl_idname
        if (kind, identifier) not in _PLACES:
            _PLACES.update({(kind, s.identifier): k for k, s in enumerate(self.node.inputs)})
        return Socket(self.path, self.node.inputs[_PLACES[kind, identifier]], self.node)

    def inputs(self):
        """Inputs of the same node that are in use, by identifier."""
        return {s.identifier: Socket(self.path, s, self.node) for s in self.node.inputs if s.enabled}


@dataclass(eq=False, slots=True)
class Recipe:
    """inputs: [Socket] that are needed; make(*values): what the output is, one argument of each, in this order."""

    inputs: list
    make: object


@dataclass(frozen=True)
class Unknown:
    """What an output gives is not known; reason goes on after the node's title: ', whose image is missing'."""

    reason: str = ""


class Circle(ValueError):
    """Nodes linked in a circle."""


class Walk:
    """readers: {bl_idname, or a socket's type for all others: read(output, walk) -> Recipe or Unknown}.
    side: 0 the front, 1 the back; baked: names of colour attributes that hold bakes; images: a dict of Pictures that
    were read already, kept over all trees."""

    def __init__(self, tree, readers, side=0, baked=frozenset(), images=None):
        self.tree = tree
        self.readers = readers
        self.side = side
        self.has_sides = False  # whether a node was read that tells the sides apart
        self.baked = baked
        self.images = {} if images is None else images
        self._links = {}
        self._known = {}

    def read(self, output):
        """What an output Socket is: whatever its reader makes of it, or Unknown. Circle where it depends on itself."""
        with np.errstate(all="ignore"):  # a division by 0 is a colour like others in a node tree
            return self._read(output)

    def _read(self, output):
        open_, stack = {}, [output]
        while stack:
            top = stack[-1]
            key = top.key
            if key in self._known:
                stack.pop()
                continue
            if key not in open_:
                reader = self.readers.get(top.node.bl_idname) or self.readers.get(top.socket.type)
                recipe = reader(top, self) if reader else Unknown()
                if isinstance(recipe, Unknown):
                    self._known[key] = recipe
                    continue
                ends = [self.source(each) for each in recipe.inputs]
                open_[key] = (recipe, ends)
            recipe, ends = open_[key]
            needed = [end for end, is_output in ends if is_output and end.key not in self._known]
            if needed:
                if any(end.key in open_ for end in needed):
                    raise Circle
                stack += needed
                continue
            self._known[key] = recipe.make(*map(self._ended, recipe.inputs, ends))
            del open_[key]
        return self._known[output.key]

    def is_linked(self, socket):
        """Whether anything feeds an input Socket."""
        return self.source(socket)[1]

    def source(self, socket):
        """(Socket, True) of the output that feeds an input, or (Socket, False) of an input whose own value counts."""
        last, passed = socket, set()
        if not socket.socket.enabled:
            return (socket, False)
        while link := self._link(socket):
            output = Socket(socket.path, link.from_socket)
            socket = _behind(output)
            if socket is output:
                return (output, True)
            if socket is None:
                break
            if output.key in passed:
                raise Circle
            passed.add(output.key)
            if socket.node.bl_idname != "NodeReroute" and hasattr(socket.socket, "default_value"):
                last = socket
        return (last, False)

    def _link(self, socket):
        key = tuple([group.name for group in socket.path]) if socket.path else ()
        links = self._links.get(key)
        if links is None:  # asked socket by socket, every question searches all links
            tree = socket.path[-1].node_tree if socket.path else self.tree
            links = {link.to_socket.as_pointer(): link for link in tree.links if not link.is_muted}
            self._links[key] = links
        return links.get(socket.socket.as_pointer())

    def _ended(self, socket, end):
        """What an input is, given its source: a Value of its own type, or what a shader reader made, None for none."""
        end, is_output = end
        if socket.socket.type == "SHADER":
            return self._known[end.key] if is_output and end.socket.type == "SHADER" else None
        value = self._known[end.key] if is_output else plain(end)
        if isinstance(value, Value):
            return converted(value, end.socket.type, socket.socket.type)
        text = f"the {socket.socket.name} of its {title(socket.node)} is linked to {title(end.node)}"
        reason, _, advice = (value.reason if isinstance(value, Unknown) else "").partition("; ")
        advice = f"; {advice}" if advice else ""
        return plain(socket).noted(f"{text}{reason}: the socket's plain value is used{advice}")


def _behind(output):
    """The input that an output only passes on, None where it passes nothing, the output itself where it makes it."""
    node, path = output.node, output.path
    if before_preview(node):
        return Socket(path, before_preview(node))
    if node.mute:
        inside = [link.from_socket for link in node.internal_links if link.to_socket == output.socket]
        return Socket(path, inside[0]) if inside else None
    if node.bl_idname == "NodeReroute":
        return Socket(path, node.inputs[0])
    if node.bl_idname == "ShaderNodeGroup" and node.node_tree:
        ends = [n for n in node.node_tree.nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output]
        return _same(ends[0].inputs, output, (*path, node)) if ends else None
    if node.bl_idname == "NodeGroupInput" and path:
        return _same(path[-1].inputs, output, path[:-1])
    return output


def _same(sockets, other, path):
    found = [socket for socket in sockets if socket.identifier == other.socket.identifier]
    return Socket(path, found[0]) if found else None


def plain(socket):
    """A socket's own value as a Value: what it is without a link."""
    value = getattr(socket.socket, "default_value", 0.0)
    return constant(value[:3] if hasattr(value, "__len__") else value)


def title(node):
    """Image Texture node, or Image Texture node 'Wood' where it has a name of its own."""
    kind = node.bl_label or node.bl_idname
    own = node.label or node.name
    return f"{kind} node" if own.startswith(kind) and not node.label else f"{kind} node {own!r}"
