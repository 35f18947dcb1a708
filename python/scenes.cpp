// SPDX-License-Identifier: GPL-3.0-or-later
#include <set>

#include "python/arrays.h"
#include "python/cameras.h"
#include "python/module.h"
#include "python/named.h"
#include "python/work.h"
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "convert/scene/scene_request.h"
#include "io/scenes/scene_reader.h"
#include "libcgs/core/scene.h"

namespace cgs {

namespace {

namespace py = pybind11;

DepthKind depth_kind_of(const std::string& name) {
  return named(depth_kinds(), name, "depth_kind must be auto, metric, depth or disparity");
}

struct SceneArguments {
  std::filesystem::path path;
  std::string views;
  std::optional<int> downscale;
  bool all_views = false;
  std::filesystem::path depth;
  std::string depth_kind;
  std::string assume_unit;
  double focal = 0;
  bool each_lens = false;
  bool old_photographs = false;
  bool refine_poses = false;
};

SceneRequest request_of(const SceneArguments& arguments) {
  SceneRequest out;
  out.path = arguments.path;
  out.options.views = arguments.views;
  out.options.downscale = arguments.downscale;
  out.options.all_views = arguments.all_views;
  out.options.depth.folder = arguments.depth;
  if (!arguments.depth_kind.empty()) {
    out.options.depth.kind = depth_kind_of(arguments.depth_kind);
  }
  out.assume_unit = arguments.assume_unit;
  out.focal = arguments.focal;
  out.each_lens = arguments.each_lens;
  out.old_photographs = arguments.old_photographs;
  out.refine_poses = arguments.refine_poses;
  return out;
}

Scene read(const SceneArguments& arguments, const py::object& progress) {
  const SceneRequest request = request_of(arguments);
  Scene scene = result_of(progress, [&](Terminal& terminal) {
    OpenedScene opened = open_scene(request, {}, terminal);
    (void)check_stated_cameras(opened, terminal);
    return std::move(opened.scene);
  });
  warn(scene.warnings);
  return scene;
}

void require_view(const Scene& scene, int view) {
  require(view >= 0 && static_cast<size_t>(view) < scene.views.size(),
          "views must be indices below " + std::to_string(scene.views.size()),
          view);
}

void set_input(Scene& scene, const std::vector<int>& views) {
  const std::set<int> different(views.begin(), views.end());
  for (const int view : views) require_view(scene, view);
  require(
      different.size() == views.size(), "input views must be different ones, number", views.size());
  scene.input = views;
  std::erase_if(scene.held_out, [&](int view) { return different.contains(view); });
}

// All of another view, but with its arrays where Python may see those of this one.
void take(View& to, View& from) {
  const auto keep_place = [](auto& old, auto& by) {
    replace(old, std::move(by));
    by = std::move(old);
  };
  keep_place(to.image, from.image);
  keep_place(to.valid, from.valid);
  keep_place(to.given_depth, from.given_depth);
  to = std::move(from);
}

void load(Scene& scene, const std::optional<std::vector<int>>& views, const py::object& progress) {
  const std::vector<int> wanted = views.value_or(scene.input);
  for (const int i : wanted) require_view(scene, i);
  const size_t known = scene.warnings.size();
  Scene loaded = scene;
  work_beside(progress, [&] {
    Terminal terminal(true);
    load_images(loaded, wanted, terminal.begin("photographs"));
  });
  scene.warnings = loaded.warnings;
  for (const int i : wanted) {
    take(scene.views[static_cast<size_t>(i)], loaded.views[static_cast<size_t>(i)]);
  }
  warn(scene.warnings, known);
}

View& named(Scene& scene, const std::string& name) {
  for (View& view : scene.views) {
    if (view.name == name) return view;
  }
  throw py::key_error(name);
}

void add_view(py::module_& module) {
  const auto array = [](auto member) {
    return [member](const py::object& self) {
      return raster_view<float>(self.cast<View&>().*member, self);
    };
  };
  py::class_<View>(module, "View", "A photograph and the camera that took it.")
      .def_readonly("name", &View::name)
      .def_property_readonly(
          "image_path",
          [](const View& v) -> py::object {
            return v.image_path.empty() ? py::object(py::none()) : py::cast(v.image_path);
          },
          "None where the file is missing.")
      .def_readwrite("camera", &View::camera, "At the size that is worked on.")
      .def_property(
          "image",
          array(&View::image),
          [](View& v, const ArrayIn<float>& pixels) {
            replace(v.image,
                    raster_of<Eigen::Vector3f>(pixels, v.camera.width, v.camera.height, "image"));
          },
          "Height x width x 3, float32; None until Scene.load().")
      .def_property(
          "valid",
          [](const py::object& self) { return raster_view<bool>(self.cast<View&>().valid, self); },
          [](View& v, const ArrayIn<bool>& mask) {
            replace(v.valid, raster_of<uint8_t>(mask, v.camera.width, v.camera.height, "valid"));
          },
          "Height x width, bool: which pixels may be used; None = all.")
      .def_property(
          "depth",
          array(&View::given_depth),
          [](View& v, const ArrayIn<float>& depth) {
            replace(v.given_depth,
                    raster_of<float>(depth, v.camera.width, v.camera.height, "depth"));
          },
          "Depth from elsewhere, height x width, float32, NaN where there is none; see "
          "Scene.depth_kind. None = none.")
      .def("__repr__", [](const View& v) { return "<cgs.View " + v.name + ">"; });
}

std::string name_of_kind(DepthKind kind) {
  for (const auto& [name, value] : depth_kinds()) {
    if (value == kind) return name;
  }
  return "";
}

void add_scene(py::module_& module) {
  py::class_<Scene>(module, "Scene", "Photographs with their cameras, in world coordinates.")
      .def_property_readonly(
          "views",
          [](py::object& self) {
            py::list out;
            for (View& view : self.cast<Scene&>().views) {
              out.append(py::cast(&view, py::return_value_policy::reference_internal, self));
            }
            return out;
          },
          "All views, in the order of their names.")
      .def("__getitem__",
           named,
           py::arg("name"),
           py::return_value_policy::reference_internal,
           "The view of that name.")
      .def_property(
          "input",
          [](const Scene& s) { return s.input; },
          set_input,
          "Indices of the views to reconstruct from, which are then not held out; new.")
      .def_readonly("held_out", &Scene::held_out, "Indices of those kept to compare with; new.")
      .def_readonly("warnings", &Scene::warnings, "What is odd but usable, a line each; new.")
      .def_readonly("notes", &Scene::notes, "What was chosen, a line each; new.")
      .def_readonly("frame", &Scene::frame)
      .def_property(
          "depth_kind",
          [](const Scene& s) { return name_of_kind(s.depth_kind); },
          [](Scene& s, const std::string& name) { s.depth_kind = depth_kind_of(name); },
          "What View.depth holds: \"metric\" (metres), \"depth\" (up to scale and offset), "
          "\"disparity\" (inverse depth likewise); \"auto\" = found out.")
      .def("load",
           load,
           py::arg("views") = py::none(),
           py::kw_only(),
           py::arg("progress") = py::none(),
           "Decodes photographs, without distortion and at the size of their cameras, and depth "
           "that came with them. views: indices; default: the input views.")
      .def("__repr__", [](const Scene& s) {
        return "<cgs.Scene, " + std::to_string(s.views.size()) + " views, " +
               std::to_string(s.input.size()) + " of them input>";
      });
}

}  // namespace

void add_scenes(py::module_& module) {
  add_view(module);
  add_scene(module);
  module.def(
      "read_scene",
      [](const std::filesystem::path& path,
         const std::string& views,
         std::optional<int> downscale,
         bool all_views,
         const std::optional<std::filesystem::path>& depth,
         const std::string& depth_kind,
         const std::string& assume_unit,
         double focal,
         bool each_lens,
         bool old_photographs,
         bool refine_poses,
         const py::object& progress) {
        return read({path,
                     views,
                     downscale,
                     all_views,
                     depth.value_or(""),
                     depth_kind,
                     assume_unit,
                     focal,
                     each_lens,
                     old_photographs,
                     refine_poses},
                    progress);
      },
      py::arg("path"),
      py::arg("views") = "",
      py::arg("downscale") = py::none(),
      py::kw_only(),
      py::arg("all_views") = false,
      py::arg("depth") = py::none(),
      py::arg("depth_kind") = "",
      py::arg("assume_unit") = "",
      py::arg("focal") = 0.0,
      py::arg("each_lens") = false,
      py::arg("old_photographs") = false,
      py::arg("refine_poses") = false,
      py::arg("progress") = py::none(),
      R"(Reads a scene in any layout that the program reads; of nothing but photographs, solves for
the cameras.

path         folder
views        input views: names or indices, separated by commas; default: chosen
downscale    divides the sides of the photographs; default: no side above 1024 pixels
all_views    take every view as input where `views` is empty
depth        folder of depth files, one per photograph
depth_kind   "metric", "depth" (up to scale and offset) or "disparity"; default: found out
assume_unit  what a unit of the scene is, "m", "mm" ..., where it does not say
focal        focal length of photographs without cameras [pixels]; 0 = found out
each_lens    photographs without cameras have a focal length each
old_photographs  of prints and films: borders are left out, and what film, print and scanner did to
             the light of each is found out, as far as matches tell
refine_poses cameras that the scene states are moved so that the photographs agree

Pixels are not loaded: see Scene.load(). Raises InvalidInput, BadInput.)");
}

}  // namespace cgs
