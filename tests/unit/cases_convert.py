"""Meshes of other programs: what meshio writes in each format comes back with its sets."""

import sys
import tempfile
import unittest
from pathlib import Path

import meshio
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "cases"))

from meshing import quality  # noqa: E402
from meshing.blocks import make_box_hex  # noqa: E402
from meshing.convert import convert  # noqa: E402
from meshing.mesh_file import MeshError  # noqa: E402
from meshing.surfaces import make_orbit_block, make_sphere_surface  # noqa: E402

BLOCK = make_box_hex((0, 0, 0), (1, 2, 3), (2, 3, 4), "steel")
LOWER = np.flatnonzero(BLOCK.nodes[BLOCK.cells["hex8"]].mean(axis=1)[:, 2] < 1.5)
UPPER = np.setdiff1d(np.arange(24), LOWER)


class ConvertTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def written(self, name: str, mesh: meshio.Mesh, **options) -> Path:
        file = Path(self.folder.name) / name
        meshio.write(file, mesh, **options)
        return file

    def assert_is_block(self, mesh, scale: float = 1.0) -> None:
        self.assertEqual(len(mesh.cells["hex8"]), 24)
        volume = quality.hex_volumes(mesh.nodes, mesh.cells["hex8"]).sum()
        self.assertAlmostEqual(volume / scale**3, 6.0, delta=1e-9)
        wet = quality.SurfaceFigures(mesh.nodes, mesh.face_sets["wet"])
        self.assertTrue(wet.closed and wet.outward)

    def test_gmsh_physical_groups_become_tissues_and_face_sets(self):
        quads = BLOCK.face_sets["x_max"][:, ::-1]  # inward on purpose: the reader turns them
        tags = np.full(24, 1)
        tags[UPPER] = 2
        source = meshio.Mesh(
            BLOCK.nodes, [("hexahedron", BLOCK.cells["hex8"]), ("quad", quads)],
            cell_data={"gmsh:physical": [tags, np.full(len(quads), 7)],
                       "gmsh:geometrical": [tags, np.full(len(quads), 7)]},
            field_data={"lower": np.array([1, 3]), "upper": np.array([2, 3]),
                        "loaded": np.array([7, 2])},
        )
        mesh = convert(self.written("b.msh", source, file_format="gmsh22", binary=False), "mm")
        self.assert_is_block(mesh, 1e-3)
        self.assertEqual(sorted(mesh.tissues), ["lower", "upper"])
        self.assertEqual(len(mesh.cells_of("lower")), len(LOWER))
        loaded = mesh.face_sets["loaded"]
        corner = mesh.nodes[loaded]
        normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
        self.assertTrue((normal[:, 0] > 0).all())

    def test_gmsh_41_of_gmsh_itself_is_read(self):
        try:
            import gmsh
        except ImportError:
            self.skipTest("python3-gmsh is not installed")
        file = str(Path(self.folder.name) / "box.msh")
        gmsh.initialize()
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
            gmsh.model.occ.synchronize()
            gmsh.model.setPhysicalName(3, gmsh.model.addPhysicalGroup(3, [1]), "fat")
            gmsh.model.setPhysicalName(2, gmsh.model.addPhysicalGroup(2, [1]), "held")
            gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
            gmsh.model.mesh.generate(3)
            gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
            gmsh.write(file)
        finally:
            gmsh.finalize()
        mesh = convert(Path(file), "m")
        self.assertEqual(mesh.tissues, ["fat"])
        self.assertAlmostEqual(quality.tet_volumes(mesh.nodes, mesh.cells["tet4"]).sum(), 1.0, delta=1e-12)
        self.assertGreater(len(mesh.face_sets["held"]), 0)
        self.assertTrue(quality.SurfaceFigures(mesh.nodes, mesh.face_sets["wet"]).closed)

    def test_abaqus_sets_survive(self):
        source = meshio.Mesh(
            BLOCK.nodes, [("hexahedron", BLOCK.cells["hex8"])],
            cell_sets={"lower": [LOWER], "upper": [UPPER]},
            point_sets={"held": BLOCK.node_sets["z_min"]},
        )
        mesh = convert(self.written("b.inp", source))
        self.assert_is_block(mesh)
        np.testing.assert_array_equal(mesh.node_sets["held"], BLOCK.node_sets["z_min"])
        self.assertEqual(len(mesh.cells_of("upper")), len(UPPER))

    def test_exodus_is_read(self):
        source = meshio.Mesh(BLOCK.nodes, [("hexahedron", BLOCK.cells["hex8"])],
                             point_sets={"held": BLOCK.node_sets["z_min"]})
        mesh = convert(self.written("b.e", source))
        self.assert_is_block(mesh)
        self.assertEqual(len(mesh.node_sets["held"]), len(BLOCK.node_sets["z_min"]))

    def test_vtu_tissue_field_is_read(self):
        tissue = np.zeros(24, dtype=int)
        tissue[UPPER] = 5
        source = meshio.Mesh(BLOCK.nodes, [("hexahedron", BLOCK.cells["hex8"])],
                             cell_data={"tissue": [tissue]})
        mesh = convert(self.written("b.vtu", source))
        self.assert_is_block(mesh)
        self.assertEqual(mesh.tissues, ["tissue_0", "tissue_5"])
        self.assertEqual(len(mesh.cells_of("tissue_5")), len(UPPER))

    def test_stl_and_obj_surfaces_come_back_closed(self):
        sphere = make_sphere_surface([0, 0, 0], 1.0, 2)
        source = meshio.Mesh(sphere.nodes, [("triangle", sphere.cells["tri3"])])
        for name in ("s.stl", "s.obj"):
            mesh = convert(self.written(name, source))
            figures = quality.SurfaceFigures(mesh.nodes, mesh.face_sets["wet"])
            self.assertTrue(figures.closed and figures.outward, name)
            self.assertEqual(len(mesh.nodes), len(sphere.nodes), name)

    def test_an_inside_out_surface_is_turned(self):
        block = make_orbit_block()
        source = meshio.Mesh(block.nodes, [("triangle", block.cells["tri3"][:, ::-1])])
        mesh = convert(self.written("o.obj", source))
        figures = quality.SurfaceFigures(mesh.nodes, mesh.face_sets["wet"])
        # OBJ is written with about 7 digits.
        self.assertAlmostEqual(figures.volume, 212.2e-6, delta=1e-4 * 212.2e-6 * 10)

    def gmsh_mesh(self, dimension: int, order: int = 1, extrude: bool = False, quads: bool = False):
        """A unit cube or square of Gmsh itself, with groups "fat" and "held" (its face or edge 1)."""
        try:
            import gmsh
        except ImportError:
            self.skipTest("python3-gmsh is not installed")
        file = str(Path(self.folder.name) / "made.msh")
        gmsh.initialize()
        try:
            gmsh.option.setNumber("General.Terminal", 0)
            if dimension == 3 and not extrude:
                gmsh.model.occ.addBox(0, 0, 0, 1, 1, 1)
            else:
                square = gmsh.model.occ.addRectangle(0, 0, 0, 1, 1)
                if extrude:
                    gmsh.model.occ.extrude([(2, square)], 0, 0, 1, [2], recombine=True)
            gmsh.model.occ.synchronize()
            gmsh.model.setPhysicalName(dimension, gmsh.model.addPhysicalGroup(dimension, [1]), "fat")
            gmsh.model.setPhysicalName(dimension - 1, gmsh.model.addPhysicalGroup(dimension - 1, [1]), "held")
            gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
            if quads:
                gmsh.option.setNumber("Mesh.RecombineAll", 1)
                gmsh.option.setNumber("Mesh.RecombinationAlgorithm", 2)
            gmsh.model.mesh.generate(dimension)
            gmsh.model.mesh.setOrder(order)
            gmsh.option.setNumber("Mesh.MshFileVersion", 4.1)
            gmsh.write(file)
        finally:
            gmsh.finalize()
        return convert(Path(file), "m")

    def test_tets_of_ten_nodes_keep_their_sets(self):
        mesh = self.gmsh_mesh(3, order=2)
        cells = mesh.cells["tet10"]
        self.assertAlmostEqual(quality.tet_volumes(mesh.nodes, cells[:, :4]).sum(), 1.0, delta=1e-12)
        # The order of the middles is VTK's: 01, 12, 02, 03, 13, 23.
        for k, (a, b) in enumerate([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]):
            middle = 0.5 * (mesh.nodes[cells[:, a]] + mesh.nodes[cells[:, b]])
            np.testing.assert_allclose(mesh.nodes[cells[:, 4 + k]], middle, atol=1e-12)
        self.assertEqual(mesh.tissues, ["fat"])
        wet = quality.SurfaceFigures(mesh.nodes, mesh.face_sets["wet"])
        self.assertTrue(wet.closed and wet.outward)
        held = mesh.nodes[mesh.face_sets["held"][:, :3]]
        np.testing.assert_allclose(held[:, :, 0], 0.0, atol=1e-12)
        area = 0.5 * np.cross(held[:, 1] - held[:, 0], held[:, 2] - held[:, 0]).sum(axis=0)
        np.testing.assert_allclose(area, [-1.0, 0.0, 0.0], atol=1e-12)  # outward

    def test_wedges_are_read(self):
        mesh = self.gmsh_mesh(3, extrude=True)
        tets = quality.wedge_tets(mesh.cells["wedge6"])
        volumes = quality.tet_volumes(mesh.nodes, tets)
        self.assertGreater(volumes.min(), 0.0)
        self.assertAlmostEqual(volumes.sum(), 1.0, delta=1e-12)
        wet = quality.SurfaceFigures(mesh.nodes, mesh.face_sets["wet"])
        self.assertTrue(wet.closed and wet.outward)
        self.assertEqual(mesh.tissues, ["fat"])
        self.assertGreater(len(mesh.face_sets["held"]), 0)

    def test_flat_quads_make_a_plane_mesh(self):
        mesh = self.gmsh_mesh(2, quads=True)
        corners = quality.quad_corner_areas(mesh.nodes, mesh.cells["quad4"])
        self.assertGreater(corners.min(), 0.0)  # counter-clockwise
        self.assertAlmostEqual(corners.mean(axis=1).sum(), 1.0, delta=1e-12)
        held = mesh.face_sets["held"]
        self.assertTrue((held[:, 2:] == -1).all())
        # The bottom, run through with the body on the left.
        way = mesh.nodes[held[:, 1]] - mesh.nodes[held[:, 0]]
        np.testing.assert_allclose(way.sum(axis=0), [1.0, 0.0, 0.0], atol=1e-12)
        self.assertEqual(mesh.tissues, ["fat"])

    def test_unknown_cells_are_refused_with_the_remedy(self):
        source = meshio.Mesh(np.random.default_rng(1).random((20, 3)), [("hexahedron20", [range(20)])])
        with self.assertRaisesRegex(MeshError, "make a first-order mesh"):
            convert(self.written("q.vtu", source))

    def test_a_missing_file_is_named(self):
        with self.assertRaisesRegex(MeshError, "no such file"):
            convert(Path(self.folder.name) / "nothing.stl")


if __name__ == "__main__":
    unittest.main(verbosity=2)
