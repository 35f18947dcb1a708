// SPDX-License-Identifier: GPL-3.0-or-later
#include <memory>
#include <string>
#include <vector>

#include "python/arrays.h"
#include "python/cameras.h"
#include "python/module.h"
#include "python/named.h"
#include "python/objects.h"
#include "python/work.h"
#include <nlohmann/json.hpp>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "convert/commands/common_options.h"
#include "convert/model/evaluation.h"
#include "convert/model/memory_plan.h"
#include "convert/model/model.h"
#include "convert/model/water_report.h"
#include "convert/text/length.h"
#include "io/bytes/atomic_file.h"
#include "io/scenes/scene_reader.h"
#include "io/scenes/view_names.h"
#include "libcgs/reconstruct/evidence_words.h"
#include "libcgs/render/rasterizer.h"
#include "meshing/model/model_fusion.h"

namespace cgs {

namespace {

namespace py = pybind11;

std::vector<std::string> typed_settings(const py::dict& settings) {
  std::vector<std::string> out;
  for (const auto& [name, value] : settings) {
    out.push_back(py::str(name).cast<std::string>() + "=" + py::str(value).cast<std::string>());
  }
  return out;
}

ModelObject reconstructed(const Scene& scene,
                          const std::string& preset,
                          const py::dict& settings,
                          const std::string& medium,
                          const py::object& progress) {
  ReconstructionOptions options;
  options.medium = named(media(), medium, "medium must be none or water");
  options.training = training_options({preset, typed_settings(settings)});
  options.hooks.load_photographs = [](Scene& wanted, const Progress& done) {
    std::vector<int> missing;
    for (const int i : wanted.input) {
      if (wanted.views[static_cast<size_t>(i)].image.empty()) missing.push_back(i);
    }
    if (!missing.empty()) load_images(wanted, missing, done);
  };
  const size_t known = scene.warnings.size();
  ModelObject out = result_of(progress, [&](Terminal& terminal) {
    check_training_memory(scene, memory_budget(0), options.training);
    TrainedModel trained = reconstruct(scene, options, terminal.begin(traits(Stage::Model).title));
    ModelObject made{std::move(trained.model), {}};
    made.model.evidence = description_of(trained, options.training);
    made.coverage = coverage_words(trained.priors, made.model.scene);
    return made;
  });
  warn(out.model.scene.warnings, known);
  return out;
}

ModelObject read(const std::filesystem::path& folder) {
  ModelObject out{result_of(py::none(), [&](Terminal&) { return read_model(folder); }), {}};
  warn(out.model.scene.warnings);
  return out;
}

void save(const ModelObject& model, const std::filesystem::path& folder, bool overwrite) {
  work_beside(py::none(), [&] {
    const NewFolder made(folder);
    const FolderLock lock(folder);
    refuse_to_replace_model(folder, overwrite, "overwrite=True");
    write_model(folder, model.model);
  });
}

py::dict cameras(const ModelObject& m) {
  py::dict out;
  for (const View& view : m.model.scene.views) {
    out[py::str(view.name)] = in_world(view.camera, m.model.scene.frame);
  }
  return out;
}

std::vector<std::string> names(const ModelObject& m, const std::vector<int>& views) {
  std::vector<std::string> out;
  for (const int i : views) out.push_back(m.model.scene.views[static_cast<size_t>(i)].name);
  return out;
}

PictureObject rendered(const ModelObject& m, const Camera& camera) {
  return result_of(py::none(), [&](Terminal&) {
    const Frame& frame = m.model.scene.frame;
    const Camera internal = in_frame(camera, frame);
    if (m.model.priors.empty()) {
      return picture_object(rasterize(m.model.gaussians, internal), internal, frame);
    }
    return picture_object(
        render_camera(m.model, support_views(m.model), internal), internal, frame);
  });
}

ModelFusion model_fusion(const std::string& voxel_size,
                         const std::string& estimated,
                         const Frame& frame) {
  ModelFusion out;
  if (!voxel_size.empty()) out.voxel_size = parse_length(voxel_size, frame);
  out.estimated =
      named(estimated_surfaces(), estimated, "estimated must be keep, fill-only or drop");
  out.memory_limit = memory_budget(0);
  return out;
}

VolumeObject fused(const ModelObject& m,
                   const std::string& voxel_size,
                   const std::string& estimated,
                   const py::object& progress) {
  const Frame& frame = m.model.scene.frame;
  const ModelFusion request = model_fusion(voxel_size, estimated, frame);
  return result_of(progress, [&](Terminal& terminal) {
    return VolumeObject{fuse_model(m.model, request, terminal.begin("fuse")).volume, frame};
  });
}

VolumeObject joined(const std::vector<const ModelObject*>& models,
                    const std::string& voxel_size,
                    const std::string& estimated,
                    const py::object& progress) {
  require(!models.empty(), "number of models must be > 0", 0);
  for (size_t i = 0; i < models.size(); ++i) {
    require(models[i] != nullptr,
            "each of models must be a Model, number " + std::to_string(i),
            "None");
  }
  const ModelFusion request =
      model_fusion(voxel_size, estimated, models.front()->model.scene.frame);
  // Python holds them.
  const ModelSource source = {models.size(), [&](size_t i) {
                                return std::shared_ptr<const Model>(std::shared_ptr<void>(),
                                                                    &models[i]->model);
                              }};
  return result_of(progress, [&](Terminal& terminal) {
    JoinedVolume out = fuse_models(source, request, terminal.begin("fuse"));
    return VolumeObject{std::move(out.fused.volume), out.frame};
  });
}

py::object evaluated(const ModelObject& m, const std::string& views, const py::object& progress) {
  const std::vector<int> wanted =
      views.empty() ? m.model.scene.held_out : select_views(m.model.scene, views);
  const Evaluation found = result_of(progress, [&](Terminal& terminal) {
    return evaluate_views(m.model, wanted, terminal.begin("evaluate"));
  });
  warn(found.warnings);
  return python_of(evaluation_to_json(found));
}

// What an input view knows, in arrays of its own.
py::dict evidence(const ModelObject& m, const std::string& name) {
  const Scene& scene = m.model.scene;
  const int view = find_view(scene, name, "name");
  const auto at = std::find(scene.input.begin(), scene.input.end(), view);
  require(at != scene.input.end() && !m.model.priors.empty(),
          "only input views of a model of this program know depth; the view",
          name);
  const ViewPriors& priors = m.model.priors[static_cast<size_t>(at - scene.input.begin())];
  const auto lengths = [&](const DepthMap& of) {
    py::array_t<float> out({of.height, of.width});
    for (size_t i = 0; i < of.data.size(); ++i) {
      out.mutable_data()[i] = of.data[i] * static_cast<float>(scene.frame.scale);
    }
    return out;
  };
  py::array_t<uint8_t> origin({priors.origin.height, priors.origin.width});
  std::memcpy(origin.mutable_data(), priors.origin.data.data(), priors.origin.data.size());
  py::dict out;
  out["depth"] = lengths(priors.depth);
  out["sigma"] = lengths(priors.sigma);
  out["origin"] = origin;
  return out;
}

template <typename Class>
void add_methods(Class& model) {
  model
      .def("render",
           rendered,
           py::arg("camera"),
           "The Picture that a camera takes: colour, depth, normal, support, holes.")
      .def("fuse",
           fused,
           py::kw_only(),
           py::arg("voxel_size") = "",
           py::arg("estimated") = "fill-only",
           py::arg("progress") = py::none(),
           "What the input views measured, as a Volume. voxel_size: \"5mm\", or in world units; "
           "default: from the pixels. estimated: what nothing measured is kept (\"keep\"), only "
           "where it is framed by evidence (\"fill-only\") or not at all (\"drop\").")
      .def("evaluate",
           evaluated,
           py::arg("views") = "",
           py::kw_only(),
           py::arg("progress") = py::none(),
           "PSNR and SSIM of rendered views against their photographs, as `cgs evaluate --json`. "
           "views: names or indices, separated by commas; default: those held out.")
      .def(
          "input_depth",
          evidence,
          py::arg("name"),
          "What an input view knows: a dict of new arrays, height x width: \"depth\" and \"sigma\" "
          "[world units] and \"origin\", as DEPTH_ORIGIN has it.")
      .def("save",
           save,
           py::arg("folder"),
           py::kw_only(),
           py::arg("overwrite") = false,
           "Writes a model folder, as the program does. Where a finished model is, it raises "
           "InvalidInput unless overwrite is True: say so before long work.");
}

}  // namespace

void add_models(py::module_& module) {
  // By the numbers of DepthOrigin.
  module.attr("DEPTH_ORIGIN") = py::make_tuple(
      "unknown", "measured", "completed", "guessed", "sky", "estimated", "transient", "background");
  py::class_<ModelObject> model(
      module, "Model", "Cameras, Gaussians, and what the input views know about depth.");
  model
      .def_property_readonly(
          "cameras", cameras, "Cameras by the names of their views, in world coordinates; new.")
      .def_property_readonly(
          "input",
          [](const ModelObject& m) { return names(m, m.model.scene.input); },
          "Names of the views it was made from; new.")
      .def_property_readonly(
          "held_out",
          [](const ModelObject& m) { return names(m, m.model.scene.held_out); },
          "Names of the views kept to compare with; new.")
      .def_property_readonly(
          "splats",
          [](const ModelObject& m) {
            return SplatsObject{m.model.gaussians, m.model.scene.frame, m.model.evidence};
          },
          "Its Gaussians; new.")
      .def_property_readonly(
          "evidence",
          [](const ModelObject& m) { return m.model.evidence; },
          "What they rest on, in words.")
      .def_readonly(
          "coverage",
          &ModelObject::coverage,
          "How much of each photograph was measured, in words; empty for a model that was "
          "read; new.")
      .def_property_readonly("frame", [](const ModelObject& m) { return m.model.scene.frame; })
      .def("__repr__", [](const ModelObject& m) {
        return "<cgs.Model, " + std::to_string(m.model.gaussians.size()) + " Gaussians>";
      });
  add_methods(model);
  module.def("read_model",
             read,
             py::arg("folder"),
             "Reads a model folder of this program, or gaussians.ply and cameras.json of 3DGS.");
  module.def("reconstruct",
             reconstructed,
             py::arg("scene"),
             py::kw_only(),
             py::arg("preset") = "standard",
             py::arg("settings") = py::dict(),
             py::arg("medium") = "none",
             py::arg("progress") = py::none(),
             R"(Photographs with cameras to coherent Gaussians, one on the ray of each pixel.

scene     from read_scene(); photographs that are not loaded are loaded. Images and depth that you
          put into its views are taken as they are.
preset    "draft", "standard", "fine", "reference" or "classical"
settings  fields of the training, such as {"steps": 500}; `cgs train --help` tells more
medium    "none", or "water", which is estimated and taken out of the photographs

Returns a Model. The same scene gives the same bits as `cgs train`, for any number of threads.
Raises InvalidInput, BadInput, LimitError.)");
  module.def("fuse_models",
             joined,
             py::arg("models"),
             py::kw_only(),
             py::arg("voxel_size") = "",
             py::arg("estimated") = "fill-only",
             py::arg("progress") = py::none(),
             "What the input views of several Models of one world measured, as one Volume in the "
             "frame of the first: of a photograph that is in several, the model counts that "
             "measured more of it. Arguments as of Model.fuse().");
}

}  // namespace cgs
