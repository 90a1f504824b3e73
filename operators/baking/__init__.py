"""From what was read to the colours of the meshes, and the report of it."""
