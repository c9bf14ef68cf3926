"""The contact of a finger with a texture: the equations of Fagiani & Barbieri (2016), one group of equations per file.

geometry          eqs 2-3   heights of finger and texture, roughness to amplitude
stiffness         eqs 4-5   contact stiffness and mean indentation from the load
groups            eqs 6-7   dimensionless groups
load_balance      eq. 1     one contact: its geometry and stiffness, the choice of its solver, and full contact
exact_solver                the approach z of two cosines, to round-off; `patches` measures one cell
profile_solver              the approach z of any profile, on segments (`segment_kernels`)
fingertip, fingertip_solver the approach z of a fingertip with ridges over an area, on a texture along a line
area_contact                a finger on a height field: its cells (`area_grid`), the texture (`area_texture`), the
                            solver (`area_solver`) and motion across it (`area_path`)
curved_contact              a round finger
growing_contact             a contact length that follows the load
scene_contact               the contact of a scene
pressure                    integrals of the pressure at any phase and z
forces                      the horizontal forces of slopes and friction, as functions of phase and load
"""
