"""Diffuse light between exact planes and spheres: form factors, radiosity, gathering. Needs numpy only."""

from .form_factors import FormFactors, form_factors
from .pdm import pdm_form_factor
from .scene import Plane, Scene, SceneError, Sphere, Surface

__all__ = ["FormFactors", "Plane", "Scene", "SceneError", "Sphere", "Surface", "form_factors", "pdm_form_factor"]
