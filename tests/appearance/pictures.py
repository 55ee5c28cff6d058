"""Pictures of files by VTK, whose reader and renderer share no code with the project.

VTK's importer reads meshes, nodes, colours, texture coordinates and images. Its materials are approximate. It
has one wrap mode for both axes and no mirrored wrap. It does not reverse the winding under nodes that mirror.
So each actor is drawn without VTK's material, with colour and winding as glTF and OpenGL define them.

The shader discards fragments whose alpha is under a cutoff. The other fragments are opaque. For a file of
another format VTK draws what the sample says that the file shows.

VTK decodes texels from sRGB only if a texture has `UseSRGBColorSpace`. OpenGL then decodes them before it
filters. Products are linear light. VTK's frame buffer does not encode, so the last lines of the shader do.
"""

import os
from pathlib import Path

import numpy as np

from blysk.golden.frames.frame import background_code
from blysk.golden.reference.lighting import distant_cosine

CUT = """
  if (gl_FragData[0].a < %.9f) discard;
  gl_FragData[0].a = 1.0;
"""
"""A cutoff of alpha in GLSL."""

ENCODE = """
  vec3 light = clamp(gl_FragData[0].rgb, 0.0, 1.0);
  vec3 curve = 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055;
  gl_FragData[0].rgb = mix(12.92 * light, curve, greaterThan(light, vec3(0.0031308)));
"""
"""The curve of sRGB (IEC 61966-2-1) in GLSL."""


def drawn(source, scene, sampler=None, shifts=((0, 0),), lit=False, cutoff=0.0):
    """Pictures of a file by VTK's software renderer, with the camera of a scene.

    Parameters
    ----------
    source : Path or Shape
        A glTF file, or what a file of another format shows.
    scene : Scene
        The camera, the size and the background. If ``lit``, also the light and the coefficients.
    sampler : dict
        Sampler of the glTF file. VTK's importer does not keep all of it.
    shifts : sequence of two floats
        Pixels by which the camera moves to the right and up. Each shift gives a picture.
    lit : bool
        Whether to draw with light, by Phong's model. If not, each surface has its own colour.
    cutoff : float
        Fragments with a smaller alpha are dropped.

    Returns
    -------
    uint8 array, shape (pictures, height, width, 3)
    """
    os.environ["LP_NUM_THREADS"] = "0"
    os.environ["LIBGL_ALWAYS_SOFTWARE"] = "1"
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (chooses the window's class)
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkLogger, vtkUnsignedCharArray
    from vtkmodules.vtkIOImport import vtkGLTFImporter
    from vtkmodules.vtkRenderingCore import vtkLight, vtkRenderer, vtkRenderWindow

    # VTK would warn that there is no display.
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    renderer = vtkRenderer()
    renderer.SetBackground(background_code(scene, "srgb") / 255)
    renderer.SetAutomaticLightCreation(False)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(scene.width, scene.height)
    window.AddRenderer(renderer)
    if isinstance(source, Path):
        importer = vtkGLTFImporter()
        importer.SetFileName(str(source))
        importer.SetRenderWindow(window)
        importer.Update()
    else:
        renderer.AddActor(_actor(source))

    textures = []
    for actor in renderer.GetActors():
        texture = _plain(actor, sampler or {}, cutoff)
        textures += [] if texture is None else [texture]
        if lit:
            _shine(actor, scene)
    if lit:
        (light,) = scene.lights
        lamp = vtkLight()
        lamp.SetLightTypeToSceneLight()
        lamp.SetPositional(False)
        lamp.SetPosition(light.direction)
        lamp.SetFocalPoint(0, 0, 0)
        lamp.SetColor(light.color)
        renderer.AddLight(lamp)
    _look(renderer, scene, (0, 0))
    window.Render()
    for texture in textures:
        _wrap(texture, sampler or {})
    pixels, found = vtkUnsignedCharArray(), []
    for shift in shifts:
        _look(renderer, scene, shift)
        window.Render()
        window.GetPixelData(0, 0, scene.width - 1, scene.height - 1, 0, pixels, 0)
        # OpenGL's first row is the lowest.
        found.append(vtk_to_numpy(pixels).reshape(scene.height, scene.width, 3)[::-1].copy())
    return np.array(found)


def _actor(shape):
    """Triangles with colours of vertices, or with an image."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkImageData, vtkPolyData
    from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper, vtkTexture

    points, cells, data = vtkPoints(), vtkCellArray(), vtkPolyData()
    points.SetData(numpy_to_vtk(np.array(shape.vertices, np.float64), deep=True))
    for face in np.array(shape.faces).tolist():
        cells.InsertNextCell(3, face)
    data.SetPoints(points)
    data.SetPolys(cells)
    actor, mapper = vtkActor(), vtkPolyDataMapper()
    mapper.SetInputData(data)
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(shape.color)
    if shape.colors is not None:
        codes = np.rint(255 * np.array(shape.colors)).astype(np.uint8)
        data.GetPointData().SetScalars(numpy_to_vtk(codes, deep=True))
    if shape.image is not None:
        data.GetPointData().SetTCoords(numpy_to_vtk(np.array(shape.places, np.float32), deep=True))
        image, texture = vtkImageData(), vtkTexture()
        height, width, channels = shape.image.shape
        image.SetDimensions(width, height, 1)
        # VTK's first row is the lowest, and v = 0 is its border.
        rows = np.array(shape.image[::-1], np.uint8).reshape(-1, channels)
        image.GetPointData().SetScalars(numpy_to_vtk(rows, deep=True))
        texture.SetInputData(image)
        texture.SetUseSRGBColorSpace(True)
        actor.GetProperty().SetTexture("albedoTex", texture)
    return actor


def _plain(actor, sampler, cutoff):
    """Remove VTK's material from an actor, and keep its colour and texture.

    The result is the texture, or None.
    """
    from vtkmodules.vtkFiltersCore import vtkReverseSense

    surface = actor.GetProperty()
    texture = surface.GetTexture("albedoTex")
    surface.RemoveAllTextures()
    surface.SetInterpolationToPhong()
    surface.SetLighting(False)
    if actor.GetMatrix().Determinant() < 0:
        turned = vtkReverseSense()
        turned.SetInputData(actor.GetMapper().GetInput())
        turned.ReverseCellsOn()
        actor.GetMapper().SetInputConnection(turned.GetOutputPort())
    # These lines come after the texture, which multiplies light.
    code = CUT % cutoff + ENCODE
    actor.GetShaderProperty().AddFragmentShaderReplacement("//VTK::DepthPeeling::Impl", True, code, False)
    # Otherwise VTK draws an actor with alpha after all others, and does not test its depth.
    actor.ForceTranslucentOff()
    actor.ForceOpaqueOn()
    if texture is not None:
        texture.SetUseSRGBColorSpace(True)
        texture.SetInterpolate(sampler.get("magFilter", 9729) == 9729)
        texture.SetMipmap(sampler.get("minFilter", 9987) > 9729)
        actor.SetTexture(texture)
    return texture


def _wrap(texture, sampler):
    """Set the wrap modes of both axes; `vtkTexture` itself has only one."""
    wraps = {10497: "Repeat", 33648: "MirroredRepeat", 33071: "ClampToEdge"}
    made = texture.GetTextureObject()
    # Otherwise Mesa takes more samples, also of a magnified texture with levels.
    made.SetMaximumAnisotropicFiltering(1)
    for key, put in (("wrapS", made.SetWrapS), ("wrapT", made.SetWrapT)):
        put(getattr(made, wraps[sampler.get(key, 10497)]))


def _shine(actor, scene):
    """Set the coefficients of a scene's only material under one distant light."""
    material, (light,) = scene.materials[0], scene.lights
    reflection = material.reflection(distant_cosine(light, scene.camera.viewer))
    assert max(material.ambient + material.diffuse + tuple(reflection)) <= 1, "VTK limits colours"
    surface = actor.GetProperty()
    surface.SetLighting(True)
    surface.SetAmbientColor(material.ambient)
    surface.SetDiffuseColor(material.diffuse)
    surface.SetSpecularColor(reflection)
    surface.SetAmbient(1)
    surface.SetDiffuse(1)
    surface.SetSpecular(1)
    surface.SetSpecularPower(material.exponent)


def _look(renderer, scene, shift):
    """Place the camera of a scene, moved by pixels at the depth of its target."""
    given, camera = scene.camera, renderer.GetActiveCamera()
    right, up, _ = given.axes
    height = given.height
    if given.projection == "perspective":
        distance = np.linalg.norm(np.subtract(given.position, given.target))
        height = 2 * distance * np.tan(np.radians(given.field_of_view) / 2)
    else:
        # VTK takes V from each point to the camera, also in a parallel projection.
        distance = 1000 * height
    target = given.target + height / scene.height * (shift[0] * right + shift[1] * up)
    camera.SetPosition(target + distance * given.viewer)
    camera.SetFocalPoint(target)
    camera.SetViewUp(given.up)
    camera.SetParallelProjection(given.projection == "orthographic")
    camera.SetParallelScale(height / 2)
    camera.SetViewAngle(given.field_of_view)
    renderer.ResetCameraClippingRange()
