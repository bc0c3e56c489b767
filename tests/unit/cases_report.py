"""report.html of a made-up result folder: pictures of gas and solid, curves, table, in one file."""

import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "cases"))

from launching.summary import add_tissue_stress  # noqa: E402
from launching.tissue_stress import exceeded, volumes  # noqa: E402
from meshing import quality  # noqa: E402
from meshing.globe import make_globe  # noqa: E402
from meshing.globe_profile import GlobeShape  # noqa: E402
from meshing.surfaces import make_sphere_surface  # noqa: E402
from reporting.curves import quantity_of, split_unit  # noqa: E402
from reporting.flow_pictures import plane_segments  # noqa: E402
from reporting.report import write_report  # noqa: E402
from reporting.solid_pictures import cut_polygons  # noqa: E402
from reporting.xdmf import read_series  # noqa: E402

HEAD = ('<?xml version="1.0"?><Xdmf Version="3.0"><Domain><Grid Name="series" '
        'GridType="Collection" CollectionType="Temporal">')
TAIL = "</Grid></Domain></Xdmf>"
SUMMARY = {"case": "made_up", "title": "A made-up <case>", "machine": {"cores": 2},
           "quantities": [{"name": "peak", "value": 110.0, "unit": "Pa", "reference": 100.0,
                           "source": "exact", "relative_error": 0.1, "tolerance": 0.2,
                           "within_tolerance": True}],
           "performance": {"wall_time_s": 3.0, "flow_compute_s": 2.0, "flow_cells_per_s": 1e7}}


def item(shape: str, place: str) -> str:
    return f'<DataItem Format="HDF" Dimensions="{shape}">{place}</DataItem>'


def write_flow(out: Path, counts: tuple[int, int, int], times: list[float]) -> None:
    """A series as flow_solver writes it: cell data [n_k, n_j, n_i], velocity [n_k, n_j, n_i, 3]."""
    (out / "flow").mkdir()
    text = HEAD
    faces = [np.linspace(-1.0, 1.0, n + 1) for n in counts]
    size = " ".join(str(n) for n in counts[::-1])
    for number, t in enumerate(times):
        name = f"flow/{number:04}.h5"
        with h5py.File(out / name, "w") as h5:
            for axis, x in zip("xyz", faces):
                h5[f"faces_{axis}"] = x
            for field, shape in (("overpressure", counts[::-1]), ("density", counts[::-1]),
                                 ("velocity", (*counts[::-1], 3))):
                h5[field] = np.random.default_rng(number).random(shape, dtype=np.float32) + t
        text += (f'<Grid GridType="Uniform"><Time Value="{t}"/><Topology TopologyType="3DRectMesh" '
                 f'Dimensions="1 1 1"/><Geometry GeometryType="VXVYVZ">')
        text += "".join(item(str(len(x)), f"{name}:/faces_{a}") for a, x in zip("xyz", faces))
        text += "</Geometry>"
        for field in ("overpressure", "density"):
            text += (f'<Attribute Name="{field}" AttributeType="Scalar" Center="Cell">'
                     f'{item(size, f"{name}:/{field}")}</Attribute>')
        vectors = item(f"{size} 3", f"{name}:/velocity")
        text += (f'<Attribute Name="velocity" AttributeType="Vector" Center="Cell">{vectors}'
                 "</Attribute></Grid>")
    (out / "flow.xmf").write_text(text + TAIL)


def write_bodies(out: Path) -> None:
    ball = make_sphere_surface([0, 0, 0], 0.5, 2)
    with h5py.File(out / "interface.h5", "w") as h5:
        h5["triangles"], h5["position"] = ball.cells["tri3"], ball.nodes
    text = (f'{HEAD}<Grid Name="bodies" GridType="Collection" CollectionType="Spatial">'
            f'<Time Value="0"/><Grid Name="ball" GridType="Uniform"><Topology TopologyType="Triangle">'
            f'{item("1 3", "interface.h5:/triangles")}</Topology><Geometry GeometryType="XYZ">'
            f'{item("1 3", "interface.h5:/position")}</Geometry></Grid></Grid>')
    (out / "interface.xmf").write_text(text + TAIL)


def write_solid(out: Path) -> None:
    globe = make_globe("coarse", GlobeShape(), np.zeros(3))
    with h5py.File(out / "solid.h5", "w") as h5:
        h5["cells"], h5["nodes"] = globe.cells["hex8"], globe.nodes
        h5["pressure"] = globe.tissue["hex8"].astype(float)
    text = (f'{HEAD}<Grid GridType="Uniform"><Time Value="1e-6"/><Topology '
            f'TopologyType="Hexahedron">{item("1 8", "solid.h5:/cells")}</Topology><Geometry '
            f'GeometryType="XYZ">{item("1 3", "solid.h5:/nodes")}</Geometry><Attribute '
            f'Name="pressure" Center="Cell">{item("1", "solid.h5:/pressure")}</Attribute></Grid>')
    (out / "solid.xmf").write_text(text + TAIL)



class TissueStressTest(unittest.TestCase):
    CORNERS = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], dtype=float)

    def test_volumes_of_sheared_cells_are_exact(self):
        shear = np.array([[2.0, 0.3, 0.0], [0.0, 1.0, -0.4], [0.1, 0.0, 0.5]])
        points = self.CORNERS @ shear.T
        self.assertAlmostEqual(volumes(points, np.arange(8)[None])[0], np.linalg.det(shear), delta=1e-15)
        self.assertAlmostEqual(volumes(points, np.array([[0, 1, 3, 4, 5, 7]]))[0], np.linalg.det(shear) / 2, delta=1e-15)
        self.assertAlmostEqual(volumes(points, np.array([[0, 1, 3, 4]]))[0], np.linalg.det(shear) / 6, delta=1e-15)

    def test_one_element_of_many_does_not_make_the_figure(self):
        values, weights = np.append(np.arange(1000.0), 1e9), np.ones(1001)
        self.assertEqual(exceeded(values, weights), 990.0)  # the 11th of 1001: 10.01 of them are 1 %
        weights[-1] = 20.0  # unless it is large
        self.assertEqual(exceeded(values, weights), 1e9)

    def test_the_figure_stands_beside_the_largest_of_single_elements(self):
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder)
            (out / "solid").mkdir()
            points = np.concatenate([self.CORNERS + [2.0 * i, 0, 0] for i in range(200)])
            stress = np.arange(200.0)
            with h5py.File(out / "solid/mesh.h5", "w") as mesh:
                mesh["hex8/cells"] = np.arange(1600).reshape(200, 8)
                mesh["hex8/tissue"] = np.repeat([0, 1], 100)
                mesh["tissues"] = [b"hard", b"soft"]
            for number, factor in enumerate((1.0, 3.0, 2.0)):
                with h5py.File(out / f"solid/{number:04}.h5", "w") as frame:
                    frame["position"], frame["hex8/von_mises"] = points, factor * stress
            reported = [{"name": f"{t}_von_mises_peak", "value": 0.0, "unit": "Pa"} for t in ("soft", "lens")]
            rows = add_tissue_stress(reported, out)
            self.assertEqual([r["name"] for r in rows], ["soft_von_mises_peak", "soft_von_mises_of_1_percent_peak", "lens_von_mises_peak"])
            self.assertEqual(rows[1]["value"], 3.0 * 199.0)  # of 100 equal cells the largest one is 1 %
            self.assertEqual(add_tissue_stress(reported, out / "nothing"), reported)


class ReportTest(unittest.TestCase):
    def setUp(self):
        self.temporary = tempfile.TemporaryDirectory()
        self.addCleanup(self.temporary.cleanup)
        self.out = Path(self.temporary.name)

    def report(self) -> str:
        write_report(self.out, SUMMARY)
        return (self.out / "report.html").read_text()

    def test_every_kind_of_result_gets_its_picture(self):
        write_flow(self.out, (6, 5, 4), [0.0, 1.0, 2.0])
        write_bodies(self.out)
        write_solid(self.out)
        (self.out / "probes.csv").write_text("time_s,a_overpressure_Pa,a_u_m_s\n0,1,2\n1,2,3\n")
        (self.out / "case.toml").write_text('[report]\nslice_axis = "x"\nslice_position_m = 0.001\n')
        text = self.report()
        # slices, globe cut, probes, run-time split
        self.assertEqual(text.count("data:image/png;base64,"), 4)
        self.assertIn("plane x = 1 mm", text)
        self.assertIn("Pressure in the solid", text)

    def test_a_line_of_cells_gets_curves(self):
        write_flow(self.out, (20, 1, 1), [0.0, 1.0])
        self.assertIn("The gas along x", self.report())

    def test_the_page_needs_nothing_else_and_escapes_its_texts(self):
        text = self.report()
        self.assertNotRegex(text, r'(src|href)="(?!data:)')
        self.assertIn("A made-up &lt;case&gt;", text)
        self.assertIn("+10.00 %", text)

    def test_series_keep_times_and_components(self):
        write_flow(self.out, (4, 3, 2), [0.0, 0.5])
        frames = read_series(self.out / "flow.xmf")
        self.assertEqual([f.time for f in frames], [0.0, 0.5])
        self.assertEqual(frames[0].grids[0].attribute("velocity").shape, (2, 3, 4, 3))


class CutTest(unittest.TestCase):
    def test_cut_of_the_globe_has_the_meridian_area(self):
        globe = make_globe("coarse", GlobeShape(), np.zeros(3))
        # Slightly off the axis: the plane of nodes itself lies between cells.
        polygons, owners = cut_polygons(globe.nodes, globe.cells["hex8"], 0, 1e-6)
        area = 0.0
        for polygon in polygons:
            d = polygon[1:] - polygon[0]
            area += 0.5 * np.linalg.norm(np.cross(d[:-1], d[1:]).sum(axis=0))
        # Meridian of the coarse mesh, both halves, from its own layers: every second side ring node
        # lies in the plane, so the outline is the polygon of the profile's columns.
        outline = plane_segments(globe.nodes, quality.split_faces(globe.face_sets["wet"]), 0, 1e-6)
        enclosed = 0.5 * abs(np.cross(outline[:, 0, 1:], outline[:, 1, 1:])).sum()
        print(f"area of the cut {area * 1e6:.4f} mm^2, inside its outline {enclosed * 1e6:.4f} mm^2")
        # The tets of the cells meet the wet quads along one or the other diagonal: that changes the
        # outline by the quads' warp only.
        self.assertAlmostEqual(area / enclosed, 1.0, delta=1e-3)
        self.assertEqual(len(polygons), len(owners))

    def test_plane_cuts_a_sphere_in_a_closed_line(self):
        ball = make_sphere_surface([0, 0, 0], 1.0, 3)
        segments = plane_segments(ball.nodes, ball.cells["tri3"], 2, 0.25)
        ends = np.round(segments.reshape(-1, 3), 9)
        _, uses = np.unique(ends, axis=0, return_counts=True)
        self.assertTrue((uses == 2).all())


class ColumnTest(unittest.TestCase):
    def test_units_are_split_off_by_the_longest_suffix(self):
        self.assertEqual(split_unit("a_b_overpressure_Pa"), ("a_b_overpressure", "Pa"))
        self.assertEqual(split_unit("a_density_kg_m3"), ("a_density", "kg_m3"))
        self.assertEqual(split_unit("a_u_m_s"), ("a_u", "m_s"))
        self.assertEqual(quantity_of("front_overpressure_Pa"), ("overpressure", "Pa"))
        self.assertEqual(quantity_of("ciliary_body_pressure_mean_Pa"), ("pressure_mean", "Pa"))
        self.assertEqual(quantity_of("kinetic_J"), ("", "J"))


if __name__ == "__main__":
    unittest.main(verbosity=2)
