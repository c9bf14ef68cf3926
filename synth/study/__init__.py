"""Many scenes at once: parameter maps of the vibration over surface geometry, speed, load and dimensionless groups.

axes            one axis of a study: a field of the scene or a group, and its values
samples         how scenes are drawn where they are not every combination, and the Sobol indices of them
spec            the whole study: a scene, axes, and how they are combined; its scenes by number; the ready studies
variables       what is recorded of a scene: names, dimensions, units
steady_outcome  these numbers of a steady scene; `simulated_outcome` where effects are simulated
series_outcome  those of them that follow from the series of displacement
chunks          scenes that are solved together, and their files, from which an interrupted study goes on
running         chunks on the processors of this machine, or on a Dask cluster
dataset         the result as one labelled dataset, and its files
skin_outcome    what the receptors of the skin feel of a scene; `sound_outcome` of a recording
cost_of_accuracy  what fewer or more phases cost and change
waveforms       a sound file for each scene, with a manifest
comparison      a recording beside the model; `recordings` reads it, `line_search` finds its lines,
                `recording_doubts` tells what is wrong with it
"""
