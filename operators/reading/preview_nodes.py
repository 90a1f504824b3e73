"""The nodes that show baked colours in a material's own renders, and how the reading of materials passes them by.

    what was there  ->  first   Mix Shader (marked), factor 1  ->  the output
    attribute, emission  ->  second

At factor 0 the material is what it was. Everything added carries MARK; nothing that was there is changed but the link
into the output.
"""

import bpy

MARK = "pdm_preview"  # custom property of the nodes added, and of what else was made for them
MADE, NODES_SWITCHED_ON = "made", "nodes switched on"  # its values on a Material; a node has True
BEFORE, BAKED = 1, 2  # inputs of the marked Mix Shader
STEP = 200.0  # between columns of nodes
GREY = (0.8, 0.8, 0.8, 1.0)  # what Blender shows without a material

COLOUR_OF = {"ShaderNodeBsdfPrincipled": "Base Color", "ShaderNodeBsdfDiffuse": "Color"}
EMITTED_BY = {
    "ShaderNodeBsdfPrincipled": ("Emission Color", "Emission Strength"),
    "ShaderNodeEmission": ("Color", "Strength"),
}


def before_preview(node):
    """The input socket of the shader that was there before, where `node` is the marked Mix Shader; else None."""
    return node.inputs[BEFORE] if node.bl_idname == "ShaderNodeMixShader" and node.get(MARK) else None


def uses_nodes(material):
    return material.node_tree is not None and (bpy.app.version >= (5, 0) or material.use_nodes)


def make_material(name):
    """A marked material that looks as none does."""
    material = new_material(name)
    material[MARK] = MADE
    _plain_nodes(material, GREY)
    return material


def new_material(name):
    """One with nodes."""
    material = bpy.data.materials.new(name)
    if not uses_nodes(material):
        material.use_nodes = True
    return material


def add_preview(material, attribute, times_colour):
    """Adds the nodes, in place of any from before. times_colour: the colours are of arriving light (IRRADIANCE), to be
    multiplied by the surface's own colour, and what it emits is added."""
    remove_preview(material)
    if not uses_nodes(material):
        material.use_nodes = True
        _plain_nodes(material, material.diffuse_color)
        material[MARK] = NODES_SWITCHED_ON
    tree = material.node_tree
    for output in [node for node in tree.nodes if node.bl_idname == "ShaderNodeOutputMaterial"]:
        surface = output.inputs["Surface"]
        before = surface.links[0].from_socket if surface.is_linked else None
        add = _Adder(tree, output)
        mix = add("ShaderNodeMixShader", -1, 0)
        mix.label, mix.inputs[0].default_value = "Baked Light: 0 off, 1 on", 1.0
        baked = _baked_shader(add, attribute, before if times_colour else None)
        if before is not None:
            tree.links.new(before, mix.inputs[BEFORE])
        tree.links.new(baked, mix.inputs[BAKED])
        tree.links.new(mix.outputs[0], surface)


def remove_preview(material):
    """Takes the marked nodes out again; what was linked to the outputs is as before."""
    if not uses_nodes(material):
        return
    tree = material.node_tree
    marked = [node for node in tree.nodes if node.get(MARK)]
    for mix in [node for node in marked if before_preview(node)]:
        before = mix.inputs[BEFORE].links[0].from_socket if mix.inputs[BEFORE].is_linked else None
        for after in [link.to_socket for link in mix.outputs[0].links]:
            after.node.location.x -= STEP
            if before is not None:
                tree.links.new(before, after)
    for node in marked:
        tree.nodes.remove(node)
    if material.get(MARK) == NODES_SWITCHED_ON:
        del material[MARK]
        tree.nodes.clear()
        material.use_nodes = False


def has_preview(material):
    tree = material.node_tree
    return bool(material.get(MARK)) or (tree is not None and any(node.get(MARK) for node in tree.nodes))


class _Adder:
    """add(type, column, row): a marked node, columns from `output`, which moves one on, and rows up."""

    def __init__(self, tree, output):
        self.tree, self.at = tree, output.location.copy()
        output.location.x += STEP
        self.at.x += STEP

    def __call__(self, kind, column, row):
        node = self.tree.nodes.new(kind)
        node[MARK] = True
        node.location = self.at.x + column * STEP, self.at.y + 1.1 * row * STEP
        return node


def _baked_shader(add, attribute, surface):
    """The output socket of a shader that shows `attribute`; surface: the shader whose own colour multiplies it and
    whose emission is added, or None."""
    links = add.tree.links
    colour, emission = add("ShaderNodeAttribute", -4, -1), add("ShaderNodeEmission", -2, -1)
    colour.attribute_name = attribute
    own = surface and _upstream(surface, COLOUR_OF)
    if own is None:
        links.new(colour.outputs["Color"], emission.inputs["Color"])
    else:
        times = add("ShaderNodeMix", -3, -1)
        times.data_type, times.blend_type = "RGBA", "MULTIPLY"
        factor, a, b = (socket for socket in times.inputs if socket.enabled)
        factor.default_value = 1.0
        links.new(colour.outputs["Color"], a)
        _same(links, own.inputs[COLOUR_OF[own.bl_idname]], b)
        links.new(next(socket for socket in times.outputs if socket.enabled), emission.inputs["Color"])
    shining = surface and _upstream(surface, EMITTED_BY)
    if shining is None:
        return emission.outputs[0]
    emitted, both = add("ShaderNodeEmission", -3, -2), add("ShaderNodeAddShader", -1, -1)
    for name, socket in zip(EMITTED_BY[shining.bl_idname], ("Color", "Strength")):
        _same(links, shining.inputs[name], emitted.inputs[socket])
    links.new(emission.outputs[0], both.inputs[0])
    links.new(emitted.outputs[0], both.inputs[1])
    return both.outputs[0]


def _same(links, source, target):
    """target gets what source has, a link or a value."""
    target.default_value = source.default_value
    if source.is_linked:
        links.new(source.links[0].from_socket, target)


def _upstream(socket, kinds):
    """The nearest node of `kinds` (a dict by bl_idname) that feeds an output socket through shaders, or None."""
    queue, seen = [socket.node], set()
    while queue:
        node = queue.pop(0)
        if node.name in seen:
            continue
        seen.add(node.name)
        if node.bl_idname in kinds:
            return node
        queue += [s.links[0].from_node for s in node.inputs if s.is_linked and s.type == "SHADER"]
    return None


def _plain_nodes(material, colour):
    tree = material.node_tree
    tree.nodes.clear()
    shader, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    shader.inputs["Color"].default_value = (*colour[:3], 1.0)
    output.location.x = STEP
    tree.links.new(shader.outputs[0], output.inputs["Surface"])
