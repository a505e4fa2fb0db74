"""From shader node trees to the closures and textures of the ABI."""
