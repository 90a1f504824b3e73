"""All that a node tree holds as one text, to tell whether it is still the same."""

import bpy

AROUND = {"rna_type", "node", "parent", "links", "internal_links", "id_data"}  # ways up, and links, read by themselves
LOOKS = {  # of a node in the editor
    "location", "location_absolute", "width", "height", "dimensions", "select", "show_options", "show_preview",
    "show_texture", "hide", "label", "color", "use_custom_color", "warning_propagation", "panel_states",
}  # fmt: skip


def state_of(tree):
    """A text that differs where the trees would look different; images by their names, files and sizes."""
    lines, seen = [], set()
    _add_tree(tree, lines, seen)
    return "\n".join(lines)


def _add_tree(tree, lines, seen):
    if tree is None or tree.name_full in seen:
        return
    seen.add(tree.name_full)
    for node in tree.nodes:
        lines.append(f"{tree.name_full} {node.name} {node.bl_idname}")
        _add(node, lines, seen, 0)
    for link in tree.links:
        ends = (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier)
        lines.append(f"{ends} {link.is_muted}")


def _add(struct, lines, seen, depth):
    """The values of a struct's properties, and those below it."""
    for prop in struct.bl_rna.properties:
        if prop.identifier in AROUND or (depth == 0 and prop.identifier in LOOKS):
            continue
        value = getattr(struct, prop.identifier)
        if prop.type == "COLLECTION":
            for part in value if depth < 4 else ():
                _add(part, lines, seen, depth + 1)
        elif prop.type != "POINTER":
            lines.append(f"{prop.identifier} {tuple(value) if getattr(prop, 'is_array', False) else value!r}")
        elif isinstance(value, bpy.types.NodeTree):
            lines.append(value.name_full)
            _add_tree(value, lines, seen)
        elif isinstance(value, bpy.types.ID):
            file, size = getattr(value, "filepath", ""), tuple(getattr(value, "size", ()))
            lines.append(f"{value.name_full} {file} {size} {getattr(value, 'is_dirty', '')}")
        elif value is not None and depth < 4:
            _add(value, lines, seen, depth + 1)
