"""Order 1 without sampling: specular and body BRDF, integrated over the detector's bins."""
