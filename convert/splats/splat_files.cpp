// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/splat_files.h"

#include <array>
#include <cstdio>
#include <optional>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/model/memory_plan.h"
#include "convert/splats/splat_loss.h"
#include "convert/text/figures.h"
#include "io/bytes/scene_path.h"
#include "io/ply/header.h"
#include "io/splats/compressed_ply.h"
#include "io/splats/dot_splat.h"
#include "io/splats/gaussian_ply.h"
#include "io/splats/splat_glb.h"
#include "io/splats/splat_glb_reader.h"
#include "io/splats/splat_reader.h"
#include "io/splats/spz.h"
#include "libcgs/core/error.h"
#include "libcgs/core/up_axis.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

/// \throws LimitError before what was written is read again, beside what it was made from
void check_reading_back(const std::filesystem::path& path,
                        const Gaussians& g,
                        size_t memory_limit) {
  check_splat_memory_plan({.splats = g.size(),
                           .harmonics = static_cast<uint64_t>(g.sh_count()),
                           .read_back_bytes = std::filesystem::file_size(path)},
                          memory_budget(memory_limit));
}

/// What was written, for the report.
struct WrittenSplats {
  Json report;
  std::vector<uint32_t> order;  ///< Of the splats in the file, if it is another.
};

WrittenSplats write_splats(const std::filesystem::path& path,
                           const Gaussians& g,
                           const Frame& frame,
                           const SplatFileOptions& options) {
  const std::string extension = lower_extension(path);
  if (extension == ".splat") {
    const DotSplatReport made = write_dot_splat(path, g, frame);
    return {{{"format", ".splat"},
             {"splats", g.size()},
             {"bytes", made.bytes},
             {"clamped_colors", made.clamped_colors},
             {"dropped_harmonics", made.dropped_sh}},
            {}};
  }
  if (extension == ".spz") {
    const SpzReport made = write_spz(path, g, frame, {.version = options.spz_version});
    return {{{"format", "SPZ " + std::to_string(options.spz_version)},
             {"splats", g.size()},
             {"bytes", made.bytes},
             {"fractional_bits", made.fractional_bits},
             {"clamped_splats", made.clamped}},
            {}};
  }
  if (extension == ".glb") {
    const size_t bytes = write_splat_glb(
        path, g, frame, {y_up_from(frame.up), options.evidence, options.local_origin});
    return {{{"format", "KHR_gaussian_splatting"}, {"splats", g.size()}, {"bytes", bytes}}, {}};
  }
  if (is_compressed_ply_name(path)) {
    CompressedPlyReport made = write_compressed_ply(path, g, frame, options.evidence);
    return {{{"format", "compressed PLY"},
             {"splats", g.size()},
             {"bytes", made.bytes},
             {"clamped_splats", made.clamped}},
            std::move(made.order)};
  }
  write_gaussian_ply(path, g, frame, options.evidence);
  return {{{"format", "3DGS PLY"}, {"splats", g.size()}}, {}};
}

bool holds_provenance(const std::filesystem::path& path) {
  return !is_bare_splat_name(path) && !is_compressed_ply_name(path);
}

/// What a format has no place for, of what is known of a scene: "" if nothing.
std::string lost_of_scene(const std::filesystem::path& path,
                          const Gaussians& g,
                          const Frame& frame,
                          const std::string& evidence) {
  const bool is_bare = is_bare_splat_name(path);
  std::string out;
  const auto add = [&](bool is_lost, const std::string& what) {
    if (is_lost) out += (out.empty() ? "" : ", ") + what;
  };
  add(is_bare && frame.has_metric_scale(), "unit");
  add(is_bare && !frame.file_origin.isZero(0), "origin");
  add(is_bare && !frame.up.isApprox(-Eigen::Vector3d::UnitY()), "direction that is up");
  add(is_bare && !evidence.empty(), "evidence");
  add(!g.provenance.empty() && !holds_provenance(path), "provenance");
  add(!g.synthetic.empty() && !holds_provenance(path), "mark of what is synthetic");
  const std::string ending = is_bare ? lower_extension(path) : ".compressed.ply";
  return out.empty() ? out : ending + " files hold no " + out + " of the scene";
}

/// "12 %", and no more of all or nothing than there is.
std::string share_text(size_t part, size_t all) {
  const double percent = 100 * double(part) / double(all);
  if (part == 0) return "none";
  if (percent < 1) return "under 1 %";
  if (part < all && percent > 99) return "over 99 %";
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.0f %%", percent);
  return text.data();
}

/// As splat_file_to_json() says.
Json provenance_json(const Gaussians& g) {
  if (g.provenance.empty()) return nullptr;
  std::array<size_t, kProvenanceCount> counts{};
  for (const Provenance label : g.provenance) ++counts.at(static_cast<size_t>(label));
  const auto count = [&](Provenance label) { return counts.at(static_cast<size_t>(label)); };
  Json out = {
      {"words",
       "estimated: " + share_text(count(Provenance::Estimated), g.size()) + " of the splats"}};
  for (const Provenance label : kProvenanceOrder) out[provenance_key(label)] = count(label);
  return out;
}

/// Likewise.
Json synthetic_json(const Gaussians& g) {
  if (g.synthetic.empty()) return nullptr;
  const size_t count = synthetic_count(g);
  Json sources = Json::array();
  for (const auto& [file, hash] : g.synthetic_sources) {
    sources.push_back({{"file", file}, {"sha256", hash}});
  }
  return {
      {"words",
       "synthetic: " + std::to_string(count) + " splats, from " + std::to_string(sources.size()) +
           " painted picture" + (sources.size() == 1 ? "" : "s")},
      {"splats", count},
      {"sources", sources}};
}

/// Where a hundredth of the splats cannot be held as it is; "" elsewhere.
std::string clamped_text(const Json& report) {
  for (const auto& [key, what] :
       {std::pair("clamped_splats", "sizes or colours"), std::pair("clamped_colors", "colours")}) {
    const auto clamped = report.value(key, uint64_t{0});
    const auto splats = report["splats"].get<uint64_t>();
    if (100 * clamped < splats || clamped == 0) continue;
    return std::to_string(clamped) + " of " + std::to_string(splats) + " splats have " + what +
           " beyond what " + report["format"].get<std::string>() + " can hold: clamped";
  }
  return "";
}

Json bounds_json(const Gaussians& gaussians, const Frame& frame) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& p : gaussians.position) {
    box.extend(frame.file_from_internal(p.cast<double>()));
  }
  const Eigen::Vector3d& a = box.min();
  const Eigen::Vector3d& b = box.max();
  return {{"min", {a.x(), a.y(), a.z()}}, {"max", {b.x(), b.y(), b.z()}}};
}

}  // namespace

bool is_bare_splat_name(const std::filesystem::path& path) {
  const std::string extension = lower_extension(path);
  return extension == ".spz" || extension == ".splat";
}

bool is_compressed_ply_name(const std::filesystem::path& path) {
  return lower_extension(path) == ".ply" && lower_extension(path.stem()) == ".compressed";
}

bool is_splat_file(const std::filesystem::path& path) {
  if (is_folder(path)) return false;
  if (has_gltf_extension(path)) return is_splat_glb(path);
  if (lower_extension(path) != ".ply") return false;
  const std::optional<PlyHeader> header = read_ply_header(path);
  const PlyElement* vertex = header ? header->find("vertex") : nullptr;
  if (vertex == nullptr) return false;
  const auto has = [&](const char* name) { return vertex->find(name) >= 0; };
  const int parts = int{has("f_dc_0")} + int{has("opacity")} + int{has("scale_0")};
  return has("packed_position") || has("rot_0") || parts >= 2;
}

std::string refused_by_others(const std::filesystem::path& path, size_t splats) {
  constexpr size_t kMostInSpz = 10'000'000;  // nianticlabs/spz, load-spz.cc, kMaxPointsToRead
  if (lower_extension(path) != ".spz" || splats <= kMostInSpz) return "";
  return "programs that read .spz with its reference library refuse more than " +
         std::to_string(kMostInSpz) + " splats; this file has " + std::to_string(splats);
}

Json write_splat_file(const std::filesystem::path& path,
                      const Gaussians& g,
                      const Frame& frame,
                      const SplatFileOptions& options,
                      Terminal& terminal) {
  const WrittenSplats written = write_splats(path, g, frame, options);
  Json report = written.report;
  const Json provenance = provenance_json(g);
  report["provenance"] = holds_provenance(path) ? provenance : Json();
  if (!provenance.is_null()) terminal.say(provenance["words"].get<std::string>());
  const Json synthetic = synthetic_json(g);
  report["synthetic"] = holds_provenance(path) ? synthetic : Json();
  if (!synthetic.is_null()) terminal.say(synthetic["words"].get<std::string>());
  const std::string lost = lost_of_scene(path, g, frame, options.evidence);
  if (!lost.empty()) terminal.say(lost);
  std::vector<std::string> missing;  // why splats are, or parts of them
  if (const std::string refused = refused_by_others(path, g.size()); !refused.empty()) {
    missing.push_back(refused);
  }
  if (const std::string clamped = clamped_text(report); !clamped.empty()) {
    missing.push_back(clamped);
  }
  try {
    const Progress progress = terminal.begin("read back");
    cgs::report(progress, 0);
    check_reading_back(path, g, options.memory_limit);
    const GaussianFile back = read_splats(path, frame);
    if (back.gaussians.size() < g.size()) {
      missing.insert(missing.end(), back.warnings.begin(), back.warnings.end());
    }
    const SplatLoss loss = splat_loss(g, back.gaussians, written.order, progress);
    report["loss"] = splat_loss_to_json(loss, frame);
    terminal.end(splat_loss_line(loss, frame));
  } catch (const Cancelled&) {
    throw;
  } catch (const Error& error) {
    // The file is there: that it holds too little, or was not looked at, is a finding.
    report["loss"] = {{"not_measured", error.what()}};
    missing.push_back(std::string("what the file lost could not be measured: ") + error.what());
  }
  terminal.warn(missing);
  return report;
}

Json splat_file_to_json(const GaussianFile& file) {
  const SplatFindings& f = file.findings;
  const Json evidence = file.evidence.empty() ? Json() : Json(file.evidence);
  return {{"kind", "splats"},
          {"format", file.format},
          {"counts",
           {{"in_file", f.in_file},
            {"splats", file.gaussians.size()},
            {"sh_degree", file.gaussians.sh_degree}}},
          {"bounds", bounds_json(file.gaussians, file.frame)},
          {"units", file.frame.unit_name()},
          {"evidence", evidence},
          {"provenance", provenance_json(file.gaussians)},
          {"synthetic", synthetic_json(file.gaussians)},
          {"findings",
           {{"not_finite", f.not_finite},
            {"without_rotation", f.without_rotation},
            {"transparent", f.transparent},
            {"out_of_range", f.out_of_range},
            {"clamped", f.clamped},
            {"flyaways", f.flyaways},
            {"linear_scales", f.linear_scales},
            {"linear_opacity", f.linear_opacity},
            {"fill_ratio", f.fill_ratio}}},
          {"warnings", file.warnings}};
}

}  // namespace cgs
