"""Light by links between cells: scenes of few planes and spheres. Transport, light, check, refinement, in order."""
