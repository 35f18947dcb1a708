// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/measure/m3c2_comparison.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

#include <nlohmann/json.hpp>

#include "convert/text/length.h"
#include "io/bytes/json_file.h"
#include "io/meshes/mesh_ply.h"
#include "libcgs/core/error.h"
#include "libcgs/core/kd_tree.h"
#include "libcgs/core/up_axis.h"
#include "meshing/mesh/point_normals.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

// "0", or 0 of any unit: other lengths must be positive, but an error may be none.
// \throws InvalidInput for an unknown unit
bool is_none(const std::string& length) {
  const char* const last = length.data() + length.size();
  double value = 0;
  const auto [end, error] = std::from_chars(length.data(), last, value);
  if (error != std::errc() || value != 0) return false;
  std::string unit(end, last);
  unit.erase(0, unit.find_first_not_of(' '));
  if (!unit.empty()) (void)metres_in(unit, "--registration-error");
  return true;
}

M3c2Options options_of(const M3c2Request& request,
                       const ComparedPoints& a,
                       const ComparedPoints& b,
                       const Frame& frame) {
  M3c2Options out =
      m3c2_scales(request.cylinder.empty() ? spacing_cylinder(a, b)
                                           : parse_length(request.cylinder, frame, "--cylinder"));
  if (!request.normal_scale.empty())
    out.normal_scale = parse_length(request.normal_scale, frame, "--normal-scale");
  if (!request.depth.empty()) out.depth = parse_length(request.depth, frame, "--cylinder-depth");
  if (!request.registration.empty() && !is_none(request.registration)) {
    out.registration = parse_length(request.registration, frame, "--registration-error");
  }
  out.scale_sigma = request.scale_sigma;
  out.center = request.scale_center;
  return out;
}

// Which side of every vertex is outside.
struct Outward {
  std::vector<Eigen::Vector3f> directions;
  std::vector<uint8_t> is_known;  // 0 where it may as well be the other side
  bool is_stated = true;          // by the file; else guessed from how the points lie
};

// Neighbours agree, and the topmost vertex of every part looks up; nobody knows where that is
// hardly more up than down.
Outward estimated_outward(const MeasurableMesh& mesh) {
  constexpr size_t kNeighbors = 12;
  constexpr float kSteep = 0.5f;  // a normal less upright than 30 degrees
  const Eigen::Matrix3f z_up =
      z_up_from(mesh.frame.knows_up() ? mesh.frame.up : Eigen::Vector3d(Eigen::Vector3d::UnitZ()))
          .cast<float>();
  std::vector<Eigen::Vector3f> upright;
  upright.reserve(mesh.mesh.vertices.size());
  for (const Eigen::Vector3f& p : mesh.mesh.vertices) upright.emplace_back(z_up * p);
  Outward out;
  out.is_stated = false;
  out.directions = estimated_normals(upright, kNeighbors);
  for (const uint32_t start : turn_consistently(out.directions, upright, kNeighbors)) {
    out.is_known.push_back(out.directions[start].z() >= kSteep ? 1 : 0);
  }
  for (Eigen::Vector3f& n : out.directions) n = z_up.transpose() * n;
  return out;
}

// Vertices without a direction take that of the nearest one with.
void fill_from_nearest(std::vector<Eigen::Vector3f>& directions,
                       const std::vector<Eigen::Vector3f>& places) {
  std::vector<Eigen::Vector3f> known;
  std::vector<Eigen::Vector3f> known_places;
  for (size_t i = 0; i < directions.size(); ++i) {
    if (!is_known_normal(directions[i])) continue;
    known.push_back(directions[i]);
    known_places.push_back(places[i]);
  }
  if (known.empty() || known.size() == directions.size()) return;
  const KdTree tree(known_places);
  std::vector<Neighbor> found;
  for (size_t i = 0; i < directions.size(); ++i) {
    if (is_known_normal(directions[i])) continue;
    tree.nearest(places[i], 1, found);
    directions[i] = known[found.front().point];
  }
}

// By faces, or by normals; empty if there are none.
std::vector<Eigen::Vector3f> stated_outward(const MeasurableMesh& mesh) {
  std::vector<Eigen::Vector3f> out =
      mesh.mesh.faces.empty() ? mesh.mesh.normals : vertex_normals(mesh.mesh);
  // Some programs write normals that are all 0.
  if (std::none_of(out.begin(), out.end(), is_known_normal)) return {};
  fill_from_nearest(out, mesh.mesh.vertices);
  return out;
}

Outward outward_of(const MeasurableMesh& mesh) {
  Outward out;
  out.directions = stated_outward(mesh);
  if (out.directions.empty()) {
    out = estimated_outward(mesh);
    fill_from_nearest(out.directions, mesh.mesh.vertices);
  } else {
    out.is_known.assign(out.directions.size(), 1);
  }
  return out;
}

// Whether nearly all of A looks against what of B is nearest: one of them is inside out. (Half of
// it does where a thin thing moved by more than half its thickness.)
bool look_against(const MeasurableMesh& a,
                  const std::vector<Eigen::Vector3f>& outward_a,
                  const MeasurableMesh& b,
                  const std::vector<Eigen::Vector3f>& outward_b) {
  constexpr size_t kAsked = 2000;
  constexpr double kNearlyAll = 0.5;  // mean cosine: three quarters against one
  const size_t step = std::max<size_t>(1, outward_a.size() / kAsked);
  const KdTree tree(b.mesh.vertices);
  std::vector<Neighbor> found;
  double sum = 0;
  double asked = 0;
  for (size_t i = 0; i < outward_a.size(); i += step) {
    tree.nearest(a.mesh.vertices[i], 1, found);
    const Eigen::Vector3f& there = outward_b[found.front().point];
    sum += double(outward_a[i].stableNormalized().dot(there.stableNormalized()));
    ++asked;
  }
  return sum < -kNearlyAll * asked;
}

// Tells both clouds which sides of them are outside, if both say so.
void add_sides(const MeasurableMesh& a,
               const Outward& outward_a,
               const MeasurableMesh& b,
               ComparedPoints& points_a,
               ComparedPoints& points_b) {
  if (!outward_a.is_stated) return;
  std::vector<Eigen::Vector3f> outward_b = stated_outward(b);
  if (outward_b.empty()) return;
  if (look_against(a, outward_a.directions, b, outward_b)) {
    for (Eigen::Vector3f& n : outward_b) n = -n;
  }
  points_a.outward = outward_a.directions;
  points_b.outward = std::move(outward_b);
}

// What the variance comes from of the means of one side, whose columns have so many points.
std::string variance_source(const std::vector<M3c2Place>& places,
                            uint32_t M3c2Place::*count,
                            uint32_t M3c2Place::*stated) {
  bool all = true;
  bool none = true;
  for (const M3c2Place& place : places) {
    if (!std::isfinite(place.distance)) continue;
    all = all && place.*stated == place.*count;
    none = none && place.*stated == 0;
  }
  return all ? "sigma" : none ? "roughness" : "mixed";
}

[[noreturn]] void refuse_without_distance(const M3c2Comparison& found, const Frame& frame) {
  const bool has_normals =
      std::any_of(found.places.begin(), found.places.end(), [](const M3c2Place& p) {
        return is_known_normal(p.normal);
      });
  if (!has_normals) {
    throw InvalidInput("no point of A has four seen points within " +
                       format_length(0.5 * found.options.normal_scale, frame) +
                       " that are not on a line: --normal-scale or --cylinder must be larger");
  }
  throw InvalidInput(
      "no point of A has points of B in its cylinder, " +
      format_length(found.options.cylinder, frame) + " wide and " +
      format_length(found.options.depth, frame) +
      " to either side: are both in the same place and unit? --cylinder-depth reaches farther");
}

double at_share(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return std::nan("");
  return sorted[static_cast<size_t>(share * static_cast<double>(sorted.size() - 1))];
}

// What is doubtful about the distances, a line each.
std::string doubts_text(const M3c2Comparison& found) {
  std::array<char, 300> text{};
  std::string out;
  if (!found.is_sign_known()) {
    std::snprintf(
        text.data(),
        text.size(),
        "the SIGN of %.3g %% of the distances is not known: A, or parts of it, is a steep "
        "cloud without faces and normals\n",
        100 * found.unknown_signs);
    out += text.data();
  }
  if (found.is_split()) {
    std::snprintf(text.data(),
                  text.size(),
                  "%.3g %% of the distances are between MEANS OF TWO SURFACES or more, farther "
                  "apart than a cylinder is wide: a smaller --cylinder-depth keeps them apart\n",
                  100 * found.split);
    out += text.data();
  }
  return out;
}

bool is_significant(const M3c2Place& place) {
  return place.change == Change::Nearer || place.change == Change::Farther;
}

Eigen::Vector3f color_of(const M3c2Place& place, double half_range) {
  if (place.change == Change::Unknown) return Eigen::Vector3f::Constant(0.55f);
  return diverging_color(is_significant(place) ? place.distance / half_range : 0);
}

}  // namespace

M3c2Comparison compare_m3c2(const M3c2Request& request,
                            const MeasurableMesh& a,
                            const MeasurableMesh& b) {
  ComparedPoints points_a = points_by_vertex(a);
  ComparedPoints points_b = points_by_vertex(b);
  M3c2Comparison out;
  out.options = options_of(request, points_a, points_b, a.frame);
  const Outward outward = outward_of(a);
  add_sides(a, outward, b, points_a, points_b);
  out.places = m3c2(points_a.places, outward.directions, points_a, points_b, out.options);
  size_t unknown_signs = 0;
  size_t split = 0;
  constexpr double kOf95Percent = 1.96;
  for (size_t i = 0; i < out.places.size(); ++i) {
    M3c2Place& place = out.places[i];
    if (points_a.observed[i] == 0) place = {.distance = std::nan(""), .detection = std::nan("")};
    if (!std::isfinite(place.distance)) {
      ++out.comparison.without_distance;
      continue;
    }
    out.comparison.by_area.push_back(
        {place.distance, place.detection / kOf95Percent, place.change});
    if (outward.is_known[i] == 0) ++unknown_signs;
    if (place.is_split) ++split;
  }
  if (out.comparison.by_area.empty()) refuse_without_distance(out, a.frame);
  const auto distances = static_cast<double>(out.comparison.by_area.size());
  out.unknown_signs = static_cast<double>(unknown_signs) / distances;
  out.split = static_cast<double>(split) / distances;
  out.variance_a = variance_source(out.places, &M3c2Place::count_a, &M3c2Place::stated_a);
  out.variance_b = variance_source(out.places, &M3c2Place::count_b, &M3c2Place::stated_b);
  out.comparison.summary = summarize(out.comparison.by_area);
  out.comparison.half_range = range_of(out.comparison.by_area);
  out.comparison.change_rule = "beyond the level of detection (95 %)";
  out.comparison.no_change_rule = "no cylinder holds four points of either side";
  return out;
}

std::vector<double> known_detections(const M3c2Comparison& found) {
  std::vector<double> out;
  for (const M3c2Place& place : found.places) {
    if (std::isfinite(place.detection)) out.push_back(place.detection);
  }
  std::sort(out.begin(), out.end());
  return out;
}

Json m3c2_json(const M3c2Comparison& found, const MeasurableMesh& a, const FigureUnit& unit) {
  Json out = comparison_json(found.comparison, a, unit);
  const std::vector<double> detections = known_detections(found);
  const auto all = static_cast<double>(std::max<size_t>(1, found.places.size()));
  out["m3c2"] = {{"normal_scale", found.options.normal_scale * unit.length},
                 {"cylinder", found.options.cylinder * unit.length},
                 {"cylinder_depth", found.options.depth * unit.length},
                 {"registration_error", found.options.registration * unit.length},
                 {"scale_sigma", found.options.scale_sigma},
                 {"variance_a", found.variance_a},
                 {"variance_b", found.variance_b},
                 {"sign_known", found.is_sign_known()},
                 {"places", found.places.size()},
                 {"with_distance", static_cast<double>(found.comparison.by_area.size()) / all},
                 {"with_detection", static_cast<double>(detections.size()) / all},
                 {"split", found.split},
                 {"detection",
                  {{"median", number_or_null(at_share(detections, 0.5) * unit.length)},
                   {"p95", number_or_null(at_share(detections, 0.95) * unit.length)}}}};
  return out;
}

std::string m3c2_text(const M3c2Comparison& found, const FigureUnit& unit) {
  const std::vector<double> detections = known_detections(found);
  const auto words = [](const std::string& source) {
    return source == "mixed" ? std::string("sigma or roughness") : source;
  };
  std::array<char, 500> text{};
  std::string out = "level of detection (95 %): none\n";
  if (!detections.empty()) {
    std::snprintf(text.data(),
                  text.size(),
                  "level of detection (95 %%): median %.4g %s, 95 %% below %.4g; by %s of A and %s "
                  "of B, registration %.4g, scale %.2g %%\n",
                  at_share(detections, 0.5) * unit.length,
                  unit.name.c_str(),
                  at_share(detections, 0.95) * unit.length,
                  words(found.variance_a).c_str(),
                  words(found.variance_b).c_str(),
                  found.options.registration * unit.length,
                  100 * found.options.scale_sigma);
    out = text.data();
  }
  std::snprintf(text.data(),
                text.size(),
                "normals within %.4g %s, cylinders %.4g wide and %.4g to "
                "either side; %.1f %% of %zu places have both sides in theirs\n",
                found.options.normal_scale * unit.length,
                unit.name.c_str(),
                found.options.cylinder * unit.length,
                found.options.depth * unit.length,
                100 * static_cast<double>(found.comparison.by_area.size()) /
                    static_cast<double>(std::max<size_t>(1, found.places.size())),
                found.places.size());
  out += text.data();
  return out + doubts_text(found);
}

void write_m3c2_ply(const std::filesystem::path& path,
                    const MeasurableMesh& a,
                    const M3c2Comparison& found) {
  TriangleMesh out = a.mesh;
  out.colors.clear();
  out.normals.clear();
  std::vector<VertexScalar> scalars;
  const auto add = [&](const char* name, const auto& value) {
    VertexScalar scalar{name, {}};
    for (const M3c2Place& p : found.places) scalar.values.push_back(static_cast<float>(value(p)));
    scalars.push_back(std::move(scalar));
  };
  const double scale = a.frame.scale;
  add("scalar_distance", [&](const M3c2Place& p) { return p.distance * scale; });
  add("scalar_detection", [&](const M3c2Place& p) { return p.detection * scale; });
  add("scalar_roughness_a", [&](const M3c2Place& p) { return p.roughness_a * scale; });
  add("scalar_roughness_b", [&](const M3c2Place& p) { return p.roughness_b * scale; });
  add("scalar_count_a", [](const M3c2Place& p) { return p.count_a; });
  add("scalar_count_b", [](const M3c2Place& p) { return p.count_b; });
  add("scalar_change", [](const M3c2Place& p) { return int(p.change); });
  add("scalar_significant", [](const M3c2Place& p) { return is_significant(p) ? 1 : 0; });
  for (const M3c2Place& p : found.places) {
    out.normals.push_back(p.normal);
    out.colors.push_back(color_of(p, found.comparison.half_range));
  }
  write_mesh_ply(path, out, a.frame, scalars);
}

}  // namespace cgs
