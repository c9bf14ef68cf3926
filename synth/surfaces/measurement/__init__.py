"""From a file to a surface: units, missing points, levelling, roughness and a picture. `importing` does it all."""
