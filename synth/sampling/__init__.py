"""From a source of z to frames: z at equal steps along a motion, then filters that limit the band and take derivatives.

frame_solver    files: chunks of frames, with their filter; `landing` solves quick changes of the load more often
direct_reader   live fingers: solutions at every few frames, filtered by `response.reading_filter`
decimation      simulations: the filter from steps to frames
"""
