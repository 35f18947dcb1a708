// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/arrays.h"
#include "python/cameras.h"
#include "python/module.h"
#include "python/objects.h"
#include "python/work.h"
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "convert/files/volume_file.h"
#include "convert/model/memory_plan.h"
#include "meshing/surface/isosurface.h"
#include "meshing/surface/watertight.h"
#include "meshing/volume/tsdf.h"

namespace cgs {

namespace {

namespace py = pybind11;

// Places of what depth maps show, for the frame: a hundred or so of each.
std::vector<Eigen::Vector3d> shown_points(const std::vector<TsdfView>& views) {
  constexpr int kStep = 10;  // to each side
  std::vector<Eigen::Vector3d> out;
  for (const TsdfView& view : views) {
    out.push_back(view.camera.center());
    const int dx = std::max(1, view.depth.width / kStep);
    const int dy = std::max(1, view.depth.height / kStep);
    for (int y = 0; y < view.depth.height; y += dy) {
      for (int x = 0; x < view.depth.width; x += dx) {
        const float z = view.depth(x, y);
        if (z > 0 && std::isfinite(z)) out.push_back(view.camera.unproject(x + 0.5, y + 0.5, z));
      }
    }
  }
  return out;
}

// Depth below or at zero means that there is none, in other people's arrays.
void enter(DepthMap& depth, double scale) {
  for (float& z : depth.data) {
    z = z > 0 ? static_cast<float>(z / scale) : std::nanf("");
  }
}

using Maps = std::vector<ArrayIn<float>>;

void check_count(const char* name, size_t count, size_t cameras) {
  require(count == cameras,
          std::string(name) + " must be as many as the cameras, " + std::to_string(cameras),
          count);
}

VolumeObject fused(const std::vector<Camera>& cameras,
                   const Maps& depths,
                   const std::optional<Maps>& colors,
                   const std::optional<Maps>& sigmas,
                   double voxel_size,
                   double metres_per_unit,
                   const py::object& progress) {
  check_count("depths", depths.size(), cameras.size());
  if (colors) check_count("colors", colors->size(), cameras.size());
  if (sigmas) check_count("sigmas", sigmas->size(), cameras.size());
  std::vector<TsdfView> views(cameras.size());
  for (size_t i = 0; i < views.size(); ++i) {
    const Camera& camera = views[i].camera = cameras[i];
    views[i].depth = raster_of<float>(depths[i], camera.width, camera.height, "a depth map");
    if (colors) {
      views[i].color =
          raster_of<Eigen::Vector3f>((*colors)[i], camera.width, camera.height, "a picture");
    }
    if (sigmas) {
      views[i].sigma = raster_of<float>((*sigmas)[i], camera.width, camera.height, "a sigma map");
    }
  }
  return result_of(progress, [&](Terminal& terminal) {
    VolumeObject out;
    out.frame = canonical_frame(shown_points(views));
    state_unit(out.frame, metres_per_unit);
    for (TsdfView& view : views) {
      view.camera = in_frame(view.camera, out.frame);
      enter(view.depth, out.frame.scale);
      enter(view.sigma, out.frame.scale);
    }
    TsdfOptions options;
    options.voxel_size = voxel_size / out.frame.scale;
    options.memory_limit = memory_budget(0);
    out.volume = fuse(views, options, terminal.begin("fuse")).volume;
    return out;
  });
}

VolumeObject read(const std::filesystem::path& path) {
  VolumeFile file = result_of(py::none(), [&](Terminal&) { return read_volume(path); });
  return {std::move(file.volume), file.frame};
}

MeshObject open_mesh(const VolumeObject& volume) {
  return result_of(py::none(), [&](Terminal&) {
    return mesh_object(open_surface(volume.volume, {}), volume.frame);
  });
}

MeshObject closed_mesh_of(VolumeObject& volume, const py::object& progress) {
  return result_of(progress, [&](Terminal& terminal) {
    WatertightOptions options;
    options.memory_limit = memory_budget(0);
    WatertightResult closed =
        watertight_surface(volume.volume, options, terminal.begin("watertight mesh"));
    if (closed.mesh.faces.empty()) throw NumericalError("the volume holds no surface");
    MeshObject out = mesh_object(std::move(closed.mesh), volume.frame);
    out.certificate = closed.certificate;
    return out;
  });
}

}  // namespace

void add_volumes(py::module_& module) {
  py::class_<VolumeObject>(module,
                           "Volume",
                           "Depth maps fused: signed distance, weight, colour, and what is free, "
                           "occupied, estimated or never seen.")
      .def_property_readonly(
          "voxel_size",
          [](const VolumeObject& v) { return double(v.volume.voxel_size) * v.frame.scale; },
          "Edge of a voxel [world units].")
      .def_readonly("frame", &VolumeObject::frame)
      .def("surface", open_mesh, "The surface that was seen, as a Mesh that ends where that does.")
      .def("watertight",
           closed_mesh_of,
           py::kw_only(),
           py::arg("progress") = py::none(),
           "A Mesh that bounds a volume; what was invented to close it says so.")
      .def(
          "save",
          [](const VolumeObject& v, const std::filesystem::path& path) {
            work_beside(py::none(), [&] { write_volume(path, v.volume, v.frame); });
          },
          py::arg("path"),
          "Writes OpenVDB.")
      .def("__repr__", [](const VolumeObject& v) {
        return "<cgs.Volume, voxels of " + std::to_string(v.volume.voxel_size * v.frame.scale) +
               ">";
      });
  module.def("read_volume", read, py::arg("path"), "Reads an OpenVDB file of this program.");
  module.def("fuse",
             fused,
             py::arg("cameras"),
             py::arg("depths"),
             py::arg("colors") = py::none(),
             py::arg("sigmas") = py::none(),
             py::kw_only(),
             py::arg("voxel_size") = 0.0,
             py::arg("metres_per_unit") = 0.0,
             py::arg("progress") = py::none(),
             R"(Fuses depth maps of any source into a Volume.

cameras     one Camera per map
depths      height x width each: along z [world units]; 0 or NaN = unknown, infinity = nothing there
colors      height x width x 3 each
sigmas      height x width each: standard deviation of the depth [world units]; NaN = exact
voxel_size  edge of a voxel [world units]; 0 = the median pixel on the surface

Raises InvalidInput for shapes that do not fit, LimitError.)");
}

}  // namespace cgs
