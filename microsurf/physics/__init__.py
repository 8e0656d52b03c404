"""The functions of physics, one subject a file: arrays in, arrays out, no state.

Directions point away from the surface and are unit vectors in the last axis of
an array; ``i`` towards the light, ``o`` towards the detector, ``m`` the facet's
normal. The mean normal is (0, 0, 1). Angles are in radians, BRDFs in sr⁻¹
without the cosine.
"""
