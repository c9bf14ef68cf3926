"""STORE: imported textures, kept in the data folder. `store` keeps them, `owned_textures` is the service's view."""
