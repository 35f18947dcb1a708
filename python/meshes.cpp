// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <string>

#include "python/arrays.h"
#include "python/cameras.h"
#include "python/module.h"
#include "python/objects.h"
#include "python/work.h"
#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "convert/commands/measuring.h"
#include "convert/files/mesh_files.h"
#include "convert/filter/chain.h"
#include "convert/measure/comparison.h"
#include "convert/measure/measured_file.h"
#include "convert/text/stated_frame.h"
#include "io/bytes/byte_writer.h"
#include "meshing/measure/deviation.h"

namespace cgs {

namespace {

namespace py = pybind11;
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Faces = std::vector<std::array<uint32_t, 3>>;

Points world_points(const MeshObject& mesh) {
  const auto& points = mesh.content.points;
  Points out(static_cast<Eigen::Index>(points.size()), 3);
  for (size_t i = 0; i < points.size(); ++i) {
    out.row(static_cast<Eigen::Index>(i)) = mesh.content.frame.world_from_internal(points[i]);
  }
  return out;
}

std::vector<Eigen::Vector3d> rows(const ArrayIn<double>& points) {
  auto out = rows_of<Eigen::Vector3d>(points, "vertices");
  require(!out.empty(), "a mesh needs vertices, their number", out.size());
  for (const Eigen::Vector3d& p : out) {
    require(p.allFinite(), "vertices must be finite", p.transpose());
  }
  return out;
}

void place_points(MeshObject& mesh, const std::vector<Eigen::Vector3d>& world) {
  MeasurableMesh& content = mesh.content;
  content.points.clear();
  content.mesh.vertices.clear();
  for (const Eigen::Vector3d& p : world) {
    content.points.push_back(content.frame.internal_from_world(p));
    content.mesh.vertices.push_back(content.points.back().cast<float>());
  }
}

Faces faces_of(const py::object& array, size_t vertices) {
  Faces out;
  for (const auto& face : integers_of<std::array<int64_t, 3>>(array, "faces")) {
    for (const int64_t v : face) {
      require(v >= 0 && static_cast<uint64_t>(v) < vertices,
              "faces must name vertices below " + std::to_string(vertices),
              v);
    }
    out.push_back({static_cast<uint32_t>(face[0]),
                   static_cast<uint32_t>(face[1]),
                   static_cast<uint32_t>(face[2])});
  }
  return out;
}

// An array per vertex or per face, which must be as long as these.
template <typename T, typename Scalar>
std::vector<T> as_many(const ArrayIn<Scalar>& array, const char* name, size_t count) {
  auto out = rows_of<T, Scalar>(array, name);
  require(out.size() == count,
          std::string(name) + " must have " + std::to_string(count) + " rows",
          out.size());
  return out;
}

std::vector<Provenance> labels_of(const py::object& array, size_t faces) {
  const auto labels = integers_of<int64_t>(array, "provenance");
  require(labels.size() == faces,
          "provenance must have " + std::to_string(faces) + " rows",
          labels.size());
  std::vector<Provenance> out;
  for (const int64_t label : labels) {
    require(label >= 0 && static_cast<uint64_t>(label) < kProvenanceCount,
            "labels of provenance must be below 6",
            label);
    out.push_back(static_cast<Provenance>(label));
  }
  return out;
}

void set_colors(MeshObject& m, const ArrayIn<float>& colors) {
  replace(m.content.mesh.colors,
          as_many<Eigen::Vector3f>(colors, "colors", m.content.mesh.vertices.size()));
}

void set_sigma(MeshObject& m, const ArrayIn<float>& sigma) {
  m.content.mesh.sigma = as_many<float>(sigma, "sigma", m.content.mesh.vertices.size());
  for (float& s : m.content.mesh.sigma) s = static_cast<float>(s / m.content.frame.scale);
}

MeshObject made(const ArrayIn<double>& vertices,
                const std::optional<py::object>& faces,
                const std::optional<ArrayIn<float>>& colors,
                const std::optional<ArrayIn<float>>& sigma,
                const std::optional<py::object>& provenance,
                double metres_per_unit) {
  MeshObject out;
  const std::vector<Eigen::Vector3d> points = rows(vertices);
  out.content.frame = canonical_frame(points);
  state_unit(out.content.frame, metres_per_unit);
  place_points(out, points);
  TriangleMesh& mesh = out.content.mesh;
  if (faces) mesh.faces = faces_of(*faces, points.size());
  if (colors) set_colors(out, *colors);
  if (sigma) set_sigma(out, *sigma);
  if (provenance) mesh.provenance = labels_of(*provenance, mesh.faces.size());
  return out;
}

MeshObject read(const std::filesystem::path& path, const std::string& assume_unit) {
  MeasurableFile file =
      result_of(py::none(), [&](Terminal&) { return read_measured(path, assume_unit); });
  warn(file.warnings);
  file.content.file_origin.setZero();
  return {std::move(file.content), {}};
}

void save(const MeshObject& mesh,
          const std::filesystem::path& path,
          const std::optional<std::vector<double>>& up) {
  require(is_writable_mesh_name(path),
          "the file must end in .ply, .obj, .stl, .om, .3mf or .glb",
          path.filename().string());
  work_beside(py::none(), [&] {
    Frame frame = mesh.content.frame;
    if (is_turned_upright(path)) (void)settle_up(frame, up.value_or(std::vector<double>()));
    require_writable_as(path, frame);
    GlbOptions exact;
    exact.encoding = GlbEncoding::Plain;
    (void)write_mesh_as(path, mesh.content.mesh, frame, exact);
  });
}

MeshObject filtered(const MeshObject& mesh,
                    const py::args& operations,
                    const py::object& progress) {
  std::vector<std::string> typed;
  for (const auto& operation : operations) typed.push_back(operation.cast<std::string>());
  const auto filters = prepare_filters(typed, mesh.content.frame);
  return result_of(progress, [&](Terminal& terminal) {
    FilterState state{mesh.content.mesh, mesh.content.frame};
    (void)run_filters(state, filters, terminal);
    return mesh_object(std::move(state.mesh), state.frame);
  });
}

std::string point_text(const Eigen::Vector3d& p) {
  std::string out;
  for (const double c : p) {
    if (!out.empty()) out += ',';
    append_number(out, c);
  }
  return out;
}

using Ends = std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>>;

struct WantedFigures {
  bool area, volume, bounds, thickness, certificate;
  Ends distance, along;
  std::string section, unit;
  bool nothing() const {
    return !area && !volume && !bounds && !thickness && !certificate && !distance && !along &&
           section.empty();
  }
};

py::object measured(const MeshObject& mesh, const WantedFigures& wanted) {
  require(!mesh.content.mesh.faces.empty(), "measuring needs faces, their number", 0);
  const bool all = wanted.nothing();
  const auto ends = [](const Ends& of) {
    return std::vector{point_text(of->first), point_text(of->second)};
  };
  return python_of(result_of(py::none(), [&](Terminal&) {
    const FigureUnit unit = figure_unit(mesh.content.frame, wanted.unit);
    Measuring measuring("mesh", mesh.content, unit, true);
    if (wanted.area || all) measuring.area();
    if (wanted.volume || all) measuring.volume();
    if (wanted.bounds || all) measuring.bounds();
    if (wanted.distance) measuring.distance(ends(wanted.distance));
    if (wanted.along) measuring.along(ends(wanted.along));
    if (!wanted.section.empty()) measuring.section(wanted.section, {}, {});
    if (wanted.thickness) measuring.thickness();
    if (wanted.certificate || all) measuring.certificate();
    return measuring.figures();
  }));
}

py::dict compared(const MeshObject& a, const MeshObject& b) {
  require(!b.content.mesh.faces.empty(), "the other mesh needs faces, their number", 0);
  const Frame& frame = a.content.frame;
  if (frame.has_metric_scale() != b.content.frame.has_metric_scale()) {
    throw InvalidInput(
        "only one of the meshes says how long a unit of it is: give the other "
        "metres_per_unit, or assume_unit where it is read");
  }
  const std::vector<Deviation> found = result_of(py::none(), [&](Terminal&) {
    const MeasurableMesh other = in_frame_of(b.content, frame);
    ComparedPoints points = points_by_vertex(a.content);
    add_scale_sigma(points,
                    relative_scale_sigma(frame, b.content.frame),
                    unmoved_by_scale(a.content, b.content.frame, false));
    return deviations(points, other, NearestSurface(other));
  });
  const auto count = static_cast<py::ssize_t>(found.size());
  py::array_t<double> distance(count);
  py::array_t<double> sigma(count);
  py::array_t<uint8_t> change(count);
  for (py::ssize_t i = 0; i < count; ++i) {
    const Deviation& of = found[static_cast<size_t>(i)];
    distance.mutable_at(i) = of.distance * a.content.frame.scale;
    sigma.mutable_at(i) = of.sigma * a.content.frame.scale;
    change.mutable_at(i) = static_cast<uint8_t>(of.change);
  }
  py::dict out;
  out["distance"] = distance;
  out["sigma"] = sigma;
  out["change"] = change;
  return out;
}

py::object certificate_of(MeshObject& mesh) {
  if (!mesh.certificate) {
    mesh.certificate = result_of(py::none(), [&](Terminal& terminal) {
      return certify(mesh.content.mesh, terminal.begin("certificate"));
    });
  }
  return python_of(certificate_to_json(*mesh.certificate, mesh.content.mesh, mesh.content.frame));
}

std::string words(const MeshObject& m) {
  return "<cgs.Mesh, " + std::to_string(m.content.mesh.vertices.size()) + " vertices, " +
         std::to_string(m.content.mesh.faces.size()) + " faces, unit " +
         m.content.frame.unit_name() + ">";
}

template <typename Class>
void add_arrays(Class& mesh) {
  mesh.def_property_readonly("vertices", world_points, "N x 3, float64, in world coordinates; new.")
      .def_property_readonly(
          "faces",
          [](const py::object& self) {
            return checked_rows_view<uint32_t>(
                self.cast<MeshObject&>().content.mesh.faces, self, true);
          },
          "M x 3, uint32, counter-clockwise seen from outside; read only.")
      .def_property(
          "colors",
          [](const py::object& self) {
            return rows_view<float>(self.cast<MeshObject&>().content.mesh.colors, self);
          },
          set_colors,
          "N x 3, float32; None = none.")
      .def_property_readonly(
          "support",
          [](const py::object& self) {
            return rows_view<float>(self.cast<MeshObject&>().content.mesh.support, self);
          },
          "N, float32: how many photographs saw it; None = nobody says.")
      .def_property(
          "sigma",
          [](const MeshObject& m) -> py::object {
            if (m.content.mesh.sigma.empty()) return py::none();
            py::array_t<float> out(static_cast<py::ssize_t>(m.content.mesh.sigma.size()));
            for (py::ssize_t i = 0; i < out.size(); ++i) {
              out.mutable_at(i) = static_cast<float>(m.content.mesh.sigma[static_cast<size_t>(i)] *
                                                     m.content.frame.scale);
            }
            return out;
          },
          set_sigma,
          "N, float32: standard deviation along the normal [world units], NaN = no statement; "
          "None = nobody says; new.")
      .def_property_readonly(
          "provenance",
          [](const py::object& self) {
            return checked_rows_view<uint8_t>(self.cast<MeshObject&>().content.mesh.provenance,
                                              self);
          },
          "M, uint8: what vouches for each face, as PROVENANCE has it; None = nobody says; read "
          "only.");
}

template <typename Class>
void add_measures(Class& mesh) {
  mesh.def(
          "measure",
          [](const MeshObject& m,
             bool area,
             bool volume,
             bool bounds,
             const Ends& distance,
             const Ends& along,
             const std::string& section,
             bool thickness,
             bool certificate,
             const std::string& unit) {
            return measured(
                m, {area, volume, bounds, thickness, certificate, distance, along, section, unit});
          },
          py::kw_only(),
          py::arg("area") = false,
          py::arg("volume") = false,
          py::arg("bounds") = false,
          py::arg("distance") = py::none(),
          py::arg("along") = py::none(),
          py::arg("section") = "",
          py::arg("thickness") = false,
          py::arg("certificate") = false,
          py::arg("unit") = "",
          R"(Figures, each with its standard deviation and what it rests on, as `cgs measure --json`.

distance   straight between two points, which move to the surface: ((x, y, z), (x, y, z))
along      the shortest way over the surface between two points
section    "z=1.5", or a point and a normal "x,y,z/nx,ny,nz"
unit       of the figures; default: m, or that of the scene

Without a figure: area, volume, bounds and certificate.)")
      .def("compare",
           compared,
           py::arg("other"),
           R"(Signed distance of each vertex to the surface of another mesh.

Returns a dict of arrays, one entry per vertex: "distance", positive on the outer side of the
other, and "sigma", of both sides [world units], NaN = no statement; "change": 0 = nothing can be
said, 1 = none beyond two sigma, 2 = lies nearer, 3 = lies farther out. Units are matched where both
meshes state theirs.)")
      .def("certificate",
           certificate_of,
           "What can be proved of it: closed, manifold, oriented, self-intersections, components, "
           "genus, and volume and areas in the unit of the scene.");
}

}  // namespace

MeshObject mesh_object(TriangleMesh mesh, const Frame& frame) {
  MeshObject out;
  out.content.frame = frame;
  out.content.points.reserve(mesh.vertices.size());
  for (const Eigen::Vector3f& p : mesh.vertices) out.content.points.emplace_back(p.cast<double>());
  out.content.mesh = std::move(mesh);
  return out;
}

void add_meshes(py::module_& module) {
  py::list labels;
  for (const ProvenanceTraits& traits : kProvenanceTraits) {
    labels.append(py::str(std::string(traits.name)));
  }
  module.attr("PROVENANCE") = py::tuple(labels);

  py::class_<MeshObject> mesh(
      module, "Mesh", "A triangle mesh, or a point cloud if it has no faces, with its evidence.");
  mesh.def(py::init(&made),
           py::arg("vertices"),
           py::arg("faces") = py::none(),
           py::kw_only(),
           py::arg("colors") = py::none(),
           py::arg("sigma") = py::none(),
           py::arg("provenance") = py::none(),
           py::arg("metres_per_unit") = 0.0,
           "From arrays: vertices N x 3, faces M x 3, colors N x 3, sigma N, provenance M. "
           "metres_per_unit: 0 = unknown.");
  add_arrays(mesh);
  add_measures(mesh);
  mesh.def_property_readonly("frame", [](const MeshObject& m) { return m.content.frame; })
      .def("filter",
           filtered,
           py::arg("progress") = py::none(),
           "The mesh after operations of `cgs filter`, in this order: "
           "mesh.filter(\"largest=1\", \"simplify=2mm\"); cgs.program.filter lists them.")
      .def("save",
           save,
           py::arg("path"),
           py::kw_only(),
           py::arg("up") = py::none(),
           "Writes .ply, .obj, .stl, .om, .3mf or .glb. up: direction that is up, for those that "
           "say so; default: as is known, else (0, 0, 1).")
      .def("__repr__", words);

  module.def("read_mesh",
             read,
             py::arg("path"),
             py::kw_only(),
             py::arg("assume_unit") = "",
             "Reads a mesh or point cloud: .ply, .obj, .stl, .off, .om, .3mf, .glb, .gltf. "
             "assume_unit: what a unit of the file is, where it does not say.");
}

}  // namespace cgs
