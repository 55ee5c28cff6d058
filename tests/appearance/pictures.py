"""Pictures of glTF files by VTK, whose reader and renderer share no code with the project.

VTK's importer reads meshes, nodes, colours, texture coordinates and images. Its materials are approximate. It
has a wrap mode for both axes, none that mirrors, and no reversed winding under nodes that mirror. So each
actor is drawn without VTK's material, as glTF and OpenGL define colour and winding.

VTK decodes texels from sRGB only where a texture has `UseSRGBColorSpace`. OpenGL then decodes them before it
filters. Products are linear light. VTK's frame buffer does not encode: the last line of the shader does.
"""

import os

import numpy as np

from blysk.golden.frames.frame import background_code
from blysk.golden.reference.lighting import distant_cosine

ENCODE = """
  vec3 light = clamp(gl_FragData[0].rgb, 0.0, 1.0);
  vec3 curve = 1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055;
  gl_FragData[0].rgb = mix(12.92 * light, curve, greaterThan(light, vec3(0.0031308)));
"""
"""The curve of sRGB (IEC 61966-2-1) in GLSL."""


def drawn(path, scene, sampler=None, shifts=((0, 0),), lit=False):
    """Pictures of a file by VTK's software renderer, with the camera of a scene.

    Parameters
    ----------
    path : Path
        A glTF file.
    scene : Scene
        The camera, the size and the background. If ``lit``, also the light and the coefficients.
    sampler : dict
        Of glTF: VTK's importer does not keep all of it.
    shifts : sequence of two floats
        One picture for each: by how many pixels the camera moves to the right and up.
    lit : bool
        Whether to draw with light, by Phong's model. If not, each surface has its own colour.

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
    importer = vtkGLTFImporter()
    importer.SetFileName(str(path))
    importer.SetRenderWindow(window)
    importer.Update()

    textures = []
    for actor in renderer.GetActors():
        texture = _plain(actor, sampler or {})
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


def _plain(actor, sampler):
    """Take VTK's material from an actor, and keep its colour and texture; the texture, or None."""
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
    # After the texture, which multiplies light.
    actor.GetShaderProperty().AddFragmentShaderReplacement("//VTK::DepthPeeling::Impl", True, ENCODE, False)
    if texture is not None:
        texture.SetUseSRGBColorSpace(True)
        texture.SetInterpolate(sampler.get("magFilter", 9729) == 9729)
        texture.SetMipmap(sampler.get("minFilter", 9987) > 9729)
        actor.SetTexture(texture)
    return texture


def _wrap(texture, sampler):
    """Wrap modes of both axes, of which `vtkTexture` itself has one."""
    wraps = {10497: "Repeat", 33648: "MirroredRepeat", 33071: "ClampToEdge"}
    made = texture.GetTextureObject()
    # Else Mesa takes more samples, also of a magnified texture with levels.
    made.SetMaximumAnisotropicFiltering(1)
    for key, put in (("wrapS", made.SetWrapS), ("wrapT", made.SetWrapT)):
        put(getattr(made, wraps[sampler.get(key, 10497)]))


def _shine(actor, scene):
    """Coefficients of a scene's one material under one distant light."""
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
