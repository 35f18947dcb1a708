// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/measure/comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include <nlohmann/json.hpp>

#include "io/bytes/atomic_file.h"
#include "io/drawings/svg.h"
#include "io/meshes/mesh_ply.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kBins = 40;

std::string text_of(const char* format, double value) {
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), format, value);
  return text.data();
}

std::array<size_t, 4> change_counts(const std::vector<Deviation>& deviations) {
  std::array<size_t, 4> out = {};
  for (const Deviation& d : deviations) ++out.at(static_cast<size_t>(d.change));
  return out;
}

size_t beyond_rim(const std::vector<Deviation>& deviations) {
  return static_cast<size_t>(std::count_if(
      deviations.begin(), deviations.end(), [](const Deviation& d) { return d.is_beyond_rim; }));
}

double share(size_t count, const Comparison& comparison) {
  return static_cast<double>(count) /
         static_cast<double>(
             std::max<size_t>(1, comparison.summary.count + comparison.without_distance));
}

std::array<std::pair<const char*, double>, 9> summary_rows(const DeviationSummary& s) {
  return {{{"mean", s.mean},
           {"standard_deviation", s.standard_deviation},
           {"rms", s.rms},
           {"mean_absolute", s.mean_absolute},
           {"median", s.median},
           {"p05", s.p05},
           {"p95", s.p95},
           {"p95_absolute", s.p95_absolute},
           {"max_absolute", s.max_absolute}}};
}

Json registration_json(const Registration& r, const MeasurableMesh& a, const FigureUnit& unit) {
  // The motion in file coordinates of A: x' = s R x + t.
  const Eigen::Vector3d zero = a.internal_from_file(Eigen::Vector3d::Zero());
  const Eigen::Vector3d t = a.file_from_internal(r.apply(zero));
  Json matrix = Json::array();
  for (int i = 0; i < 3; ++i) {
    matrix.push_back(
        {r.scale * r.rotation(i, 0), r.scale * r.rotation(i, 1), r.scale * r.rotation(i, 2), t[i]});
  }
  matrix.push_back({0, 0, 0, 1});
  return {{"matrix", matrix},
          {"scale", r.scale},
          {"rms_before", r.rms_before * unit.length},
          {"rms_after", r.rms_after * unit.length},
          {"share", r.share},
          {"iterations", r.iterations}};
}

// Places that somebody saw; all of a surface that nobody saw.
std::vector<Eigen::Vector3d> seen_places(ComparedPoints points) {
  std::vector<Eigen::Vector3d> out;
  for (size_t i = 0; i < points.places.size(); ++i) {
    if (points.observed[i] != 0) out.push_back(points.places[i]);
  }
  return out.empty() ? std::move(points.places) : out;
}

}  // namespace

double range_of(const std::vector<Deviation>& deviations) {
  std::vector<double> sizes;
  sizes.reserve(deviations.size());
  for (const Deviation& d : deviations) sizes.push_back(std::abs(d.distance));
  std::sort(sizes.begin(), sizes.end());
  const double most = sizes.empty() ? 0 : sizes[(sizes.size() - 1) * 98 / 100];
  return std::max(most, 1e-9);
}

Eigen::Vector3f diverging_color(double t) {
  const Eigen::Vector3f cold(0.13f, 0.30f, 0.68f);
  const Eigen::Vector3f warm(0.75f, 0.12f, 0.14f);
  const Eigen::Vector3f white = Eigen::Vector3f::Constant(0.96f);
  const auto amount = static_cast<float>(std::sqrt(std::min(1.0, std::abs(t))));
  return white + amount * ((t < 0 ? cold : warm) - white);
}

MeasurableMesh in_frame_of(const MeasurableMesh& mesh, const Frame& frame) {
  const bool known = mesh.frame.has_metric_scale() && frame.has_metric_scale();
  const double ratio = known ? mesh.frame.metres_per_unit / frame.metres_per_unit : 1;
  MeasurableMesh out = mesh;
  for (size_t v = 0; v < mesh.points.size(); ++v) {
    out.points[v] =
        frame.internal_from_world(ratio * mesh.frame.world_from_internal(mesh.points[v]));
    out.mesh.vertices[v] = out.points[v].cast<float>();
  }
  for (float& s : out.mesh.sigma) s *= static_cast<float>(ratio * mesh.frame.scale / frame.scale);
  out.frame = frame;
  return out;
}

MeasurableMesh moved(const MeasurableMesh& mesh, const Registration& motion) {
  MeasurableMesh out = mesh;
  for (size_t v = 0; v < mesh.points.size(); ++v) {
    out.points[v] = motion.apply(mesh.points[v]);
    out.mesh.vertices[v] = out.points[v].cast<float>();
  }
  const Eigen::Matrix3f rotation = motion.rotation.cast<float>();
  for (Eigen::Vector3f& n : out.mesh.normals) n = rotation * n;
  for (float& s : out.mesh.sigma) s *= static_cast<float>(motion.scale);
  return out;
}

Registration motion_onto(const MeasurableMesh& a,
                         const MeasurableMesh& b,
                         const NearestSurface& surface,
                         bool with_scale) {
  constexpr size_t kPoints = 20'000;
  return register_points(seen_places(points_by_area(a, kPoints)), b, surface, with_scale);
}

Eigen::AlignedBox3d box_of(const MeasurableMesh& mesh) {
  Eigen::AlignedBox3d out;
  for (const Eigen::Vector3d& p : mesh.points) out.extend(p);
  return out;
}

double relative_scale_sigma(const Frame& a, const Frame& b) {
  return std::hypot(figure_unit(a, "").relative_sigma, figure_unit(b, "").relative_sigma);
}

Eigen::Vector3d unmoved_by_scale(const MeasurableMesh& a, const Frame& b, bool is_registered) {
  const bool by_control_points = a.frame.scale_source == ScaleSource::ControlPoints &&
                                 b.scale_source == ScaleSource::ControlPoints;
  if (!is_registered && !by_control_points) {
    return a.frame.internal_from_world(Eigen::Vector3d::Zero());
  }
  return box_of(a).center();
}

void take_scale(Frame& to, const Frame& from, double growth) {
  const double metres = from.metres_per_unit / growth;
  const double sigma = from.metres_sigma / growth;
  to.metres_per_unit = metres;
  to.metres_sigma = sigma;
  to.scale_source = from.scale_source;
}

Json comparison_json(const Comparison& comparison,
                     const MeasurableMesh& a,
                     const FigureUnit& unit) {
  Json distance = {{"count", comparison.summary.count}};
  for (const auto& [name, value] : summary_rows(comparison.summary)) {
    distance[name] = value * unit.length;
  }
  const auto changes = change_counts(comparison.by_area);
  Json out = {
      {"unit", unit.name},
      {"distance", distance},
      {"histogram",
       {{"low", -comparison.half_range * unit.length},
        {"high", comparison.half_range * unit.length},
        {"counts",
         histogram(comparison.by_area, -comparison.half_range, comparison.half_range, kBins)}}},
      {"change",
       {{"unchanged", share(changes[1], comparison)},
        {"nearer", share(changes[2], comparison)},
        {"farther", share(changes[3], comparison)},
        {"not_comparable", share(changes[0] + comparison.without_distance, comparison)},
        {"beyond_rim", share(beyond_rim(comparison.by_area), comparison)}}},
      {"registration", nullptr},
      {"agreement", nullptr}};
  if (comparison.registration) {
    out["registration"] = registration_json(*comparison.registration, a, unit);
  }
  if (comparison.agreement) {
    out["agreement"] = {{"threshold", comparison.agreement->threshold * unit.length},
                        {"accuracy", comparison.agreement->accuracy},
                        {"completeness", comparison.agreement->completeness},
                        {"f_score", comparison.agreement->f_score()}};
  }
  return out;
}

std::string comparison_text(const Comparison& comparison, const FigureUnit& unit) {
  std::string out;
  if (comparison.registration) {
    const Registration& r = *comparison.registration;
    out += "registered: rms " + text_of("%.4g", r.rms_before * unit.length) + " -> " +
           text_of("%.4g", r.rms_after * unit.length) + ' ' + unit.name + ", scale " +
           text_of("%.8g", r.scale) + ", " + text_of("%.1f", 100 * r.share) +
           " % of the points take part, " + std::to_string(r.iterations) + " iterations\n";
  }
  for (const auto& [name, value] : summary_rows(comparison.summary)) {
    out += name;
    out += std::string(20 - std::string(name).size(), ' ') +
           text_of("%12.6g", value * unit.length) + ' ' + unit.name + "\n";
  }
  if (comparison.agreement) {
    const SurfaceAgreement& a = *comparison.agreement;
    out += "within " + text_of("%.4g", a.threshold * unit.length) + ' ' + unit.name +
           ": accuracy " + text_of("%.2f", 100 * a.accuracy) + " %, completeness " +
           text_of("%.2f", 100 * a.completeness) + " %, F-score " +
           text_of("%.2f", 100 * a.f_score()) + " %\n";
  }
  const auto changes = change_counts(comparison.by_area);
  if (changes[0] == comparison.summary.count) {
    out += "change: cannot be told, as " + comparison.no_change_rule + "\n";
  } else {
    out += "change " + comparison.change_rule + ": " +
           text_of("%.2f", 100 * share(changes[2], comparison)) + " % nearer, " +
           text_of("%.2f", 100 * share(changes[3], comparison)) + " % farther; unchanged " +
           text_of("%.2f", 100 * share(changes[1], comparison)) + " %; not comparable " +
           text_of("%.2f", 100 * share(changes[0] + comparison.without_distance, comparison)) +
           " %\n";
  }
  const size_t beyond = beyond_rim(comparison.by_area);
  if (beyond > 0) {
    out += text_of("%.2f", 100 * share(beyond, comparison)) +
           " % of the points lie beyond the rim of B, which says nothing of them: their distances "
           "are to that rim\n";
  }
  const auto counts =
      histogram(comparison.by_area, -comparison.half_range, comparison.half_range, kBins / 2);
  const size_t most = *std::max_element(counts.begin(), counts.end());
  for (size_t i = 0; i < counts.size(); ++i) {
    const double low = comparison.half_range *
                       (2.0 * static_cast<double>(i) / static_cast<double>(counts.size()) - 1);
    constexpr size_t kWidth = 50;
    out += text_of("%12.4g", low * unit.length) + " |" +
           std::string(most > 0 ? kWidth * counts[i] / most : 0, '#') + "\n";
  }
  return out;
}

void write_histogram_svg(const std::filesystem::path& path,
                         const Comparison& comparison,
                         const FigureUnit& unit,
                         const std::string& title) {
  const auto counts =
      histogram(comparison.by_area, -comparison.half_range, comparison.half_range, kBins);
  const size_t most = std::max<size_t>(1, *std::max_element(counts.begin(), counts.end()));
  std::string out =
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"900\" height=\"420\" "
      "font-family=\"system-ui, sans-serif\" font-size=\"14\">\n"
      "<rect width=\"900\" height=\"420\" fill=\"white\"/>\n<text x=\"50\" y=\"28\">" +
      xml_text(title) + "</text>\n";
  for (size_t i = 0; i < counts.size(); ++i) {
    const double middle = (2.0 * static_cast<double>(i) + 1) / kBins - 1;
    const Eigen::Vector3f color = 255 * diverging_color(middle);
    const double height = 310.0 * static_cast<double>(counts[i]) / static_cast<double>(most);
    out += "<rect x=\"" + text_of("%.1f", 50 + 20 * static_cast<double>(i)) + "\" y=\"" +
           text_of("%.1f", 360 - height) + "\" width=\"19\" height=\"" + text_of("%.1f", height) +
           "\" stroke=\"#8888\" fill=\"rgb(" + text_of("%.0f", double(color[0])) + "," +
           text_of("%.0f", double(color[1])) + "," + text_of("%.0f", double(color[2])) + ")\"/>\n";
  }
  for (const int k : {-2, -1, 0, 1, 2}) {
    out += "<text text-anchor=\"middle\" x=\"" + text_of("%.0f", 450 + 200.0 * k) +
           "\" y=\"382\">" + text_of("%.4g", comparison.half_range * k / 2 * unit.length) +
           "</text>\n";
  }
  out += "<text text-anchor=\"middle\" x=\"450\" y=\"406\">signed distance [" +
         xml_text(unit.name) + "], " + std::to_string(comparison.summary.count) + " points, rms " +
         text_of("%.4g", comparison.summary.rms * unit.length) + "</text>\n</svg>\n";
  write_file(path, out);
}

void write_colored(const std::filesystem::path& path,
                   const MeasurableMesh& mesh,
                   const std::vector<Deviation>& of_vertices,
                   double half_range) {
  TriangleMesh out = mesh.mesh;
  VertexScalar distance{"scalar_distance", {}};
  VertexScalar change{"scalar_change", {}};
  out.colors.clear();
  for (const Deviation& d : of_vertices) {
    distance.values.push_back(static_cast<float>(d.distance * mesh.frame.scale));
    change.values.push_back(static_cast<float>(d.change));
    out.colors.push_back(diverging_color(d.distance / half_range));
  }
  write_mesh_ply(path, out, mesh.frame, {distance, change});
}

}  // namespace cgs
