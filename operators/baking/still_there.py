"""Data-blocks that are held while Blender goes on: what the user undoes meanwhile makes others of the same name."""


def still_there(block, name, collection):
    """A data-block that was called `name` in its collection of bpy.data, or what an undo has put in its place; None
    where it is gone."""
    try:
        return block.name and block
    except ReferenceError:
        return collection.get((name, None))
