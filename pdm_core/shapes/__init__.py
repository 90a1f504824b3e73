"""Kinds of shape, one a file that knows all about it; what they have in common is in shape.py."""
