// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/conversion.h"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/files/mesh_files.h"
#include "convert/files/volume_file.h"
#include "convert/model/fusion.h"
#include "convert/model/memory_plan.h"
#include "convert/model/model.h"
#include "convert/model/simplification.h"
#include "convert/splats/splat_files.h"
#include "convert/splats/splat_reports.h"
#include "convert/text/length.h"
#include "convert/text/stated_frame.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/json_file.h"
#include "io/bytes/scene_path.h"
#include "io/meshes/gltf.h"
#include "io/meshes/mesh_file.h"
#include "io/meshes/mesh_ply.h"
#include "io/ply/header.h"
#include "io/splats/splat_glb_reader.h"
#include "io/splats/splat_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/core/splat_selection.h"
#include "libcgs/splats/floaters.h"
#include "meshing/surface/isosurface.h"
#include "meshing/surface/watertight.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

/// What a file can hold, each made from those before it.
enum class Content { Splats, Volume, Mesh };

/// The input, of which only what it holds is filled.
struct Source {
  Content content = Content::Splats;
  std::optional<GaussianFile> splats;
  std::optional<Model> model;  ///< Splats with their photographs' cameras.
  std::optional<VolumeFile> volume;
  TriangleMesh mesh;
  std::vector<std::string> warnings;  ///< Of reading the mesh.
  bool has_textures = false;          ///< As MeasurableFile.
  std::string assumed_up;             ///< Likewise, or of settle_up().
  Frame frame;
  Eigen::Vector3d file_origin = Eigen::Vector3d::Zero();  ///< Of the mesh that was read.
};

/// Files of a mesh or a plain cloud: PLY and .glb have to be looked into, they may hold splats.
bool holds_mesh(const std::filesystem::path& path) {
  if (!is_mesh_name(path)) return false;
  if (has_gltf_extension(path)) return !is_splat_glb(path);
  if (lower_extension(path) != ".ply") return true;
  const std::optional<PlyHeader> header = read_ply_header(path);
  if (!header) return false;
  for (const char* const name : {"face", "tristrips"}) {
    const PlyElement* const faces = header->find(name);
    if (faces != nullptr && faces->count > 0) return true;
  }
  const PlyElement* const vertex = header->find("vertex");
  return vertex != nullptr && vertex->find("x") >= 0 && !is_splat_file(path);
}

/// \throws LimitError before a file is read that would not fit
void check_size(const std::filesystem::path& path, size_t memory_limit) {
  const std::optional<SplatCount> stated = stated_splats(path);
  if (!stated) return;
  check_splat_memory_plan(
      {.splats = stated->splats, .harmonics = stated->harmonics, .file_bytes = stated->file_bytes},
      memory_budget(memory_limit));
}

/// The same before virtual cameras look at splats.
void check_pictures(const ConversionRequest& request, const Gaussians& g) {
  const VirtualCameraOptions& cameras = request.volume.cameras;
  check_splat_memory_plan({.splats = g.size(),
                           .harmonics = static_cast<uint64_t>(g.sh_count()),
                           .pictures = static_cast<uint64_t>(cameras.views),
                           .picture_pixels = uint64_t(cameras.size) * uint64_t(cameras.size)},
                          memory_budget(request.volume.memory_limit));
}

Source read_source(const std::filesystem::path& path, size_t memory_limit) {
  Source out;
  if (is_folder(path)) {
    out.model = read_model(path);
    out.frame = out.model->scene.frame;
  } else if (lower_extension(path) == ".vdb") {
    out.content = Content::Volume;
    out.volume = read_volume(path);
    out.frame = out.volume->frame;
  } else if (holds_mesh(path)) {
    out.content = Content::Mesh;
    MeasurableFile file = read_mesh_file(path);
    out.mesh = std::move(file.content.mesh);
    out.frame = file.content.frame;
    out.warnings = std::move(file.warnings);
    out.has_textures = file.has_textures;
    out.assumed_up = std::move(file.assumed_up);
    out.file_origin = file.content.file_origin;
  } else {
    check_size(path, memory_limit);
    out.splats = read_splats(path);
    out.frame = out.splats->frame;
  }
  return out;
}

/// What the output is to hold, by its name, the flag, and for .ply and .glb the input.
Content wanted_content(const ConversionRequest& request, const Source& source) {
  const Content from = source.content;
  const std::string extension = lower_extension(request.output);
  const auto is = [&](std::initializer_list<const char*> names) {
    return std::find(names.begin(), names.end(), extension) != names.end();
  };
  const bool known_as = request.as.empty() || request.as == "mesh" || request.as == "splats";
  require(known_as, "--as must be mesh or splats", request.as);
  require(is({".ply", ".splat", ".spz", ".vdb", ".obj", ".stl", ".om", ".3mf", ".glb"}),
          "the output must end in .ply, .splat, .spz, .vdb, .obj, .stl, .om, .3mf or .glb",
          extension.empty() ? "without an ending" : extension);
  const bool stays = is({".ply"}) && request.as.empty() && from == Content::Splats;
  const bool asked = is({".ply", ".glb"}) && request.as == "splats";
  Content out = Content::Mesh;
  if (is({".vdb"})) out = Content::Volume;
  const bool packed = is_compressed_ply_name(request.output);
  if (is({".splat", ".spz"}) || stays || asked || packed) out = Content::Splats;
  const bool asked_other = (request.as == "mesh" && out != Content::Mesh) ||
                           (request.as == "splats" && out != Content::Splats);
  require(!asked_other, "--as must fit the output: " + extension + " cannot hold that", request.as);
  constexpr std::array<const char*, 3> kNames = {"splats", "a volume", "a mesh"};
  const bool is_cloud = source.mesh.faces.empty() && from == Content::Mesh;
  const std::string input = is_cloud ? "a plain point cloud" : kNames.at(static_cast<size_t>(from));
  if (from != Content::Splats && out != Content::Mesh) {
    throw InvalidInput("convert goes from splats to volume to mesh, not back: of " + input +
                       " it cannot make " + kNames.at(static_cast<size_t>(out)));
  }
  return out;
}

/// Splats to volume; the splats are gone afterwards.
Volume make_volume(const ConversionRequest& request,
                   Source& source,
                   Terminal& terminal,
                   Json& report) {
  if (source.volume) return std::move(source.volume->volume);
  const SplatVolumeRequest& wanted = request.volume;
  const Progress progress = terminal.begin("fuse");
  FusedVolume fused;
  if (source.model) {
    const ModelFusion fusion = {
        .voxel_size = length_or_zero(wanted.voxel_size, source.model->scene.frame, "--voxel-size"),
        .memory_limit = memory_budget(wanted.memory_limit)};
    fused = fuse_model(*source.model, fusion, progress);
    report["fusion"] = fusion_to_json(fused.report, source.frame);
  } else {
    Gaussians gaussians = std::move(source.splats->gaussians);
    SplatVolume made = splat_volume(std::move(gaussians), source.frame, wanted, progress);
    report["fusion"] = splat_volume_to_json(made, source.frame);
    fused = std::move(made.fused);
  }
  terminal.end("voxel " + format_length(fused.report.voxel_size, source.frame));
  return std::move(fused.volume);
}

TriangleMesh make_mesh(const ConversionRequest& request,
                       Volume& volume,
                       const Frame& frame,
                       Terminal& terminal,
                       Json& report) {
  const Progress progress = terminal.begin("mesh");
  const auto options = simplify_options(request.simplify, volume.voxel_size, frame);
  TriangleMesh mesh;
  if (request.open_surface) {
    mesh = open_surface(volume, {});
    if (options && !mesh.faces.empty()) mesh = simplify(mesh, *options, progress).mesh;
  } else {
    WatertightOptions closing;
    closing.memory_limit = memory_budget(request.volume.memory_limit);
    WatertightResult closed = watertight_surface(volume, closing, part_of(progress, 0, 0.5));
    TriangleMesh none;
    if (!closed.mesh.faces.empty()) {
      simplify_meshes(none, closed, options, part_of(progress, 0.5, 1));
    }
    report["certificate"] = certificate_to_json(closed.certificate, closed.mesh, frame);
    report["method"] = closed.method;
    mesh = std::move(closed.mesh);
  }
  if (mesh.faces.empty()) {
    throw NumericalError("no surface was found; a smaller --voxel-size may hold thin parts");
  }
  terminal.end(std::to_string(mesh.faces.size()) + " faces");
  return mesh;
}

void simplify_mesh(const ConversionRequest& request, Source& source, Terminal& terminal) {
  const auto options = simplify_options(request.simplify, 1, source.frame);
  if (!options || source.mesh.faces.empty()) return;
  const Progress progress = terminal.begin("simplify");
  source.mesh = simplify(source.mesh, *options, progress).mesh;
  terminal.end(std::to_string(source.mesh.faces.size()) + " faces");
}

/// \return what the file lost by its encoding, for people; empty if nothing
std::string write_mesh(const ConversionRequest& request, const Source& source, const Json& report) {
  GlbOptions options;
  options.encoding = request.encoding;
  if (!request.compression_error.empty()) {
    options.max_error =
        parse_length(request.compression_error, source.frame, "--compression-error") *
        source.frame.scale;
  }
  options.summary_json = json_text(report, -1);
  options.local_origin = request.local_origin;
  return write_mesh_as(request.output, source.mesh, source.frame, options);
}

/// \return what was left out, for the report
Json leave_out_floaters(GaussianFile& file, size_t memory_limit, const Terminal& terminal) {
  check_splat_memory_plan({.splats = file.gaussians.size(),
                           .harmonics = static_cast<uint64_t>(file.gaussians.sh_count()),
                           .finds_floaters = true},
                          memory_budget(memory_limit));
  const Floaters found = find_floaters(file.gaussians);
  if (found.doubtful) {
    terminal.warn(floaters_text(found));
  } else {
    terminal.say(floaters_text(found));
    keep_only(file.gaussians, found.keep);
    if (!file.evidence.empty()) file.evidence += "; " + floaters_text(found);
  }
  return floaters_to_json(found, file.frame);
}

/// Refuses every option that would change nothing between this input and this output.
void refuse_without_effect(const ConversionRequest& request, const Source& source, Content wanted) {
  const ConversionRequest usual;
  const VirtualCameraOptions& cameras = request.volume.cameras;
  const VirtualCameraOptions& usual_cameras = usual.volume.cameras;
  const std::string extension = lower_extension(request.output);
  const bool to_mesh = wanted == Content::Mesh;
  const bool to_glb = to_mesh && extension == ".glb";
  const bool to_other = wanted != Content::Splats;
  const bool to_bare = is_bare_splat_name(request.output);
  const bool from_file = source.splats.has_value();
  const char* const splats_alone = "is for files of splats alone";
  struct Option {
    const char* name;
    bool is_given;
    bool fits;
    const char* otherwise;
    bool fits_output = true;
  };
  const std::initializer_list<Option> options = {
      {"--open",
       request.open_surface,
       source.content != Content::Mesh,
       "has no effect on an input that is a mesh already",
       to_mesh},
      {"--filter-floaters", request.filter_floaters, from_file, splats_alone},
      {"--voxel-size",
       !request.volume.voxel_size.empty(),
       source.content == Content::Splats,
       "has no effect on an input that holds no splats",
       to_other},
      {"--compression-error",
       !request.compression_error.empty(),
       to_glb,
       "is for meshes in .glb alone"},
      {"--simplify", !request.simplify.empty(), true, "", to_mesh},
      {"--glb-encoding", request.encoding != usual.encoding, true, "", to_glb},
      {"--local-origin", request.local_origin, true, "", extension == ".glb"},
      {"--look-from",
       cameras.placement != usual_cameras.placement,
       from_file,
       splats_alone,
       to_other},
      {"--virtual-views", cameras.views != usual_cameras.views, from_file, splats_alone, to_other},
      {"--virtual-size", cameras.size != usual_cameras.size, from_file, splats_alone, to_other},
      {"--up", !request.up.empty(), true, "", !to_bare},
      {"--assume-unit", !request.assume_unit.empty(), true, "", !to_bare},
      {"--spz-version", request.spz_version != usual.spz_version, true, "", extension == ".spz"}};
  for (const Option& option : options) {
    if (!option.is_given || (option.fits && option.fits_output)) continue;
    throw InvalidInput(std::string(option.name) + " " +
                       (option.fits ? "has no effect on " + printable(request.output.filename())
                                    : option.otherwise));
  }
}

/// Refuses at once what would be refused after minutes of work.
void check_before_work(const ConversionRequest& request, const Source& source, Content wanted) {
  require_writable_as(request.output, source.frame);
  { const AtomicFile can_be_written(request.output); }
  refuse_without_effect(request, source, wanted);
  if (wanted == Content::Splats) return;
  if (!request.volume.voxel_size.empty())
    (void)parse_length(request.volume.voxel_size, source.frame, "--voxel-size");
  if (!request.compression_error.empty()) {
    (void)parse_length(request.compression_error, source.frame, "--compression-error");
  }
  (void)simplify_options(request.simplify, 1, source.frame);
}

// The axes and the unit that the output has.
void settle_frame(const ConversionRequest& request, Source& source) {
  const bool keeps_axes = source.content == Content::Mesh && !is_turned_upright(request.output);
  if (!request.up.empty()) source.assumed_up.clear();
  if (!keeps_axes || !request.up.empty()) {
    const std::string assumed =
        settle_up(source.frame, request.up, source.content == Content::Splats);
    if (!assumed.empty()) source.assumed_up = assumed;
  }
  if (request.assume_unit.empty()) return;
  const std::string refused = assume_unit(source.frame, request.assume_unit);
  if (!refused.empty()) source.warnings.push_back(refused);
}

/// What a model shows and what was painted into its holes, the latter tagged: it goes where splats
/// go, and into nothing that is measured.
GaussianFile painted_splats(const Model& model) {
  GaussianFile out;
  out.gaussians = model.gaussians;
  append(out.gaussians, model.fill);
  out.evidence = with_synthetic(model.evidence, model.fill.size());
  return out;
}

/// Meshes and volumes take nothing that was painted into holes.
void leave_out_synthetic(GaussianFile& file, const ConversionRequest& request, Terminal& terminal) {
  const size_t count = synthetic_count(file.gaussians);
  if (count == 0) return;
  if (count == file.gaussians.size()) {
    throw BadInput(Defect::Empty,
                   request.input,
                   "all of its splats are synthetic; meshes and volumes take none of these");
  }
  std::vector<uint8_t> keep;
  for (const uint8_t tag : file.gaussians.synthetic) keep.push_back(tag == 0 ? 1 : 0);
  keep_only(file.gaussians, keep);
  terminal.say(std::to_string(count) +
               " synthetic splats left out: no mesh and no volume takes them");
}

void write_as_splats(const ConversionRequest& request,
                     const Source& source,
                     Terminal& terminal,
                     Json& report) {
  GaussianFile painted;
  const bool has_fill = source.model && source.model->fill.size() > 0;
  if (has_fill) painted = painted_splats(*source.model);
  const bool is_bare_model = source.model && !has_fill;
  const GaussianFile& file = source.splats ? *source.splats : painted;
  report["output"] = write_splat_file(request.output,
                                      is_bare_model ? source.model->gaussians : file.gaussians,
                                      source.frame,
                                      {request.spz_version,
                                       request.volume.memory_limit,
                                       is_bare_model ? source.model->evidence : file.evidence,
                                       request.local_origin},
                                      terminal);
}

// Says what of it the file cannot hold.
void write_as_mesh(const ConversionRequest& request,
                   const Source& source,
                   Terminal& terminal,
                   const Json& report) {
  if (source.mesh.faces.empty() && lower_extension(request.output) != ".ply") {
    throw BadInput(Defect::Empty,
                   request.input,
                   "has no faces; a point cloud can only be written as .ply, and "
                   "cgs filter makes a surface of it (--op poisson, --op advancing-front)");
  }
  for (const std::string& lost :
       {textures_text(source.has_textures),
        lost_in_file(request.output, source.mesh, source.frame),
        assumed_up_text(request.input, request.output, source.assumed_up)}) {
    if (!lost.empty()) terminal.say(lost);
  }
  if (source.content == Content::Mesh) {
    const std::string moved =
        moved_origin_text(request.output, source.file_origin, source.frame.file_origin);
    if (!moved.empty()) terminal.warn(moved);
  }
  const std::string lost_by_encoding = write_mesh(request, source, report);
  if (!lost_by_encoding.empty()) terminal.say(lost_by_encoding);
}

void say_place(const ConversionRequest& request, const Frame& frame, Terminal& terminal) {
  const std::string place = glb_place_text(request.output, frame, request.local_origin);
  if (!place.empty()) terminal.say(place);
}

}  // namespace

std::string conversion_table() {
  return "from                                 to splats        to .vdb  to a mesh\n"
         "                                     .ply .splat      volume   .ply .obj .stl\n"
         "                                     .spz .glb                 .om .3mf .glb\n"
         "                                     .compressed.ply\n"
         "3DGS, 2DGS or packed .ply, .splat,\n"
         "  .spz 2 to 4, .ksplat, .sog 2 or\n"
         "  its meta.json beside its images,\n"
         "  .glb, .gltf with splats            yes              yes      yes, virtual cameras\n"
         "model folder of train or run         yes              yes      yes, its own cameras\n"
         ".vdb of fuse, run or convert         no               no       yes\n"
         ".ply with faces, .obj, .stl, .off,\n"
         "  .om, .3mf, .glb, .gltf, triangles   no               no       yes\n"
         "Where the ending can be both, .ply stays splats and .glb becomes a mesh; --as mesh and\n"
         "--as splats say otherwise. .stl and .3mf need a known scale, or --assume-unit.\n";
}

Json convert_file(const ConversionRequest& given, Terminal& terminal) {
  ConversionRequest request = given;
  Source source = read_source(request.input, request.volume.memory_limit);
  settle_frame(request, source);
  const Content wanted = wanted_content(request, source);
  check_before_work(request, source, wanted);
  // Splats of others are rough at the size of a voxel: hardly a face could go within a part of one.
  if (source.splats && request.simplify.empty()) request.simplify = "0";
  Json report = {{"input", request.input.filename().string()}};
  if (source.splats) {
    report["splats"] = splat_file_to_json(*source.splats);
    terminal.warn(source.splats->warnings);
  }
  if (source.model) terminal.warn(source.model->scene.warnings);
  terminal.warn(source.warnings);
  if (request.filter_floaters) {
    report["floaters"] = leave_out_floaters(*source.splats, request.volume.memory_limit, terminal);
  }
  if (wanted == Content::Splats) {
    write_as_splats(request, source, terminal, report);
    say_place(request, source.frame, terminal);
    return report;
  }
  const bool from_splats_alone = source.splats.has_value();
  if (from_splats_alone) {
    leave_out_synthetic(*source.splats, request, terminal);
    check_pictures(request, source.splats->gaussians);
    report["evidence"] = "none: the surface was seen by virtual cameras only";
    terminal.say(
        "no photograph vouches for this surface: all of it is labelled virtual or inferred");
  }
  if (source.content != Content::Mesh) {
    Volume volume = make_volume(request, source, terminal, report);
    if (wanted == Content::Volume) {
      write_volume(request.output,
                   volume,
                   source.frame,
                   from_splats_alone ? "virtual cameras" : "photographs");
      return report;
    }
    source.mesh = make_mesh(request, volume, source.frame, terminal, report);
  } else if (!request.simplify.empty()) {
    simplify_mesh(request, source, terminal);
  }
  write_as_mesh(request, source, terminal, report);
  say_place(request, source.frame, terminal);
  return report;
}

}  // namespace cgs
