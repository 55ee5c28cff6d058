"""Times and memory of the golden renderer, and pictures by VTK's software renderer."""

import os
import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from blysk.golden.reference.camera import Camera
from blysk.golden.reference.lighting import Light, Material
from blysk.golden.reference.reflection import REFLECTION_MODELS
from blysk.golden.reference.renderer import ExactFrame, render
from blysk.golden.reference.scene import Scene
from blysk.sim.meshes.teapot import teapot

__all__ = ["GoldenTimes", "Timing", "golden_times", "scene_for", "timed", "vtk_image"]


@dataclass(frozen=True)
class Timing:
    """The fastest of several runs.

    Parameters
    ----------
    wall : float
        Wall-clock seconds.
    cpu : float
        Processor seconds of all threads of the process in this run.
    """

    wall: float
    cpu: float

    @property
    def one_core(self) -> float:
        """Seconds of the run if its threads share one core: the larger of both times."""
        return max(self.wall, self.cpu)


def timed(action: Callable[[], Any], repeats: int) -> tuple[Timing, Any]:
    """Fastest of several runs, by `Timing.one_core`, and the last result.

    Parameters
    ----------
    action : callable
        Function to run.
    repeats : int
        Number of runs, at least 1.
    """
    timings = []
    for _ in range(repeats):
        wall, cpu = time.perf_counter(), time.process_time()
        result = action()
        timings.append(Timing(time.perf_counter() - wall, time.process_time() - cpu))
    return min(timings, key=lambda timing: timing.one_core), result


def scene_for(triangles: int, width: int, height: int) -> Scene:
    """A teapot under one light. The projection is orthographic, so the direction to the viewer is constant.

    Parameters
    ----------
    triangles : int
        Approximate number of triangles of the teapot.
    width, height : int
        The picture in pixels.
    """
    mesh = teapot(triangles=triangles)
    camera = Camera.framing(mesh.vertices, (0.3, 0.5, 1), "orthographic", width / height)
    material = Material((0.1, 0.1, 0.1), (0.6, 0.3, 0.2), (0.5, 0.5, 0.5), 40)
    return Scene(mesh, camera, width, height, material, (Light((1, 1, 1)),))


def vtk_image(scene: Scene) -> tuple[Callable[[], np.ndarray], str]:
    """A function that draws a scene in VTK's software renderer (Mesa's llvmpipe, in one thread).

    Parameters
    ----------
    scene : Scene
        An orthographic scene with one light, coloured in `Material.diffuse` only.

    Returns
    -------
    draw : callable
        Draws a frame and reads it back as a uint8 array, shape (height, width, 3).
    name : str
        Name of the driver, as OpenGL gives it.
    """
    # Mesa reads these variables when it is loaded. With 0 threads llvmpipe draws in the calling thread.
    os.environ["LP_NUM_THREADS"] = "0"
    os.environ["LIBGL_ALWAYS_SOFTWARE"] = "1"
    import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (chooses the window's class)
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkLogger, vtkPoints, vtkUnsignedCharArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkRenderingCore import (
        vtkActor,
        vtkLight,
        vtkPolyDataMapper,
        vtkRenderer,
        vtkRenderWindow,
    )

    # VTK would warn that there is no display.
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.ascontiguousarray(scene.mesh.vertices), deep=True))
    cells = vtkCellArray()
    count = len(scene.mesh.faces)
    cells.SetData(
        numpy_to_vtkIdTypeArray(np.arange(0, 3 * count + 1, 3), deep=True),
        numpy_to_vtkIdTypeArray(np.ascontiguousarray(scene.mesh.faces).reshape(-1), deep=True),
    )
    surface = vtkPolyData()
    surface.SetPoints(points)
    surface.SetPolys(cells)
    surface.GetPointData().SetNormals(numpy_to_vtk(np.ascontiguousarray(scene.mesh.normals), deep=True))
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(surface)
    actor = vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetInterpolationToPhong()
    look.SetAmbientColor(scene.material.ambient)
    look.SetDiffuseColor(scene.material.diffuse)
    look.SetSpecularColor(scene.material.specular)
    look.SetAmbient(1)
    look.SetDiffuse(1)
    look.SetSpecular(1)
    look.SetSpecularPower(scene.material.exponent)

    renderer = vtkRenderer()
    renderer.SetBackground(scene.background)
    renderer.SetAutomaticLightCreation(False)
    renderer.SetTwoSidedLighting(True)
    renderer.AddActor(actor)
    (light,) = scene.lights
    lamp = vtkLight()
    lamp.SetLightTypeToSceneLight()
    lamp.SetPositional(False)
    lamp.SetPosition(light.direction)
    lamp.SetFocalPoint(0, 0, 0)
    lamp.SetColor(light.color)
    renderer.AddLight(lamp)
    camera = renderer.GetActiveCamera()
    # Even in a parallel projection VTK takes the direction to the viewer from each point to the camera. With
    # the camera far away the direction is nearly constant, and the picture is the same.
    camera.SetPosition(scene.camera.target + 1000 * scene.camera.height * scene.camera.viewer)
    camera.SetFocalPoint(scene.camera.target)
    camera.SetViewUp(scene.camera.up)
    camera.SetParallelProjection(True)
    camera.SetParallelScale(scene.camera.height / 2)
    renderer.ResetCameraClippingRange()

    window = vtkRenderWindow()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(0)
    window.SetSize(scene.width, scene.height)
    window.AddRenderer(renderer)
    pixels = vtkUnsignedCharArray()

    def draw() -> np.ndarray:
        window.Render()
        window.GetPixelData(0, 0, scene.width - 1, scene.height - 1, 0, pixels, 0)
        # OpenGL's first row is the lowest.
        return vtk_to_numpy(pixels).reshape(scene.height, scene.width, 3)[::-1].copy()

    draw()
    lines = window.ReportCapabilities().splitlines()
    name = next((line.partition(":")[2].strip() for line in lines if "renderer string" in line), "unknown")
    return draw, name


class GoldenTimes(NamedTuple):
    """Measurements of the golden renderer: timings by model, last frame, peak memory in bytes."""

    timings: dict[str, Timing]
    frame: ExactFrame
    memory: int


def golden_times(triangles: int, width: int, height: int, repeats: int) -> GoldenTimes:
    """Measure the golden renderer in this process, whose peak memory includes its imports."""
    scene = scene_for(triangles, width, height)
    timings = {}
    for model in ("blinn", "phong"):
        timings[model], frame = timed(
            lambda model=model: render(scene, "phong", REFLECTION_MODELS[model]), repeats
        )
    return GoldenTimes(timings, frame, _peak_memory())


def _peak_memory() -> int:
    """Peak memory of this process in bytes."""
    status = Path("/proc/self/status")
    if status.exists():
        # On Linux `ru_maxrss` of a child process includes the memory of its parent.
        fields = dict(line.split(":", 1) for line in status.read_text().splitlines())
        return int(fields["VmHWM"].split()[0]) * 1024
    # macOS counts in bytes, others in KiB.
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
