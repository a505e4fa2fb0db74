"""Generators of the gallery's stages and textures."""
