"""An exact walk over the triangles, which the rays of Embree are held against."""
