"""The float64 truth: camera, scene, reflection models, rasteriser, renderer, metrics."""
