"""The golden renderer in float64: camera, scene, reflection models, rasteriser, renderer, metrics."""
