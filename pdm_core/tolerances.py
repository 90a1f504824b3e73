"""What counts as nothing, relative to what it is compared with; what touches by its coordinates' rounding: contacts."""

SINGLE = 2.0**-24  # what single precision rounds, relative
ROUNDING = 1e-15  # of one number, or of a sum of few
TINY = 1e-12  # what is left of nothing after many sums and products, of factors, shares, sines and depths
FAINT = 1e-6  # light, or a cosine, that is nothing beside what it is compared with
# In tolerances of the coordinates, see Scene.tolerance.
FLUSH = 4.0  # what is no further lies on it
CLEAR = 8.0  # what points keep from what stands on their surface; what hides all beyond it; what one shape twice is off
KEPT = 16.0  # what points keep from the borders of their shapes, and may lie off a ball
# Depth, relative to the shapes' size, up to which shapes that cross count as touching and planes as flush, and corners
# as met: Blender's single-precision vertices are off by a tenth of it. What it costs is of the same size, and only in
# such places.
TOUCHING = 1e-6
