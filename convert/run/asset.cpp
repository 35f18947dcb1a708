// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/asset.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "convert/files/mesh_files.h"
#include "convert/model/texture.h"
#include "convert/model/texture_atlas.h"
#include "convert/text/html.h"
#include "convert/text/length.h"
#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/glb/place.h"
#include "io/meshes/mesh_file.h"
#include "io/meshes/tileset.h"
#include "libcgs/core/error.h"
#include "libcgs/core/up_axis.h"
#include "meshing/edit/simplify.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

constexpr const char* kTilesetName = "tileset.json";

// What the detail d is shared out to.
constexpr double kSimplified = 0.8;
constexpr double kRounded = 0.2;
constexpr double kTexel = 2;
constexpr double kLooserWhereInferred = 4;
// Of the detail, what counts as the error of a mesh that is not simplified at all.
constexpr double kLeastShare = 0.01;
// The certificate of a form is known once it is written, and may take so many bytes more [bytes].
constexpr size_t kRoomForCertificate = 256;
// Coarser than this share of the largest side, nothing is left to recognise.
constexpr double kCoarsest = 1.0 / 50;

/// The asset with what is below a detail left out.
struct Form {
  double detail = 0;  ///< [internal units]; 0 = whole
  TriangleMesh mesh;
  PhotoTexture texture;
  double texture_share = 1;  ///< Of the width of photographs.
  GlbOptions options;
};

// From the detail of one level to that of the next.
constexpr double kLevelStep = 3;
// Of a level: a viewer that bears an error of a pixel shall see no pixels of textures.
constexpr double kLevelTexel = 1;

Eigen::AlignedBox3d box_of(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& p : mesh.vertices) box.extend(p.cast<double>());
  return box;
}

class AssetWriter {
 public:
  AssetWriter(const Model& model, const AssetContent& content, const RunRequest& request)
      : scene_(model.scene),
        priors_(model.priors),
        mesh_(content.mesh),
        texture_(content.texture),
        simplify_(content.texture.empty() ? 0 : content.simplify),
        frame_(model.scene.frame),
        path_(request.output / "web/asset.glb"),
        place_{y_up_from(model.scene.frame.up), request.local_origin},
        description_(content.description),
        certificate_(content.certificate),
        encoding_(request.glb_encoding),
        texel_(atlas_texel(request, model.scene.frame)),
        box_(box_of(content.mesh)) {
    if (!request.compression_error.empty()) {
      rounding_ = parse_length(request.compression_error, frame_);
    }
    if (request.max_error.empty()) return;
    promise_ = parse_length(request.max_error, frame_);
    rounding_ = kRoomForRounding * *promise_;
  }

  Form whole() const { return {0, mesh_, texture_, 1, glb_options(rounding_)}; }

  /// Without the faces that hold nothing but colours which photographs show.
  Form finest() const {
    Form out = whole();
    if (simplify_ > 0) simplify_to(simplify_, kLooserWhereInferred * simplify_, 1, out);
    return out;
  }

  /// \param already  how far mesh_ is from the fused surface where there is evidence
  Form coarser(double detail, double already) const {
    Form out = whole();
    // With a promise, the mesh was made as coarse as that allows before.
    const double left = promise_ ? 0 : kSimplified * detail - already;
    const double looser = detail / std::max(already, kLeastShare * detail);
    if (left > 0) simplify_to(left, kLooserWhereInferred * left, looser, out);
    leave_out_below(detail, kTexel, rounding_ > 0 ? rounding_ : kRounded * detail, out);
    return out;
  }

  /// A level that states its error instead of keeping one; a viewer sees all surface alike.
  /// \param finest  detail of the whole
  Form level(double detail, double finest) const {
    Form out = whole();
    const double error = kSimplified * detail;
    simplify_to(error, error, detail / finest, out);
    leave_out_below(detail, kLevelTexel, std::max(rounding_, kRounded * detail), out);
    return out;
  }

  GlbFile made(const Form& form) const {
    if (texel_ && form.texture.shows_any()) {
      const PackedTexture packed = packed_texture(form.mesh, form.texture, *texel_);
      return make_glb(form.mesh, packed.texture, frame_, form.options);
    }
    return make_glb(form.mesh, form.texture, frame_, form.options);
  }

  /// A form that states the certificate of the mesh as its file holds it: rounding lets faces
  /// vanish or touch that did not before.
  GlbFile certified(Form& form) const {
    GlbFile first = made(form);
    // In the frame that a reader would give it: where faces nearly touch, rounding decides.
    const MeasurableMesh held = parse_glb_file(first.bytes, path_).content;
    const Json stated = certificate_to_json(certify(held.mesh), held.mesh, held.frame);
    if (stated == certificate_) return first;
    form.options.summary_json = summary(stated);
    return made(form);
  }

  TriangleMesh read(std::string glb) const {
    return parse_glb_file(std::move(glb), path_, frame_).content.mesh;
  }

  SurfaceDeviation deviation_from(const TriangleMesh& fused, const GlbFile& glb) const {
    const SurfaceDeviation out = surface_deviation(read(glb.bytes), fused);
    if (promise_ && out.max() > *promise_) {
      throw NumericalError("asset.glb is " + format_length(out.max(), frame_) +
                           " off the fused surface, promised were " +
                           format_length(*promise_, frame_));
    }
    return out;
  }

  /// Of a mesh, in the coordinates of the files.
  Eigen::AlignedBox3d box_in_file(const TriangleMesh& mesh) const {
    Eigen::AlignedBox3d out;
    for (const Eigen::Vector3f& p : mesh.vertices) {
      out.extend(place_.of(p.cast<double>(), frame_));
    }
    return out;
  }
  /// Units of the files per internal unit.
  double file_unit() const { return GlbPlace::unit(frame_); }

  double side() const { return box_.sizes().maxCoeff(); }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::string summary(const Json& certificate) const {
    return Json{{"model", description_}, {"certificate", certificate}}.dump();
  }

  GlbOptions glb_options(double rounding) const {
    GlbOptions out;
    out.encoding = encoding_;
    out.y_up = place_.y_up;
    out.local_origin = place_.has_local_origin;
    out.center = box_.center();
    out.max_error = rounding * frame_.scale;
    out.summary_json = summary(certificate_);
    // Finer than any grid of the encoding: floats as they are.
    const bool short_numbers =
        encoding_ == GlbEncoding::Quantized || encoding_ == GlbEncoding::Meshopt;
    const double finest_grid = short_numbers ? 1.8 / 65535 : 1.0 / (1 << 20);
    if (promise_ && rounding < finest_grid * side()) out.encoding = GlbEncoding::Plain;
    return out;
  }

  // Colours of vertices hold faces where photographs show them anyway, and small parts of the
  // surface: both give way with coarser detail.
  void simplify_to(double error, double inferred, double coarser, Form& out) const {
    SimplifyOptions options;
    options.max_error = error;
    options.max_error_inferred = inferred;
    options.max_color_error =
        texture_.empty() ? std::min(1.0, coarser * options.max_color_error) : 1;
    options.max_area_change = std::min(0.1, coarser * options.max_area_change);
    out.mesh = simplify(mesh_, options).mesh;
    if (!texture_.empty())
      out.texture = texture_from_photographs(scene_, priors_, out.mesh).texture;
  }

  // \param texel  of textures, in details
  void leave_out_below(double detail, double texel, double rounding, Form& out) const {
    out.detail = detail;
    out.options = glb_options(rounding);
    out.texture_share = coarsen_texture(out.texture, out.mesh, texel * detail);
  }

  const Scene& scene_;
  const std::vector<ViewPriors>& priors_;
  const TriangleMesh& mesh_;
  const PhotoTexture& texture_;
  double simplify_;
  const Frame& frame_;
  std::filesystem::path path_;
  GlbPlace place_;
  const std::string& description_;
  const Json& certificate_;  ///< Of mesh_.
  GlbEncoding encoding_;
  std::optional<double> texel_;    ///< Of an atlas.
  Eigen::AlignedBox3d box_;        ///< Of mesh_.
  double rounding_ = 0;            ///< [internal units]; 0 = default of the format
  std::optional<double> promise_;  ///< [internal units]
};

/// A form as it goes to the disk.
struct Written {
  Form form;
  GlbFile glb;
  std::vector<TriedSize> tried;  ///< Coarser forms than the whole; in internal units.
};

// The finest form that is small enough.
Written form_within(const AssetWriter& writer,
                    size_t limit,
                    double already,
                    const Frame& frame,
                    const Progress& progress) {
  Written out{writer.finest(), {}, {}};
  out.glb = writer.certified(out.form);
  if (limit == 0 || out.glb.bytes.size() <= limit) return out;
  const size_t whole = out.glb.bytes.size();
  double tries = 0;
  // Just above what is there already: textures begin to shrink before the mesh does.
  const double finest = std::max(already / kSimplified, 1e-4 * writer.side());
  const double coarsest = std::max(finest, kCoarsest * writer.side());
  const size_t target = limit - std::min(limit, kRoomForCertificate);
  const SizeSearch search = finest_within(target, finest, coarsest, [&](double detail) {
    report(progress, 1 - 1 / (1 + 0.2 * ++tries));
    Form form = writer.coarser(detail, already);
    const size_t bytes = writer.made(form).bytes.size();
    const bool fits = bytes <= target;
    if (fits && (out.form.detail == 0 || detail < out.form.detail)) out.form = std::move(form);
    return bytes;
  });
  if (!search.detail) {
    const size_t least = std::min(whole, search.smallest()) + kRoomForCertificate;
    throw LimitError("asset.glb takes " + std::to_string(least) +
                     " bytes at least, with all left out that is below " +
                     format_length(coarsest, frame) + "; --max-size allows " +
                     std::to_string(limit) +
                     "; smaller pictures make smaller files: --downscale, without --budget");
  }
  out.glb = writer.certified(out.form);
  out.tried = search.tried;
  return out;
}

Json deviation_to_json(const SurfaceDeviation& deviation, const Frame& frame) {
  return {{"evidence", deviation.evidence * frame.scale},
          {"inferred", deviation.inferred * frame.scale},
          {"places", deviation.places},
          {"units", frame.unit_name()}};
}

std::string words_for(const Written& written,
                      const SurfaceDeviation& deviation,
                      size_t limit,
                      size_t whole_faces,
                      const Frame& frame) {
  std::string out = "asset.glb has " + format_file_size(written.glb.report.bytes);
  if (limit > 0) out += " of at most " + format_file_size(limit);
  if (limit > 0 && written.form.detail == 0) out += "; nothing had to be left out";
  if (written.form.detail > 0) {
    out += "; for that its mesh has " + std::to_string(written.form.mesh.faces.size()) + " of " +
           std::to_string(whole_faces) + " faces and its textures " +
           number(100 * written.form.texture_share, "%.0f") +
           " % of the photographs' width (detail " + format_length(written.form.detail, frame) +
           ")";
  }
  return out + "; it is at most " + format_length(deviation.evidence, frame) +
         " off the fused surface where there is evidence, " +
         format_length(deviation.inferred, frame) +
         " where that is inferred or estimated (measured at " + std::to_string(deviation.places) +
         " places, both ways)";
}

// \return the form on disk
Form write_promised(const AssetWriter& writer,
                    const RunRequest& request,
                    const TriangleMesh& mesh,
                    const Frame& frame,
                    const Progress& progress,
                    WrittenAsset& out) {
  const TriangleMesh fused = fused_surface(request.output / "volume.vdb", request.memory_limit);
  const double already = request.max_size > 0 ? surface_deviation(mesh, fused).evidence : 0;
  Written written =
      form_within(writer, request.max_size, already, frame, part_of(progress, 0.1, 0.9));
  const SurfaceDeviation deviation = writer.deviation_from(fused, written.glb);
  write_file(writer.path(), written.glb.bytes);
  out.glb = written.glb.report;
  out.promise = {deviation,
                 written.form.detail,
                 written.form.texture_share,
                 written.tried,
                 words_for(written, deviation, request.max_size, mesh.faces.size(), frame)};
  return std::move(written.form);
}

/// Without a promise, the form is the finest.
Form write_finest(const AssetWriter& writer,
                  const RunRequest& request,
                  const TriangleMesh& mesh,
                  const Frame& frame,
                  const Progress& progress,
                  WrittenAsset& out) {
  if (request.max_error.empty() && request.max_size == 0) {
    Form form = writer.finest();
    const GlbFile glb = writer.certified(form);
    write_file(writer.path(), glb.bytes);
    out.glb = glb.report;
    return form;
  }
  try {
    return write_promised(writer, request, mesh, frame, progress, out);
  } catch (...) {
    std::filesystem::remove(writer.path());  // one that was there may break the promise
    throw;
  }
}

std::string level_name(size_t level) { return "asset.lod" + std::to_string(level) + ".glb"; }

// Details of the levels that go on from the finest one. \param finest  0 = not known
std::vector<double> level_details(double finest, double side, size_t levels) {
  const auto n = double(levels);
  const double coarsest = kCoarsest * side;
  if (finest == 0) finest = coarsest / std::pow(kLevelStep, n);
  finest = std::min(finest, coarsest / std::pow(2, n));
  const double step = std::min(kLevelStep, std::pow(coarsest / finest, 1 / n));
  std::vector<double> out;
  for (size_t k = 1; k <= levels; ++k) out.push_back(finest * std::pow(step, double(k)));
  return out;
}

Json level_to_json(const AssetLevel& level, const Frame& frame) {
  const std::string words =
      level.file + ": " + format_file_size(level.bytes) + ", " + std::to_string(level.faces) +
      " faces, textures " + number(100 * level.texture_share, "%.0f") +
      " % of the photographs' width; at most " + format_length(level.deviation.evidence, frame) +
      " off asset.glb where there is evidence, " + format_length(level.deviation.inferred, frame) +
      " where that is inferred or estimated (measured)";
  return {{"file", level.file},
          {"bytes", level.bytes},
          {"faces", level.faces},
          {"texture_share", level.texture_share},
          {"detail", level.detail * frame.scale},
          {"deviation", deviation_to_json(level.deviation, frame)},
          {"words", words}};
}

std::vector<AssetLevel> write_levels(const AssetWriter& writer,
                                     Form finest_form,
                                     size_t count,
                                     const Frame& frame,
                                     const Progress& progress) {
  const double shown = texel_size(finest_form.texture, finest_form.mesh) / kLevelTexel;
  const double finest = std::max(shown, finest_form.detail);
  finest_form = {};
  const std::filesystem::path folder = writer.path().parent_path();
  const TriangleMesh full = writer.read(read_file(writer.path()));
  Tileset tileset;
  tileset.units = frame.has_metric_scale() ? "m" : "unknown";
  tileset.levels = {{writer.path().filename().string(), 0}};
  tileset.box = writer.box_in_file(full);
  std::vector<AssetLevel> levels;
  for (const double detail : level_details(finest, writer.side(), count)) {
    report(progress, double(levels.size()) / double(count));
    Form form = writer.level(detail, finest > 0 ? finest : detail / kLevelStep);
    const std::string name = level_name(levels.size() + 1);
    const GlbFile glb = writer.certified(form);
    write_file(folder / name, glb.bytes);
    const TriangleMesh mesh = writer.read(glb.bytes);
    levels.push_back({name,
                      glb.report.bytes,
                      mesh.faces.size(),  // as it reads: rounding lets some vanish
                      form.texture_share,
                      detail,
                      surface_deviation(mesh, full)});
    // A viewer must not find the way to what is finer barred by a level that came out better.
    const double error = std::max(tileset.levels.front().geometric_error,
                                  levels.back().deviation.max() * writer.file_unit());
    tileset.levels.insert(tileset.levels.begin(), {name, error});
    tileset.box.extend(writer.box_in_file(mesh));
  }
  write_tileset(folder / kTilesetName, tileset);
  return levels;
}

// Of a run that wanted more of them.
void remove_levels(const std::filesystem::path& folder) {
  for (const std::string& name : level_files(kMostLods)) std::filesystem::remove(folder / name);
}

}  // namespace

std::vector<std::string> level_files(size_t levels) {
  std::vector<std::string> out;
  for (size_t k = 1; k <= levels; ++k) out.push_back(level_name(k));
  if (levels > 0) out.emplace_back(kTilesetName);
  return out;
}

Json asset_to_json(const WrittenAsset& written, const Frame& frame) {
  const GlbReport& glb = written.glb;
  Json out = {{"bytes", glb.bytes},
              {"texture_bytes", glb.texture_bytes},
              {"textured_triangles", glb.textured_triangles},
              {"collapsed_triangles", glb.collapsed_triangles},
              {"measured_texture_error", glb.measured_texture_error},
              {"position_bits", glb.position_bits},
              {"measured_max_error", glb.measured_max_error},
              {"units", frame.unit_name()}};
  if (written.promise) {
    const AssetPromise& promise = *written.promise;
    Json tried = Json::array();
    for (const TriedSize& form : promise.tried) {
      tried.push_back({{"detail", form.detail * frame.scale}, {"bytes", form.bytes}});
    }
    out["deviation"] = deviation_to_json(promise.deviation, frame);
    out["form"] = {{"detail", promise.detail * frame.scale},
                   {"faces", written.faces},
                   {"texture_share", promise.texture_share},
                   {"tried", tried}};
    out["words"] = promise.words;
  }
  out["faces"] = written.faces;
  return out;
}

Json levels_to_json(const WrittenAsset& written, const Frame& frame) {
  Json out = Json::array();
  for (const AssetLevel& level : written.levels) out.push_back(level_to_json(level, frame));
  return out;
}

WrittenAsset write_asset(const Model& model,
                         const AssetContent& content,
                         const RunRequest& request,
                         const Progress& progress) {
  const Frame& frame = model.scene.frame;
  const AssetWriter writer(model, content, request);
  remove_levels(writer.path().parent_path());
  const double of_finest = request.lods > 0 ? 0.5 : 1;
  WrittenAsset out;
  Form form =
      write_finest(writer, request, content.mesh, frame, part_of(progress, 0, of_finest), out);
  out.faces = form.mesh.faces.size();
  if (request.lods == 0) return out;
  out.levels =
      write_levels(writer, std::move(form), request.lods, frame, part_of(progress, of_finest, 1));
  return out;
}

}  // namespace cgs
