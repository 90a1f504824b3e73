"""Light by bundles of parallel rays: scenes of many shapes, polygons, meshes, lights and surfaces that vary."""
