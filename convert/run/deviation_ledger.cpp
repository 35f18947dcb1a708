// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/run/deviation_ledger.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

#include "meshing/volume/volume.h"
#include "meshing/volume/volume_distance.h"

namespace cgs {

using Json = nlohmann::ordered_json;

namespace {

struct KnownPixels {
  bool measured_only = true;

  bool has(const ViewPriors& priors, size_t i) const {
    const float depth = priors.depth.data[i];
    return std::isfinite(depth) && depth > 0 &&
           (!measured_only || priors.origin.data[i] == DepthOrigin::Measured);
  }
  size_t count(const std::vector<ViewPriors>& views) const {
    size_t out = 0;
    for (const ViewPriors& priors : views) {
      for (size_t i = 0; i < priors.depth.data.size(); ++i) out += has(priors, i) ? 1 : 0;
    }
    return out;
  }
};

DistanceStatistics larger(const DistanceStatistics& a, const DistanceStatistics& b) {
  return {std::max(a.mean, b.mean),
          std::max(a.rms, b.rms),
          std::max(a.median, b.median),
          std::max(a.p95, b.p95),
          std::max(a.max, b.max)};
}

Json statistics_json(const DistanceStatistics& s, double scale) {
  return {{"max", s.max * scale}, {"rms", s.rms * scale}, {"p95", s.p95 * scale}};
}

}  // namespace

std::vector<Eigen::Vector3f> measured_points(const Model& model, size_t count) {
  KnownPixels known;
  size_t total = known.count(model.priors);
  if (total == 0) {
    known.measured_only = false;
    total = known.count(model.priors);
  }
  const size_t step = std::max<size_t>(1, (total + count - 1) / std::max<size_t>(1, count));
  std::vector<Eigen::Vector3f> out;
  size_t at = step / 2;  // known pixels to the next one taken
  for (size_t k = 0; k < model.priors.size(); ++k) {
    const ViewPriors& priors = model.priors[k];
    const Camera& camera = model.scene.views[static_cast<size_t>(model.scene.input[k])].camera;
    const auto width = static_cast<size_t>(priors.depth.width);
    for (size_t i = 0; i < priors.depth.data.size(); ++i) {
      if (!known.has(priors, i) || at-- > 0) continue;
      at = step - 1;
      const size_t row = i / width;
      const double u = static_cast<double>(i - row * width) + 0.5;
      const double v = static_cast<double>(row) + 0.5;
      out.emplace_back(camera.unproject(u, v, double(priors.depth.data[i])).cast<float>());
    }
  }
  return out;
}

DeviationLedger::DeviationLedger(std::vector<Eigen::Vector3f> measured)
    : measured_(std::move(measured)) {}

DeviationLedger::Surface DeviationLedger::surface_of(const TriangleMesh& mesh) {
  Surface out{sample_faces(mesh, kSamples), {}, DistanceToMesh(mesh)};
  if (mesh.provenance.empty()) return out;
  out.labels.reserve(out.samples.faces.size());
  for (const uint32_t f : out.samples.faces) out.labels.push_back(mesh.provenance[f]);
  return out;
}

void DeviationLedger::take(const std::vector<Provenance>& labels,
                           const std::vector<float>& distances,
                           DeviationStep& out) {
  std::vector<float> evidence;
  std::vector<float> inferred;
  for (size_t i = 0; i < distances.size(); ++i) {
    if (!std::isfinite(distances[i])) continue;
    const bool is_measured = labels.empty() || has_evidence(labels[i]);
    (is_measured ? evidence : inferred).push_back(distances[i]);
  }
  out.has_evidence |= !evidence.empty();
  out.has_inferred |= !inferred.empty();
  out.with_evidence = larger(out.with_evidence, statistics(std::move(evidence)));
  out.inferred = larger(out.inferred, statistics(std::move(inferred)));
}

void DeviationLedger::take_measured(std::vector<float> distances, DeviationStep& step) const {
  const auto told =
      std::partition(distances.begin(), distances.end(), [](float d) { return std::isfinite(d); });
  distances.erase(told, distances.end());
  step.outside = 1 - static_cast<double>(distances.size()) /
                         static_cast<double>(std::max<size_t>(1, measured_.size()));
  step.from_measured = statistics(std::move(distances));
}

void DeviationLedger::add(const std::string& step, const Volume& volume) {
  DeviationStep row = {.step = step, .against = last_, .samples = measured_.size()};
  const std::vector<float> distances = distances_to_observed(volume, measured_);
  take({}, distances, row);
  take_measured(distances, row);
  steps_.push_back(std::move(row));
  last_ = step;
  volume_ = &volume;
}

void DeviationLedger::add(const std::string& step, const TriangleMesh& mesh) {
  Surface now = surface_of(mesh);
  DeviationStep row = {.step = step, .against = last_, .samples = now.samples.points.size()};
  if (surface_) {
    take(now.labels, surface_->distance.of(now.samples.points), row);
    take(surface_->labels, now.distance.of(surface_->samples.points), row);
  } else if (volume_ != nullptr) {
    take(now.labels, distances_to_observed(*volume_, now.samples.points), row);
  } else {
    take({}, now.distance.of(measured_), row);
  }
  take_measured(now.distance.of(measured_), row);
  steps_.push_back(std::move(row));
  go_on_from(step, std::move(now));
}

void DeviationLedger::go_on_from(const std::string& step, const TriangleMesh& mesh) {
  go_on_from(step, surface_of(mesh));
}

void DeviationLedger::go_on_from(const std::string& step, Surface surface) {
  last_ = step;
  volume_ = nullptr;
  surface_ = std::move(surface);
}

Json deviations_to_json(const std::vector<DeviationStep>& steps, const Frame& frame) {
  Json out = Json::array();
  for (const DeviationStep& step : steps) {
    const auto figures = [&](bool has_any, const DistanceStatistics& s) {
      return has_any ? statistics_json(s, frame.scale) : Json();
    };
    Json line = {{"step", step.step},
                 {"against", step.against},
                 {"with_evidence", figures(step.has_evidence, step.with_evidence)},
                 {"inferred", figures(step.has_inferred, step.inferred)},
                 {"from_measured", figures(step.outside < 1, step.from_measured)},
                 {"samples", step.samples}};
    if (step.outside < 1) line["from_measured"]["outside"] = step.outside;
    out.push_back(std::move(line));
  }
  return out;
}

}  // namespace cgs
