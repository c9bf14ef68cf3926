"""The contact of a finger with a texture: the equations of Fagiani & Barbieri (2016), an equation group a file.

geometry   eqs 2-3   heights of finger and texture, roughness to amplitude
stiffness  eqs 4-5   contact stiffness and mean indentation from the load
groups     eqs 6-7   dimensionless groups, both directions
full_contact  full contact and no contact in closed form
patches    the part of one grid cell that touches
exact      the approach z at any phase and load, to round-off
solvers    what every solver offers, and which one a contact takes
pressure   integrals of the pressure at any phase and z, over the touching intervals that `intervals` finds
forces     the horizontal forces of slopes and friction, as functions of phase and load
"""
