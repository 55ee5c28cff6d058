"""Mesa's OpenGL on the processor (llvmpipe) as a judge of coverage, depth order and colours.

It takes plain arrays and imports nothing of blysk. Corners are places in a picture in steps of 1/256 pixel,
from its upper left, y downwards. In a framebuffer object the rows of a picture keep their order, so window
coordinates are these places. Fragment programs compute in float32, without functions that Mesa approximates.
"""

from dataclasses import dataclass

import numpy as np
import pytest

STEPS = 256
SRGB_CODES, SRGB_TEXELS, ENCODES = 0x8C43, 0x8C41, 0x8DB9
"""OpenGL's SRGB8_ALPHA8, SRGB8 and FRAMEBUFFER_SRGB."""
MISSING = "no OpenGL by EGL: install the extra `judges`, and Debian's libegl1, libgl1 and libgl1-mesa-dri"

COVER = (
    """
#version 330
in vec2 place;
in float tag;
flat out float own;
uniform vec2 half_size;
void main() {
    own = tag;
    gl_Position = vec4(place / half_size - 1.0, 0.0, 1.0);
}
""",
    """
#version 330
flat in float own;
out vec2 found;
void main() { found = vec2(1.0, own); }
""",
)

SHADE = (
    """
#version 330
in vec4 place;
in vec3 normal;
in vec2 texel;
in float face;
out vec3 smooth_normal;
out vec2 at;
flat out float own;
void main() {
    smooth_normal = normal;
    at = texel;
    own = face;
    gl_Position = place;
}
""",
    """
#version 330
in vec3 smooth_normal;
in vec2 at;
flat in float own;
layout(location = 0) out vec4 color;
layout(location = 1) out vec2 told;
uniform vec3 light, viewer, ambient, diffuse, specular;
uniform int exponent;
uniform bool mirror;
uniform ivec2 size;
uniform sampler2D image;

float power(float base, int n) {
    float found = 1.0;
    while (n > 0) {
        if ((n & 1) == 1) found *= base;
        base *= base;
        n >>= 1;
    }
    return found;
}

vec3 texel_at(ivec2 place) {
    return texelFetch(image, ivec2(mod(vec2(place), vec2(size))), 0).rgb;
}

// Bilinear, repeated: centres of texels are at whole numbers.
vec3 albedo() {
    if (size.x == 0) return vec3(1.0);
    vec2 place = at * vec2(size) - 0.5;
    ivec2 whole = ivec2(floor(place));
    vec2 part = place - vec2(whole);
    vec3 above = mix(texel_at(whole), texel_at(whole + ivec2(1, 0)), part.x);
    vec3 below = mix(texel_at(whole + ivec2(0, 1)), texel_at(whole + ivec2(1, 1)), part.x);
    return mix(above, below, part.y);
}

void main() {
    vec3 n = smooth_normal / sqrt(dot(smooth_normal, smooth_normal));
    if (!gl_FrontFacing) n = -n;
    float lit = dot(n, light);
    vec3 halfway = (light + viewer) / sqrt(dot(light + viewer, light + viewer));
    float cosine = mirror ? dot(2.0 * lit * n - light, viewer) : dot(n, halfway);
    float term = lit > 0.0 && cosine > 0.0 ? power(cosine, exponent) : 0.0;
    vec3 sum = albedo() * (ambient + diffuse * max(lit, 0.0)) + specular * term;
    color = vec4(clamp(sum, 0.0, 1.0), 1.0);
    told = vec2(own, lit);
}
""",
)


@dataclass
class Look:
    """Light and material of a picture; vectors are unit vectors."""

    light: tuple
    viewer: tuple
    ambient: tuple
    diffuse: tuple
    specular: tuple
    exponent: int
    mirror: bool = False
    """Whether the highlight is (R·V)^n in place of (N·H)^n."""
    image: np.ndarray | None = None
    """Texels, shape (rows, columns, 3): linear light, or uint8 codes of sRGB, which OpenGL decodes."""


class Conformant:
    """A context of OpenGL without a window."""

    def __init__(self, context):
        self.context = context
        self.cover, self.shade = (
            context.program(vertex_shader=vertex, fragment_shader=fragment)
            for vertex, fragment in (COVER, SHADE)
        )
        # Rows go down, so a front face is clockwise in window coordinates.
        context.front_face = "cw"

    @classmethod
    def opened(cls, monkeypatch):
        """The judge. The test is skipped where there is none."""
        monkeypatch.setenv("LIBGL_ALWAYS_SOFTWARE", "1")
        monkeypatch.setenv("GALLIUM_DRIVER", "llvmpipe")
        monkeypatch.setenv("EGL_PLATFORM", "surfaceless")
        moderngl = pytest.importorskip("moderngl", reason=MISSING)
        try:
            return cls(
                moderngl.create_standalone_context(
                    require=330, backend="egl", libgl="libGL.so.1", libegl="libEGL.so.1"
                )
            )
        # The library raises plain exceptions.
        except Exception as error:
            pytest.skip(f"{MISSING} ({error})")

    def coverage(self, corners, tags, size) -> np.ndarray:
        """Number of triangles that cover each pixel, and the sum of their tags, shape (2, rows, columns).

        Parameters
        ----------
        corners : int array, shape (T, 3, 2)
            Corners in steps.
        tags : int array, shape (T,)
            Tags. Sums are exact below 2^24.
        size : two ints
            Columns and rows.
        """
        context = self.context
        place = np.repeat(np.asarray(tags, dtype=np.float64), 3)[:, np.newaxis]
        beats = np.concatenate([np.reshape(corners, (-1, 2)) / STEPS, place], axis=1).astype("f4")
        buffer, texture = context.buffer(beats), context.texture(size, 2, dtype="f4")
        frame = context.framebuffer([texture])
        array = context.vertex_array(self.cover, [(buffer, "2f 1f", "place", "tag")])
        frame.use()
        context.viewport = (0, 0, *size)
        context.clear()
        context.disable(context.DEPTH_TEST)
        context.enable(context.BLEND)
        context.blend_func = context.ONE, context.ONE
        self.cover["half_size"] = size[0] / 2, size[1] / 2
        array.render(context.TRIANGLES)
        found = np.frombuffer(texture.read(), "f4").reshape(size[1], size[0], 2)
        context.disable(context.BLEND)
        for one in (array, frame, texture, buffer):
            one.release()
        return np.moveaxis(found, -1, 0).astype(np.int64)

    def picture(self, places, w, nearness, normals, look, size, coordinates=None, encoded=False):
        """Colours 0 to 1 of the nearest triangles, their indices and N·L, at every pixel.

        OpenGL clips triangles at its borders, and rounds the corners of a cut. This moves edges by up to a
        step. So the judge draws a larger picture that holds every corner, and the middle is returned.

        Parameters
        ----------
        places : float array, shape (T, 3, 2)
            Corners in pixels.
        w, nearness : float arrays, shape (T, 3)
            W, and a number from 0 to 1 that is linear on the screen and larger if nearer.
        normals : float array, shape (T, 3, 3)
            Normals of the corners.
        look : Look
            Light and material.
        size : two ints
            Columns and rows.
        coordinates : float array, shape (T, 3, 2), optional
            Texture coordinates.
        encoded : bool
            Whether the frame buffer has 8-bit codes of sRGB, which OpenGL encodes and rounds. Colours are
            then these codes over 255.

        Returns
        -------
        color : float64 array, shape (rows, columns, 3)
        face : int64 array, shape (rows, columns)
            Index of the triangle, or -1.
        lit : float64 array, shape (rows, columns)
        """
        context = self.context
        if coordinates is None:
            coordinates = np.zeros((*np.shape(w), 2))
        size = np.array(size)
        margin = int(np.ceil(max(-places.min(), (places - size).max(), 0)))
        middle = np.s_[margin : margin + size[1], margin : margin + size[0]]
        size, places = tuple((size + 2 * margin).tolist()), places + margin
        depth = 1 - 2 * np.asarray(nearness)
        clip = np.concatenate([2 * places / size - 1, depth[..., np.newaxis]], axis=-1)
        clip = np.concatenate([clip, np.ones((*w.shape, 1))], axis=-1) * w[..., np.newaxis]
        face = np.broadcast_to(np.arange(len(w))[:, np.newaxis, np.newaxis], (*w.shape, 1))
        beats = np.concatenate([clip, normals, coordinates, face], axis=-1).astype("f4")
        buffer = context.buffer(np.ascontiguousarray(beats))
        array = context.vertex_array(
            self.shade, [(buffer, "4f 3f 2f 1f", "place", "normal", "texel", "face")]
        )
        kind = {"dtype": "f1", "internal_format": SRGB_CODES} if encoded else {"dtype": "f4"}
        textures = [context.texture(size, 4, **kind), context.texture(size, 2, dtype="f4")]
        frame = context.framebuffer(textures, context.depth_texture(size))
        image = self._set(look)
        frame.use()
        context.viewport = (0, 0, *size)
        context.clear(-1.0, -1.0, -1.0, -1.0, depth=1.0)
        context.enable(context.DEPTH_TEST)
        (context.enable_direct if encoded else context.disable_direct)(ENCODES)
        array.render(context.TRIANGLES)
        color, told = (
            np.frombuffer(of.read(), of.dtype.replace("f1", "u1"))
            .reshape(size[1], size[0], -1)[middle]
            .astype(np.float64)
            for of in textures
        )
        for one in (array, frame, *textures, buffer, *image):
            one.release()
        color = color[..., :3] / (255 if encoded else 1)
        return color, told[..., 0].astype(np.int64), told[..., 1]

    def _set(self, look):
        """Set the values of the program. Returns the texture, if there is any."""
        for name in ("light", "viewer", "ambient", "diffuse", "specular", "exponent", "mirror"):
            self.shade[name] = getattr(look, name)
        if look.image is None:
            self.shade["size"] = 0, 0
            return []
        rows, columns = look.image.shape[:2]
        self.shade["size"] = columns, rows
        kind = {"dtype": "f4"}
        if look.image.dtype == np.uint8:
            kind = {"dtype": "f1", "internal_format": SRGB_TEXELS}
        texels = look.image.astype(kind["dtype"].replace("f1", "u1")).tobytes()
        image = self.context.texture((columns, rows), 3, texels, **kind)
        image.use()
        return [image]
