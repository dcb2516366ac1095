# Opens this run in ParaView 5.10 or later, coloured and lit: File > Load State…, or `paraview --script=open_in_paraview.py`.
# `pvbatch open_in_paraview.py picture.png` saves a picture of the last instant.
import os
import sys

from paraview.simple import (
    Box, ColorBy, GetActiveViewOrCreate, GetAnimationScene, GetColorTransferFunction, GetScalarBar, Hide, PVDReader,
    Render, ResetCamera, SaveScreenshot, Show, XMLPolyDataReader,
)

RADIUS = {radius}  # half the spacing of the particles, m
FASTEST = {fastest}  # the end of the colours, m/s
LOW, HIGH = {low}, {high}  # the corners of the box, m
FOLDER = {folder}  # where the run was written; a folder that was moved is found beside this file

folder = os.path.dirname(os.path.abspath(__file__)) if "__file__" in globals() else FOLDER


def find(*names):
    """The path of a file of the run; None if it has none."""
    path = os.path.join(folder, *names)
    return path if os.path.isfile(path) else None


view = GetActiveViewOrCreate("RenderView")
view.UseColorPaletteForBackground = 0
view.Background = [0.96, 0.96, 0.97]
view.OrientationAxesLabelColor = [0.1, 0.1, 0.1]

particles = PVDReader(registrationName="particles", FileName=find("particles.pvd"))
balls = Show(particles, view)
balls.SetRepresentationType("Point Gaussian")
balls.ShaderPreset = "Sphere"
balls.GaussianRadius = RADIUS
ColorBy(balls, ("POINTS", "speed"))
colours = GetColorTransferFunction("speed")
colours.AutomaticRescaleRangeMode = "Never"
colours.ColorSpace = "RGB"
stops = [(0x2C, 0x62, 0xBC), (0x6C, 0xB0, 0xE2), (0xFA, 0xDA, 0x58), (0xF0, 0x80, 0x2E), (0xBE, 0x18, 0x22)]
colours.RGBPoints = [x for k, rgb in enumerate(stops) for x in [FASTEST * k / 4, *(c / 255 for c in rgb)]]
bar = GetScalarBar(colours, view)
bar.Title, bar.ComponentTitle = "speed, m/s", ""
bar.TitleColor = bar.LabelColor = [0.1, 0.1, 0.1]
bar.TitleFontSize, bar.LabelFontSize, bar.ScalarBarThickness = 14, 12, 12
bar.RangeLabelFormat = "%-.3g"
balls.SetScalarBarVisibility(view, True)

moving, still, surface = find("obstacle.pvd"), find("obstacle.vtp"), find("surface", "surface.pvd")
if moving or still:
    if moving:
        obstacle = PVDReader(registrationName="obstacles", FileName=moving)
    else:
        obstacle = XMLPolyDataReader(registrationName="obstacles", FileName=[still])
    stone = Show(obstacle, view)
    stone.ColorArrayName = [None, ""]
    stone.AmbientColor = stone.DiffuseColor = [0.72, 0.72, 0.74]
    stone.Specular = 0.2
if surface:
    water = Show(PVDReader(registrationName="surface of the fluid", FileName=surface), view)
    water.ColorArrayName = [None, ""]
    water.AmbientColor = water.DiffuseColor = [0.36, 0.6, 0.86]
    water.Opacity, water.Specular = 0.55, 0.6
    Hide(particles, view)
    balls.SetScalarBarVisibility(view, False)

box = Box(registrationName="box", Center=[(a + b) / 2 for a, b in zip(LOW, HIGH)])
box.XLength, box.YLength, box.ZLength = [b - a for a, b in zip(LOW, HIGH)]
edges = Show(box, view)
edges.SetRepresentationType("Outline")
edges.AmbientColor = edges.DiffuseColor = [0.4, 0.45, 0.5]

centre, size = box.Center, max(b - a for a, b in zip(LOW, HIGH))
view.CameraFocalPoint = list(centre)
view.CameraPosition = [c + 2 * size * d for c, d in zip(centre, [0.48, -1, 0.46])]
view.CameraViewUp = [0, 0, 1]
scene = GetAnimationScene()
scene.UpdateAnimationUsingDataTimeSteps()
picture = sys.argv[-1] if sys.argv and sys.argv[-1].endswith(".png") else None
if picture:
    view.ViewSize = [1280, 720]
    scene.GoToLast()
ResetCamera(view)
Render(view)
if picture:
    SaveScreenshot(picture, view)
