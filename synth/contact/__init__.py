"""The contact of a finger with a texture: the equations of Fagiani & Barbieri (2016), an equation group a file."""
