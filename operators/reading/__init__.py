"""What a render of the scene shows, as surfaces, lights and a sky of pdm_core; nothing of the file is changed."""
