// SPDX-License-Identifier: GPL-3.0-or-later
#include "python/cameras.h"

#include <cmath>
#include <optional>

#include "python/arrays.h"
#include "python/module.h"
#include <nlohmann/json.hpp>
#include <pybind11/eigen.h>
#include <pybind11/stl.h>

#include "io/bytes/json_file.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

namespace py = pybind11;

constexpr double kRigid = 1e-6;

void place(Camera& camera, const ArrayIn<double>& pose) {
  require(pose.ndim() == 2 && pose.shape(0) == 4 && pose.shape(1) == 4,
          "world_from_cam must have the shape (4, 4)",
          shape_text(pose));
  const Eigen::Matrix4d world_from_cam =
      Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(pose.data());
  const Eigen::Matrix3d turn = world_from_cam.topLeftCorner<3, 3>();
  const bool is_rigid = world_from_cam.allFinite() &&
                        (turn * turn.transpose()).isIdentity(kRigid) && turn.determinant() > 0 &&
                        world_from_cam.row(3).isApprox(Eigen::RowVector4d(0, 0, 0, 1));
  require(is_rigid, "world_from_cam must be a rotation and a place, 4 x 4", world_from_cam);
  camera.world_from_cam.matrix() = world_from_cam;
}

void check_camera(const Camera& c) {
  require(c.width > 0 && c.height > 0, "a camera must have pixels, its width", c.width);
  for (const double f : {c.fx, c.fy}) {
    require(f > 0 && std::isfinite(f), "focal lengths must be positive and finite", f);
  }
  for (const double at : {c.cx, c.cy}) {
    require(std::isfinite(at), "the principal point must be finite", at);
  }
}

Camera made(int width, int height, double fx, double fy, double cx, double cy) {
  Camera out;
  out.width = width;
  out.height = height;
  out.fx = fx;
  out.fy = fy;
  out.cx = cx;
  out.cy = cy;
  check_camera(out);
  return out;
}

std::string words(const Camera& c) {
  return "<cgs.Camera " + std::to_string(c.width) + " x " + std::to_string(c.height) + ", f " +
         std::to_string(c.fx) + ">";
}

}  // namespace

Camera in_world(Camera camera, const Frame& frame) {
  camera.world_from_cam = world_from_internal(frame, camera.world_from_cam);
  return camera;
}

Camera in_frame(Camera camera, const Frame& frame) {
  check_camera(camera);  // its fields may have been changed since it was made
  camera.world_from_cam = internal_from_world(frame, camera.world_from_cam);
  return camera;
}

void state_unit(Frame& frame, double metres_per_unit) {
  if (metres_per_unit == 0) return;
  require(metres_per_unit > 0 && std::isfinite(metres_per_unit),
          "metres_per_unit must be positive and finite",
          metres_per_unit);
  frame.metres_per_unit = metres_per_unit;
  frame.scale_source = ScaleSource::Assumed;
}

py::object python_of(const nlohmann::ordered_json& json) {
  return py::module_::import("json").attr("loads")(json_text(json, -1));
}

void add_cameras(py::module_& module) {
  py::class_<Camera>(module,
                     "Camera",
                     "A pinhole camera in world coordinates. Axes: +x right, +y down, +z forward.")
      .def(py::init([](int width,
                       int height,
                       double fx,
                       double fy,
                       double cx,
                       double cy,
                       const std::optional<ArrayIn<double>>& world_from_cam) {
             Camera out = made(width, height, fx, fy, cx, cy);
             if (world_from_cam) place(out, *world_from_cam);
             return out;
           }),
           py::arg("width"),
           py::arg("height"),
           py::arg("fx"),
           py::arg("fy"),
           py::arg("cx"),
           py::arg("cy"),
           py::arg("world_from_cam") = py::none(),
           "Focal lengths and principal point in pixels, width / 2 and height / 2 where it is "
           "centred; world_from_cam is 4 x 4, as the property.")
      .def_readwrite("width", &Camera::width, "[pixels]")
      .def_readwrite("height", &Camera::height, "[pixels]")
      .def_readwrite("fx", &Camera::fx, "[pixels]")
      .def_readwrite("fy", &Camera::fy, "[pixels]")
      .def_readwrite("cx", &Camera::cx, "[pixels]")
      .def_readwrite("cy", &Camera::cy, "[pixels]")
      .def_property(
          "world_from_cam",
          [](const Camera& c) { return Eigen::Matrix4d(c.world_from_cam.matrix()); },
          place,
          "Where it stands and how it is turned, 4 x 4; new.")
      .def_property_readonly(
          "intrinsics", &Camera::intrinsics, "The calibration matrix, 3 x 3 [pixels]; new.")
      .def(
          "resized",
          [](const Camera& c, int width, int height) {
            require(width > 0 && height > 0, "a camera must have pixels, its width", width);
            return resized(c, width, height);
          },
          py::arg("width"),
          py::arg("height"),
          "The camera of the same photograph at another size.")
      .def("__repr__", words);

  py::class_<Frame>(module, "Frame", "Unit and direction up of a scene.")
      .def_property_readonly("unit", &Frame::unit_name, "\"m\", \"mm\" ... or \"unknown\"")
      .def_readonly("metres_per_unit", &Frame::metres_per_unit, "0 = unknown")
      .def_readonly("metres_sigma", &Frame::metres_sigma, "Its standard deviation; 0 = not known")
      .def_property_readonly(
          "scale_source",
          [](const Frame& f) { return scale_source_name(f.scale_source); },
          "How the unit became known.")
      .def_property_readonly(
          "up",
          [](const Frame& f) -> py::object {
            return f.knows_up() ? py::cast(f.up) : py::object(py::none());
          },
          "World direction that is up, of unit length; None = not known.")
      .def("__repr__", [](const Frame& f) { return "<cgs.Frame, unit " + f.unit_name() + ">"; });
}

}  // namespace cgs
