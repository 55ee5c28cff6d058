"""Images of mesh files: bytes of a picture file to a texture in linear light."""

import io
import warnings

import numpy as np
from PIL import Image, UnidentifiedImageError

from blysk.golden.reference.srgb import linear_of_srgb
from blysk.golden.reference.texture import LARGEST_TEXTURE, Texture
from blysk.sim.meshes.materials import Found
from blysk.sim.meshes.refusal import Refused, shown

__all__ = ["MAX_PIXELS", "load_texture"]

MAX_PIXELS = 1 << 26
"""Largest number of pixels of an image, 8192 x 8192."""

_FORMATS = ("PNG", "JPEG", "WEBP", "BMP", "TGA")
_REMEDY = "save the image again, as PNG or JPEG, or shade the mesh with one material"
_PADS = {"repeat": "wrap", "mirror": "symmetric", "clamp": "edge"}


def load_texture(
    data: bytes,
    name: str,
    found: Found,
    *,
    wrap: tuple[str, str] = ("repeat", "repeat"),
    filter: str = "bilinear",
    mipmapped: bool = True,
    opaque: bool = False,
) -> Texture:
    """Texture of an image: PNG, JPEG, WebP, BMP or TGA.

    Codes of 8 bits are read by the curve of sRGB. Colour profiles and orientations (EXIF) do not count.

    A side that is no power of two, or over `LARGEST_TEXTURE`, is resampled in linear light. Its new size is
    the power of two with the nearest logarithm. The sizes of resampled images are told. Alpha is told, too,
    and so are frames after the first.

    Parameters
    ----------
    data : bytes
        The picture file.
    name : str
        Its name in messages.
    found : Found
        Is told what is not read.
    wrap, filter, mipmapped
        See `Texture`. The texels that a resampled border needs follow from ``wrap``. An image for ``nearest``
        is resampled without colours between neighbours where the size grows.
    opaque : bool
        Whether the material leaves out the alpha anyway, which then is not told.

    Raises
    ------
    Refused
        In one of these cases:

        - the data are empty, cut short, damaged or no image of these kinds;
        - the image has no pixels, or more than `MAX_PIXELS`;
        - it has 16 bits a channel, or channels other than grey, red, green, blue and alpha.
    """
    what = f"its image {shown(name)!r}"
    if not data:
        raise Refused(f"{what} is empty", _REMEDY)
    image, unread = _decoded(data, what)
    for kind in unread:
        if not (kind == "alpha" and opaque):
            found.tell_names(f"{kind} of images", [name])
    size = tuple(min(1 << round(float(np.log2(side))), LARGEST_TEXTURE) for side in image.size)
    decode = linear_of_srgb(np.arange(256) / 255)
    if image.size == size:
        texels = decode[np.asarray(image)]
    else:
        texels = np.stack(
            [_resampled(np.asarray(image.getchannel(c)), decode, size, wrap, filter) for c in "RGB"], axis=-1
        )
        of, to = (f"{width} x {height}" for width, height in (image.size, size))
        found.tell_names("sizes of images", [f"{of} (resampled to {to}) of {name}"])
    return Texture(texels, wrap, filter, mipmapped)


def _decoded(data: bytes, what: str) -> tuple[Image.Image, list[str]]:
    """The image as RGB, by Pillow, and what else it has. Pillow's warnings stay away from the user."""
    unread = []
    kinds = ", ".join(_FORMATS)
    many = Refused(f"{what} has over {MAX_PIXELS:,} pixels", _REMEDY)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        try:
            image = Image.open(io.BytesIO(data), formats=_FORMATS)
            width, height = image.size
            if width * height > MAX_PIXELS:
                raise many
            if not width * height:
                raise Refused(f"{what} has no pixels", _REMEDY)
            if image.format == "PNG" and data[24] == 16:
                raise Refused(f"{what} has 16 bits a channel, and only 8 are read", _REMEDY)
            if image.mode not in ("1", "L", "LA", "P", "PA", "RGB", "RGBA"):
                raise Refused(f"{what} has colours of the kind {image.mode}, not RGB", _REMEDY)
            # Checksums, after which the image has to be opened again.
            image.verify()
            image = Image.open(io.BytesIO(data), formats=_FORMATS)
            if getattr(image, "n_frames", 1) > 1:
                unread.append("frames after the first")
            if image.has_transparency_data:
                image = image.convert("RGBA")
                if image.getchannel("A").getextrema()[0] < 255:
                    unread.append("alpha")
            return image.convert("RGB"), unread
        except Refused:
            raise
        except (Image.DecompressionBombWarning, Image.DecompressionBombError):
            raise many from None
        except UnidentifiedImageError:
            raise Refused(f"{what} is damaged, or none of the kinds {kinds}", _REMEDY) from None
        # Pillow raises whatever a damaged image makes it trip over.
        except Exception as error:
            said = f" ({shown(str(error))})" if str(error) else ""
            raise Refused(f"{what} is damaged{said}", _REMEDY) from error


def _resampled(
    channel: np.ndarray, decode: np.ndarray, size: tuple[int, ...], wrap: tuple[str, str], filter: str
) -> np.ndarray:
    """A channel of codes in linear light at another size. A whole ratio takes means, as levels do."""
    old = channel.shape[::-1]
    # Twice as many texels as a filter reaches beyond the border.
    pad = [2 + 2 * -(-before // after) for before, after in zip(old, size, strict=True)]
    for axis, count, mode in zip((1, 0), pad, wrap, strict=True):
        counts = [(0, 0), (0, 0)]
        counts[axis] = (count, count)
        channel = np.pad(channel, counts, mode=_PADS[mode])
    whole = all(before % after == 0 for before, after in zip(old, size, strict=True))
    kind = Image.Resampling.BOX if whole or filter == "nearest" else Image.Resampling.BILINEAR
    box = (pad[0], pad[1], pad[0] + old[0], pad[1] + old[1])
    made = Image.fromarray(decode.astype(np.float32)[channel]).resize(size, kind, box)
    return np.clip(np.asarray(made, dtype=np.float64), 0, 1)
