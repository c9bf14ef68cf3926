"""STORE: imported textures, kept in the data folder.

`store` keeps them in the database of `texture_database`, and `owned_textures` is the view of the service.
"""
