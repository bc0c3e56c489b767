"""Meshes made by cases/mesh: the globe against its published table, closed surfaces, blocks."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "cases"))

from meshing import quality  # noqa: E402
from meshing.blocks import make_box_hex  # noqa: E402
from meshing.globe import TISSUES, make_globe  # noqa: E402
from meshing.globe_profile import GlobeShape  # noqa: E402
from meshing.mesh_file import Mesh, read_mesh, write_mesh  # noqa: E402
from meshing.surfaces import make_box_surface, make_orbit_block, make_sphere_surface  # noqa: E402

# The globe's design table: cells, nodes, wet quads, scaled Jacobian (min, 1 %, 5 %, mean), volume
# against the solid of revolution (7236 mm^3, measured with 0.1 % reading error), V/A_max in mm.
GLOBE = {
    "coarse": dict(cells=9888, nodes=10302, wet=736, sj=(0.452, 0.598, 0.765, 0.938),
                   volume=-1.60, length=0.205),
    "medium": dict(cells=63028, nodes=64344, wet=2464, sj=(0.531, 0.648, 0.812, 0.953),
                   volume=-0.49, length=0.138),
    "fine": dict(cells=361728, nodes=365721, wet=7680, sj=(0.478, 0.678, 0.836, 0.960),
                 volume=-0.14, length=None),
}
TISSUE_CELLS = {
    "coarse": (384, 1088, 864, 96, 256, 480, 192, 6112, 416),
    "medium": (1932, 5460, 4480, 672, 1456, 3192, 1344, 41636, 2856),
    "fine": (7680, 23040, 23424, 3456, 6624, 18432, 8064, 257184, 13824),
}
SOLID_OF_REVOLUTION = 7236.0  # mm^3


def globe(preset: str) -> Mesh:
    return make_globe(preset, GlobeShape(), np.zeros(3))


class GlobeTest(unittest.TestCase):
    def check_preset(self, preset: str) -> None:
        expected, mesh = GLOBE[preset], globe(preset)
        hexes = mesh.cells["hex8"]
        self.assertEqual(len(hexes), expected["cells"])
        self.assertEqual(len(mesh.nodes), expected["nodes"])
        self.assertEqual(len(mesh.face_sets["wet"]), expected["wet"])
        counts = np.bincount(mesh.tissue["hex8"], minlength=len(TISSUES))
        self.assertEqual(tuple(counts), TISSUE_CELLS[preset])
        scaled = quality.hex_scaled_jacobians(mesh.nodes, hexes)
        figures = (scaled.min(), *np.percentile(scaled, [1, 5]), scaled.mean())
        # The table is printed to three digits.
        np.testing.assert_allclose(figures, expected["sj"], atol=6e-4)
        jacobians = quality.hex_gauss_jacobians(mesh.nodes, hexes)
        self.assertGreater(jacobians.min(), 0.0)
        volume = jacobians.sum() * 1e9
        error = 100.0 * (volume / SOLID_OF_REVOLUTION - 1.0)
        # The reference volume is printed to four digits: 0.5 / 7236 = 0.007 %, and the table's own 0.005.
        self.assertAlmostEqual(error, expected["volume"], delta=0.02)
        if expected["length"]:
            length = quality.hex_lengths(mesh.nodes, hexes).min() * 1e3
            self.assertAlmostEqual(length, expected["length"], delta=6e-4)
        wet = quality.SurfaceFigures(mesh.nodes, mesh.face_sets["wet"])
        self.assertTrue(wet.closed and wet.outward)
        self.assertEqual(wet.euler, 2)
        # Quads cut in two enclose the trilinear volume up to their warp, which cancels by symmetry.
        self.assertAlmostEqual(wet.volume * 1e9, volume, delta=1e-6 * volume)
        self.assertEqual(quality.duplicate_nodes(mesh.nodes), 0)
        print(f"{preset}: {len(hexes)} hexes, scaled Jacobian min {scaled.min():.4f}, "
              f"volume error {error:.3f} %")

    def test_coarse_meets_its_table(self):
        self.check_preset("coarse")

    def test_medium_meets_its_table(self):
        self.check_preset("medium")

    def test_fine_meets_its_table(self):
        self.check_preset("fine")

    def test_wet_set_is_the_whole_boundary(self):
        mesh = globe("coarse")
        boundary = quality.boundary_faces(mesh.cells)
        as_set = lambda faces: set(map(tuple, np.sort(faces, axis=1)))  # noqa: E731
        self.assertEqual(as_set(boundary), as_set(mesh.face_sets["wet"]))

    def test_node_sets_lie_where_their_names_say(self):
        mesh = globe("medium")
        at = {name: mesh.nodes[nodes] * 1e3 for name, nodes in mesh.node_sets.items()}
        self.assertLess(at["posterior"][:, 2].max(), -6.0)
        held = mesh.face_sets["posterior"]
        self.assertLessEqual(set(held.ravel()), set(mesh.node_sets["posterior"]))
        area = quality.SurfaceFigures(mesh.nodes, held).area * 1e6
        # The cap of the spheroid behind z = -6 mm is 2 pi R h = 445 mm^2; the set ends at the last ring
        # of quads wholly behind it, up to one facet (2.2 mm) short, 2 pi 10.4 mm x 2.2 mm = 144 mm^2.
        self.assertTrue(445.0 - 144.0 < area < 445.0, area)
        np.testing.assert_allclose(at["apex"], [[0.0, 0.0, 12.8867]], atol=1e-3)
        self.assertEqual(len(at["equator"]), 56)
        # The ring of columns nearest to z = 0 is less than one facet (1.2 mm) away from it.
        self.assertLess(np.abs(at["equator"][:, 2]).max(), 1.2)
        self.assertTrue((at["rectus_medial"][:, 0] < 0).all())  # left eye: the nose is at -x
        self.assertTrue((at["rectus_superior"][:, 1] > 0).all())
        self.assertEqual(len(mesh.face_sets["nerve"]), 13)

    def test_tissues_fill_their_anatomical_volumes(self):
        mesh = globe("fine")
        volumes = quality.hex_volumes(mesh.nodes, mesh.cells["hex8"]) * 1e9
        # mm^3 of the solid of revolution; the fine mesh misses them by at most 0.2 % (chords).
        for name, expected in {"cornea": 73.1, "sclera": 843.0, "aqueous": 195.7, "lens": 173.2,
                               "vitreous": 5181.0}.items():
            found = volumes[mesh.tissue["hex8"] == TISSUES.index(name)].sum()
            self.assertAlmostEqual(found / expected, 1.0, delta=3e-3, msg=name)

    def test_translation_moves_every_node(self):
        moved = make_globe("coarse", GlobeShape(), np.array([1.0, 2.0, 3.0]))
        np.testing.assert_allclose(moved.nodes - globe("coarse").nodes,
                                   np.tile([1.0, 2.0, 3.0], (10302, 1)), atol=1e-14)

    def test_a_thicker_wall_gives_a_longer_step(self):
        thick = make_globe("coarse", GlobeShape(wall_thickness_min=0.6), np.zeros(3))
        sclera = thick.cells_of("sclera")
        length = quality.hex_lengths(thick.nodes, sclera).min() * 1e3
        self.assertGreater(length, 0.28)  # two layers of 0.3 mm, a little less on curved facets


class SurfaceTest(unittest.TestCase):
    def assert_closed(self, mesh: Mesh, volume: float, tolerance: float) -> None:
        figures = quality.SurfaceFigures(mesh.nodes, mesh.face_sets["wet"])
        self.assertTrue(figures.closed)
        self.assertTrue(figures.outward)
        self.assertEqual(figures.euler, 2)
        self.assertAlmostEqual(figures.volume, volume, delta=tolerance * volume)

    def test_orbit_block_has_its_designed_size(self):
        mesh = make_orbit_block()
        self.assertEqual(len(mesh.nodes), 962)
        self.assertEqual(len(mesh.cells["tri3"]), 1920)
        self.assert_closed(mesh, 212.2e-6, 5e-4)  # 212.2 cm^3, printed to four digits

    def test_box_surface_encloses_its_volume(self):
        mesh = make_box_surface([0, 0, 0], [1, 2, 3], (2, 3, 4))
        self.assertEqual(len(mesh.nodes), 54)  # 60 grid points less 6 inside
        self.assert_closed(mesh, 6.0, 1e-14)

    def test_sphere_surface_tends_to_the_sphere(self):
        exact = 4.0 / 3.0 * np.pi * 8.0
        errors = []
        for level in (2, 3, 4):
            mesh = make_sphere_surface([1, 0, 0], 2.0, level)
            self.assert_closed(mesh, exact, 0.1)
            errors.append(1.0 - quality.SurfaceFigures(mesh.nodes, mesh.face_sets["wet"]).volume / exact)
        order = np.log2(errors[1] / errors[2])
        print(f"sphere volume errors {errors}, order {order:.3f}")
        self.assertAlmostEqual(order, 2.0, delta=0.05)  # chords of a sphere: second order


class BlockTest(unittest.TestCase):
    def test_faces_point_outward_and_cover_the_block(self):
        mesh = make_box_hex((0, 0, 0), (1, 2, 3), (2, 3, 4), "steel")
        figures = quality.SurfaceFigures(mesh.nodes, mesh.face_sets["wet"])
        self.assertTrue(figures.closed and figures.outward)
        self.assertAlmostEqual(figures.volume, 6.0, delta=1e-14)
        self.assertEqual(len(mesh.face_sets["x_max"]), 12)
        np.testing.assert_array_equal(mesh.nodes[mesh.node_sets["x_max"], 0], 1.0)
        self.assertAlmostEqual(quality.hex_scaled_jacobians(mesh.nodes, mesh.cells["hex8"]).min(), 1.0)


class FileTest(unittest.TestCase):
    def test_file_gives_back_the_mesh(self):
        mesh = globe("coarse")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "globe.h5"
            write_mesh(mesh, file)
            found = read_mesh(file)
            self.assertIn("globe.h5:/cells/hex8", file.with_suffix(".xmf").read_text())
        np.testing.assert_array_equal(found.nodes, mesh.nodes)
        np.testing.assert_array_equal(found.cells["hex8"], mesh.cells["hex8"])
        np.testing.assert_array_equal(found.tissue["hex8"], mesh.tissue["hex8"])
        self.assertEqual(found.tissues, mesh.tissues)
        self.assertEqual(set(found.node_sets), set(mesh.node_sets))
        np.testing.assert_array_equal(found.face_sets["wet"], mesh.face_sets["wet"])


class ToolTest(unittest.TestCase):
    def run_tool(self, *arguments: str) -> subprocess.CompletedProcess:
        return subprocess.run([ROOT / "cases/mesh", *arguments], capture_output=True, text=True)

    def test_make_reports_every_fault_and_writes_nothing(self):
        with tempfile.TemporaryDirectory() as folder:
            case = Path(folder) / "case.toml"
            case.write_text('[[mesh]]\nrecipe = "globe"\noutput = "g.h5"\npreset = "coarze"\n'
                            '[[mesh]]\nrecipe = "box_hexx"\noutput = "b.h5"\n')
            done = self.run_tool("make", str(case), "--out", folder + "/mesh")
            self.assertEqual(done.returncode, 2)
            self.assertIn("mesh.0.preset", done.stderr)
            self.assertIn("did you mean 'box_hex'?", done.stderr)
            self.assertFalse((Path(folder) / "mesh").exists())

    def test_check_finds_an_inverted_hex(self):
        mesh = make_box_hex((0, 0, 0), (1, 1, 1), (2, 2, 2), "steel")
        mesh.cells["hex8"][3] = mesh.cells["hex8"][3][[4, 5, 6, 7, 0, 1, 2, 3]]
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "bad.h5"
            write_mesh(mesh, file)
            done = self.run_tool("check", str(file))
        self.assertEqual(done.returncode, 2)
        self.assertIn("1 inverted cells, the first is 3", done.stderr)

    def test_check_finds_a_hole_in_the_wet_set(self):
        mesh = make_orbit_block()
        mesh.face_sets["wet"] = mesh.face_sets["wet"][1:]
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "open.h5"
            write_mesh(mesh, file)
            done = self.run_tool("check", str(file))
        self.assertEqual(done.returncode, 2)
        self.assertIn("not closed: 3 open", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
