"""A small ray caster with its own camera, intersection and formulas, from `docs/theory` alone.

It takes plain numbers and arrays and imports nothing of blysk. A ray goes through each pixel centre. Where it
meets a triangle, the barycentric coordinates in space weight the normals of the corners, and the sum is
normalised. This is the meaning of perspective-correct interpolation, without rasterisation. The same
coordinates weight colours and texture coordinates of the corners.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

MODELS = {
    "blinn": lambda c, n: np.maximum(c, 0) ** n,
    "phong": lambda c, n: np.maximum(c, 0) ** n,
    "cosquad": lambda c, n: np.maximum(1 - n / 2 * (1 - c), 0) ** 2,
    "cosquad7": lambda c, n: np.maximum(1 - 7 * n / 16 * (1 - c), 0) ** 2,
    "cosquad_lin": lambda c, n: np.maximum(1 - (0.448 * n + 0.099) * (1 - c), 0) ** 2,
}
"""Reflection models by their formulas in docs/theory/models.md; c is N·H, and R·V for ``phong``."""


def unit(v):
    """Vectors of length 1."""
    v = np.asarray(v, dtype=np.float64)
    return v / np.sqrt((v * v).sum(axis=-1, keepdims=True))


@dataclass
class View:
    """The position of the camera and its view. Angles are in degrees, and pixels are square."""

    position: tuple
    target: tuple
    width: int
    height: int
    perspective: bool
    field_of_view: float
    world_height: float
    near: float

    def __post_init__(self):
        self.forward = unit(np.subtract(self.target, self.position))
        self.right = unit(np.cross(self.forward, (0.0, 1.0, 0.0)))
        self.up = np.cross(self.right, self.forward)

    def on_plane(self, x, y):
        """Offset from the line of sight, at depth 1 or any depth, of points in pixels from the upper left."""
        extent = 2 * np.tan(np.radians(self.field_of_view) / 2) if self.perspective else self.world_height
        size = extent / self.height
        across = (np.asarray(x) - self.width / 2) * size
        above = (self.height / 2 - np.asarray(y)) * size
        return across[..., None] * self.right + above[..., None] * self.up

    def rays(self, x, y):
        """Origin and direction of the rays through points in pixels."""
        offset = self.on_plane(x, y)
        if self.perspective:
            return np.broadcast_to(self.position, offset.shape), offset + self.forward
        return self.position + offset, np.broadcast_to(self.forward, offset.shape)

    def places(self, points):
        """Positions in pixels, and depths, of points in space."""
        relative = points - np.asarray(self.position)
        depth = relative @ self.forward
        extent = 2 * np.tan(np.radians(self.field_of_view) / 2) if self.perspective else self.world_height
        scale = self.height / extent / (depth if self.perspective else 1.0)
        return (
            self.width / 2 + relative @ self.right * scale,
            self.height / 2 - relative @ self.up * scale,
            depth,
        )

    def snapped(self, points, steps):
        """Points moved, at their depth, to the nearest of some positions a pixel."""
        x, y, depth = self.places(points)
        x, y = (np.round(place * steps) / steps for place in (x, y))
        offset = self.on_plane(x, y) * (depth[..., None] if self.perspective else 1.0)
        return self.position + offset + depth[..., None] * self.forward


@dataclass
class Paint:
    """Colours and texture coordinates of vertices, and an image. Each may be missing."""

    faces: np.ndarray
    colors: np.ndarray | None = None
    coordinates: np.ndarray | None = None
    image: np.ndarray | None = None
    wrap: tuple = ("wrap", "wrap")
    """The wraps of u and of v, in the words of `numpy.pad`: ``wrap``, ``symmetric``, ``edge``."""
    order: int = 1
    """1: bilinear; 0: nearest."""
    alpha: np.ndarray | None = None
    """Alpha of vertices."""
    opacity: np.ndarray | None = None
    """Alpha of the image, of shape (height, width)."""
    cut: tuple = ()
    """Triangles with holes: a point is not seen if the product of both alphas is under 1/2."""

    def at(self, index, weights):
        """Albedo at points of a triangle, from barycentric coordinates of shape (..., 3)."""
        face, albedo = self.faces[index], np.ones(weights.shape)
        if self.colors is not None:
            albedo = albedo * (weights @ self.colors[face])
        if self.image is None:
            return albedo
        return albedo * self.texel(self.image, weights @ self.coordinates[face])

    def seen(self, index, weights):
        """Whether points of a triangle are seen."""
        face, alpha = self.faces[index], np.ones(weights.shape[:-1])
        if self.alpha is not None:
            alpha = weights @ self.alpha[face]
        if self.opacity is not None:
            alpha = alpha * self.texel(self.opacity[..., None], weights @ self.coordinates[face])[..., 0]
        return alpha >= 0.5

    def texel(self, image, place):
        """Channels of an image at points of shape (..., 2).

        The image is continued as far as the points go.
        """
        size = np.array(image.shape[1::-1])
        # Centres of texels are at whole numbers.
        x, y = np.moveaxis(place * size - 0.5, -1, 0)
        margin = 2 + int(np.ceil(max(-x.min(), -y.min(), x.max() - size[0], y.max() - size[1], 0)))
        whole = np.pad(image, ((0, 0), (margin, margin), (0, 0)), self.wrap[0])
        whole = np.pad(whole, ((margin, margin), (0, 0), (0, 0)), self.wrap[1])
        at = [y + margin, x + margin]
        channels = [map_coordinates(of, at, order=self.order) for of in np.moveaxis(whole, -1, 0)]
        return np.stack(channels, axis=-1)


@dataclass
class Picture:
    """The surface that the caster sees at every pixel; arrays of the picture's size."""

    color: np.ndarray
    cosine: np.ndarray
    hit: np.ndarray
    margin: np.ndarray
    """The smaller of two numbers: the least barycentric coordinate, and the relative distance to the next
    surface behind."""


def meet(view, corners, x, y):
    """Barycentric coordinates of shape (..., 3) and ray lengths where rays through pixels meet a plane."""
    origin, ray = view.rays(x, y)
    # By Moeller and Trumbore: origin + t ray = (1 - u - v) a + u b + v c.
    a, ab, ac = corners[0], corners[1] - corners[0], corners[2] - corners[0]
    p, s = np.cross(ray, ac), origin - a
    q, volume = np.cross(s, ab), p @ ab
    # A ray along the triangle's plane does not meet it.
    volume = np.where(volume == 0, np.nan, volume)
    u, v, t = (s * p).sum(axis=-1) / volume, (ray * q).sum(axis=-1) / volume, q @ ac / volume
    return np.stack([1 - u - v, u, v], axis=-1), t


def cast(
    vertices,
    faces,
    normals,
    view,
    light,
    coefficients,
    exponent,
    model,
    steps=None,
    f0=None,
    one_sided=(),
    paint=None,
    tinted=False,
    emission=(0.0, 0.0, 0.0),
):
    """Colours 0 to 255, not rounded, under one directional white light.

    ``coefficients`` are k_a, k_d and k_s, each of three channels. With ``steps``, corners are on a grid of so
    many positions a pixel. If a triangle is seen from behind, its normals are turned. Triangles of the
    indices ``one_sided`` are then not seen. With ``f0``, k_s is that of Fresnel's reflection by Schlick. A
    ``paint`` gives the surface an albedo. It also multiplies a ``tinted`` highlight.
    """
    shape = (view.height, view.width)
    depth, second = np.full(shape, np.inf), np.full(shape, np.inf)
    normal, inside, albedo = np.zeros((*shape, 3)), np.zeros(shape), np.ones((*shape, 3))
    for index, face in enumerate(np.asarray(faces)):
        corners = np.asarray(vertices, dtype=np.float64)[face]
        x, y, far = view.places(corners)
        first, last = np.zeros(2, dtype=int), np.array(shape)
        if far.min() > view.near:
            if steps:
                corners = view.snapped(corners, steps)
            first = np.maximum(np.floor([y.min(), x.min()]).astype(int) - 1, 0)
            last = np.minimum(np.ceil([y.max(), x.max()]).astype(int) + 2, shape)
        if far.max() < view.near or (last <= first).any():
            continue
        place = np.s_[first[0] : last[0], first[1] : last[1]]
        j, i = np.mgrid[place]
        weights, t = meet(view, corners, i + 0.5, j + 0.5)
        least = weights.min(axis=-1)
        hit = (least >= 0) & (t > view.near)
        _, ray = view.rays(i + 0.5, j + 0.5)
        from_behind = ray @ np.cross(corners[1] - corners[0], corners[2] - corners[0]) > 0
        if index in one_sided:
            hit &= ~from_behind
        if paint is not None and index in paint.cut and hit.any():
            hit[hit] = paint.seen(index, weights[hit])
        nearer = hit & (t < depth[place])
        second[place] = np.where(
            nearer, depth[place], np.where(hit, np.minimum(second[place], t), second[place])
        )
        depth[place] = np.where(nearer, t, depth[place])
        inside[place] = np.where(nearer, least, inside[place])
        towards = np.where(from_behind[..., None], -1.0, 1.0)
        own = unit(weights @ np.asarray(normals, dtype=np.float64)[face]) * towards
        normal[place] = np.where(nearer[..., None], own, normal[place])
        if paint is not None and nearer.any():
            albedo[place][nearer] = paint.at(index, weights[nearer])
    hit = np.isfinite(depth)
    to_light, to_viewer = unit(light), -view.forward
    cosine = normal @ to_light
    halfway = unit(to_light + to_viewer)
    highlight = normal @ halfway
    if model == "phong":
        highlight = (2 * cosine[..., None] * normal - to_light) @ to_viewer
    k_a, k_d, k_s = (np.asarray(k, dtype=np.float64) for k in coefficients)
    if f0 is not None:
        k_s = k_s * (f0 + (1 - np.asarray(f0)) * (1 - to_viewer @ halfway) ** 5)
    term = MODELS[model](highlight, exponent) * (cosine > 0)
    color = albedo * (k_a + k_d * np.maximum(cosine, 0)[..., None]) + emission
    color += (albedo if tinted else 1) * k_s * term[..., None]
    behind = np.where(np.isfinite(second), second, 2 * np.where(hit, depth, 1))
    margin = np.where(hit, np.minimum(inside, behind / np.where(hit, depth, 1) - 1), 0)
    return Picture(255 * np.clip(color, 0, 1), cosine, hit, margin)
