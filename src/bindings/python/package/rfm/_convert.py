"""Meshes for other packages, which need not be installed."""


def _package(name):
    try:
        return __import__(name)
    except ImportError as error:
        raise ImportError(f"this needs the package {name}: pip install {name}") from error


def to_trimesh(mesh):
    trimesh = _package("trimesh")
    # vertices are shared already, and merging them would change their order
    return trimesh.Trimesh(
        vertices=mesh.vertices.copy(),
        faces=mesh.triangles.astype("i8"),
        vertex_normals=mesh.normals.copy(),
        process=False,
    )


def to_pyvista(mesh):
    pyvista = _package("pyvista")
    import numpy

    faces = numpy.empty((len(mesh.triangles), 4), dtype="i8")
    faces[:, 0] = 3
    faces[:, 1:] = mesh.triangles
    surface = pyvista.PolyData(mesh.vertices.copy(), faces.ravel())
    surface.point_data["Normals"] = mesh.normals.copy()
    return surface


def to_meshio(mesh):
    meshio = _package("meshio")
    return meshio.Mesh(
        mesh.vertices.copy(),
        [("triangle", mesh.triangles.astype("i8"))],
        point_data={"normals": mesh.normals.copy()},
    )
