"""What counts as nothing, relative to what it is compared with; what touches by its coordinates' rounding: contacts."""

ROUNDING = 1e-15  # of one number, or of a sum of few
TINY = 1e-12  # what is left of nothing after many sums and products, of factors, shares, sines and depths
FAINT = 1e-6  # light, or a cosine, that is nothing beside what it is compared with
# Depth, relative to the shapes' size, up to which shapes that cross count as touching and planes as flush, and corners
# as met: Blender's single-precision vertices are off by a tenth of it. What it costs is of the same size, and only in
# such places.
TOUCHING = 1e-6
