// SPDX-License-Identifier: GPL-3.0-or-later
#include <array>
#include <cmath>
#include <cstring>

#include "python/arrays.h"
#include "python/cameras.h"
#include "python/module.h"
#include "python/objects.h"
#include "python/work.h"
#include <nlohmann/json.hpp>
#include <pybind11/eigen.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "convert/splats/splat_files.h"
#include "convert/text/stated_frame.h"
#include "io/bytes/scene_path.h"
#include "io/splats/splat_reader.h"
#include "libcgs/render/picture.h"
#include "libcgs/render/rasterizer.h"

namespace cgs {

namespace {

namespace py = pybind11;
using Points = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;
using Widths = Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>;

Points places(const SplatsObject& splats) {
  const auto& position = splats.gaussians.position;
  Points out(static_cast<Eigen::Index>(position.size()), 3);
  for (size_t i = 0; i < position.size(); ++i) {
    out.row(static_cast<Eigen::Index>(i)) =
        splats.frame.world_from_internal(position[i].cast<double>());
  }
  return out;
}

Widths widths(const SplatsObject& splats) {
  const auto& scale = splats.gaussians.scale;
  Widths out(static_cast<Eigen::Index>(scale.size()), 3);
  for (size_t i = 0; i < scale.size(); ++i) {
    out.row(static_cast<Eigen::Index>(i)) = scale[i] * static_cast<float>(splats.frame.scale);
  }
  return out;
}

py::object harmonics(const py::object& self) {
  Gaussians& g = self.cast<SplatsObject&>().gaussians;
  return view_of<float>(g.sh.data(), {static_cast<py::ssize_t>(g.size()), g.sh_count(), 3}, self);
}

int degree_of(py::ssize_t harmonics) {
  for (int degree = 0; degree <= 3; ++degree) {
    if (harmonics == (degree + 1) * (degree + 1)) return degree;
  }
  throw InvalidInput("sh must have 1, 4, 9 or 16 coefficients, but has " +
                     std::to_string(harmonics));
}

// What could not be drawn. Rotations need not be of unit length: only their direction counts.
void check_splats(const std::vector<Eigen::Vector3d>& world, const Gaussians& g) {
  for (size_t i = 0; i < world.size(); ++i) {
    require(world[i].allFinite(), "positions must be finite", world[i].transpose());
    const Eigen::Vector3f& scale = g.scale[i];
    require(scale.allFinite() && scale.minCoeff() >= 0 && scale.maxCoeff() > 0,
            "scales must be finite, 0 or more, and not all 0",
            scale.transpose());
    const Eigen::Vector4f& rotation = g.rotation[i];
    require(rotation.allFinite() && !rotation.isZero(0),
            "rotations must be finite and not all 0",
            rotation.transpose());
    require(g.opacity[i] >= 0 && g.opacity[i] <= 1, "opacities must be in 0 ... 1", g.opacity[i]);
  }
  for (const Eigen::Vector3f& c : g.sh) require(c.allFinite(), "sh must be finite", c.transpose());
}

SplatsObject made(const ArrayIn<double>& positions,
                  const ArrayIn<float>& scales,
                  const ArrayIn<float>& rotations,
                  const ArrayIn<float>& opacities,
                  const ArrayIn<float>& sh,
                  double metres_per_unit) {
  SplatsObject out;
  const auto world = rows_of<Eigen::Vector3d>(positions, "positions");
  Gaussians& g = out.gaussians;
  g.scale = rows_of<Eigen::Vector3f>(scales, "scales");
  g.rotation = rows_of<Eigen::Vector4f>(rotations, "rotations");
  g.opacity = rows_of<float>(opacities, "opacities");
  require(sh.ndim() == 3 && sh.shape(2) == 3, "sh must have the shape (N, K, 3)", shape_text(sh));
  g.sh_degree = degree_of(sh.shape(1));
  const auto rows = static_cast<size_t>(sh.shape(0));
  for (const size_t count : {g.scale.size(), g.rotation.size(), g.opacity.size(), rows}) {
    require(count == world.size(),
            "all arrays must have " + std::to_string(world.size()) + " rows, as positions",
            count);
  }
  g.sh.resize(rows * static_cast<size_t>(sh.shape(1)));
  std::memcpy(static_cast<void*>(g.sh.data()), sh.data(), g.sh.size() * sizeof(Eigen::Vector3f));
  check_splats(world, g);
  out.frame = canonical_frame(world);
  state_unit(out.frame, metres_per_unit);
  for (size_t i = 0; i < world.size(); ++i) {
    g.position.emplace_back(out.frame.internal_from_world(world[i]).cast<float>());
    g.scale[i] /= static_cast<float>(out.frame.scale);
  }
  return out;
}

SplatsObject read(const std::filesystem::path& path) {
  GaussianFile file = result_of(py::none(), [&](Terminal&) { return read_splats(path); });
  warn(file.warnings);
  return {std::move(file.gaussians), file.frame, std::move(file.evidence)};
}

py::object save(const SplatsObject& splats,
                const std::filesystem::path& path,
                const std::optional<std::vector<double>>& up) {
  return python_of(result_of(py::none(), [&](Terminal& terminal) {
    Frame frame = splats.frame;
    if (lower_extension(path) == ".glb") {
      (void)settle_up(frame, up.value_or(std::vector<double>()), true);
    }
    SplatFileOptions options;
    options.evidence = splats.evidence;
    return write_splat_file(path, splats.gaussians, frame, options, terminal);
  }));
}

PictureObject rendered(const SplatsObject& splats,
                       const Camera& camera,
                       const std::array<float, 3>& background) {
  return result_of(py::none(), [&](Terminal&) {
    const Camera internal = in_frame(camera, splats.frame);
    const RasterizerOptions behind{.background = Eigen::Vector3f(background.data())};
    behind.validate();
    return picture_object(
        rasterize(splats.gaussians, internal), internal, splats.frame, behind.background);
  });
}

template <typename T>
auto raster(Raster<T> RenderBuffers::*member) {
  return [member](const py::object& self) {
    return raster_view<T>(self.cast<PictureObject&>().buffers.*member, self);
  };
}

template <typename T>
auto own_raster(Raster<T> PictureObject::*member) {
  return [member](const py::object& self) {
    return raster_view<float>(self.cast<PictureObject&>().*member, self);
  };
}

void add_picture(py::module_& module) {
  py::class_<PictureObject>(module, "Picture", "What a camera sees of splats or of a model.")
      .def_property_readonly(
          "color",
          own_raster(&PictureObject::color),
          "Height x width x 3, float32; black, or the background, where nothing is drawn.")
      .def_property_readonly(
          "filled",
          [](const py::object& self) {
            auto& picture = self.cast<PictureObject&>();
            if (!picture.filled) picture.filled = filled_picture(picture.buffers);
            return raster_view<float>(*picture.filled, self);
          },
          "The same with the colours around in place of what nothing covers: invented.")
      .def_property_readonly(
          "alpha", raster(&RenderBuffers::alpha), "Height x width, float32: how much is covered.")
      .def_property_readonly(
          "depth",
          own_raster(&PictureObject::depth),
          "Height x width, float32: of the surface [world units], NaN where there is none.")
      .def_property_readonly(
          "normal",
          own_raster(&PictureObject::normal),
          "Height x width x 3, float32: in world axes, towards the camera; 0 = unknown.")
      .def_property_readonly(
          "support",
          raster(&RenderBuffers::support),
          "Height x width, uint8: how many photographs saw what is drawn; None for bare splats.")
      .def_property_readonly(
          "hole",
          [](const py::object& self) {
            auto& kinds = self.cast<PictureObject&>().buffers.hole;
            return raster_view<uint8_t>(kinds, self);
          },
          "Height x width, uint8: why no photograph vouches for a pixel, as HOLE has it; None for "
          "bare splats.")
      .def_property_readonly(
          "is_hole",
          [](const PictureObject& p) -> py::object {
            const Raster<Hole>& kinds = p.buffers.hole;
            if (kinds.empty()) return py::none();
            py::array_t<bool> out({kinds.height, kinds.width});
            for (size_t i = 0; i < kinds.data.size(); ++i) {
              out.mutable_data()[i] = is_hole(kinds.data[i]);
            }
            return out;
          },
          "Height x width, bool: True where no photograph shows what is drawn; new. None for bare "
          "splats.");
  // By the numbers of Hole; 4 is what a mask leaves out, in files.
  module.attr("HOLE") =
      py::make_tuple("none", "transparent", "occluded", "outside", "masked", "estimated", "sky");
}

}  // namespace

PictureObject picture_object(RenderBuffers buffers,
                             const Camera& camera,
                             const Frame& frame,
                             const Eigen::Vector3f& background) {
  PictureObject out;
  out.color = picture(buffers, background);
  out.depth = buffers.median_depth;
  if (!buffers.hole.empty()) {
    for (size_t i = 0; i < out.depth.data.size(); ++i) {
      if (buffers.hole.data[i] == Hole::Sky) out.depth.data[i] = std::nanf("");
    }
  }
  out.normal = normals_from_depth(out.depth, camera);
  for (float& z : out.depth.data) z *= static_cast<float>(frame.scale);
  out.buffers = std::move(buffers);
  return out;
}

void add_splats(py::module_& module) {
  add_picture(module);
  py::class_<SplatsObject> splats(module, "Splats", "3D Gaussians of a model or of any 3DGS file.");
  splats
      .def(py::init(&made),
           py::arg("positions"),
           py::arg("scales"),
           py::arg("rotations"),
           py::arg("opacities"),
           py::arg("sh"),
           py::kw_only(),
           py::arg("metres_per_unit") = 0.0,
           "From arrays: positions N x 3, scales N x 3 (standard deviations, no logarithms), "
           "rotations N x 4 (w, x, y, z), opacities N in (0, 1), sh N x 1, 4, 9 or 16 x 3.")
      .def_property_readonly("positions", places, "N x 3, float64, in world coordinates; new.")
      .def_property_readonly("scales",
                             widths,
                             "N x 3, float32: standard deviations along the axes [world units]; "
                             "new.")
      .def_property_readonly(
          "rotations",
          [](const py::object& self) {
            return rows_view<float>(self.cast<SplatsObject&>().gaussians.rotation, self, true);
          },
          "N x 4, float32: unit quaternions (w, x, y, z), local to world.")
      .def_property_readonly(
          "opacities",
          [](const py::object& self) {
            return rows_view<float>(self.cast<SplatsObject&>().gaussians.opacity, self, true);
          },
          "N, float32, in (0, 1).")
      .def_property_readonly("sh",
                             harmonics,
                             "N x 1, 4, 9 or 16 x 3, float32: colour = 0.28209479 * sh[:, 0] + "
                             "0.5.")
      .def_property_readonly(
          "provenance",
          [](const py::object& self) {
            return checked_rows_view<uint8_t>(self.cast<SplatsObject&>().gaussians.provenance,
                                              self);
          },
          "N, uint8: what vouches for each, as PROVENANCE has it; None = nobody says; read only.")
      .def_readonly("evidence", &SplatsObject::evidence, "What they rest on, in words.")
      .def_readonly("frame", &SplatsObject::frame)
      .def("__len__", [](const SplatsObject& s) { return s.gaussians.size(); })
      .def("__repr__", [](const SplatsObject& s) {
        return "<cgs.Splats, " + std::to_string(s.gaussians.size()) + " of degree " +
               std::to_string(s.gaussians.sh_degree) + ">";
      });
  splats
      .def(
          "render",
          rendered,
          py::arg("camera"),
          py::kw_only(),
          py::arg("background") = std::array<float, 3>{0, 0, 0},
          "The Picture that a camera takes of them. background: the colour where nothing is drawn, "
          "and behind what covers less than half of a pixel.")
      .def("save",
           save,
           py::arg("path"),
           py::kw_only(),
           py::arg("up") = py::none(),
           "Writes .ply, .compressed.ply, .spz, .splat or .glb; returns what the format lost. up: "
           "direction that is up, for .glb; default: as is known, else (0, -1, 0).");
  module.def("read_splats",
             read,
             py::arg("path"),
             "Reads splats of any format that the program reads, by their content.");
}

}  // namespace cgs
