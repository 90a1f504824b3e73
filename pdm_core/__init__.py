"""Diffuse light between exact planes and spheres: form factors, radiosity, gathering. Needs numpy only."""

from .scene import Plane, Scene, SceneError, Sphere, Surface

__all__ = ["Plane", "Scene", "SceneError", "Sphere", "Surface"]
