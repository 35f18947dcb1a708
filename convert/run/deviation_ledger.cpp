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
                           Distances& out) {
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

void DeviationLedger::take_measured(std::vector<float> distances, Row& row) const {
  const auto told =
      std::partition(distances.begin(), distances.end(), [](float d) { return std::isfinite(d); });
  distances.erase(told, distances.end());
  row.outside = 1 - static_cast<double>(distances.size()) /
                        static_cast<double>(std::max<size_t>(1, measured_.size()));
  row.from_measured = statistics(std::move(distances));
}

void DeviationLedger::add(const std::string& step, const Volume& volume) {
  Row row{step, last_, {}, {}, 0, measured_.size()};
  const std::vector<float> distances = distances_to_observed(volume, measured_);
  take({}, distances, row.distances);
  take_measured(distances, row);
  rows_.push_back(std::move(row));
  last_ = step;
  volume_ = &volume;
}

void DeviationLedger::add(const std::string& step, const TriangleMesh& mesh) {
  Surface now = surface_of(mesh);
  Row row{step, last_, {}, {}, 0, now.samples.points.size()};
  if (surface_) {
    take(now.labels, surface_->distance.of(now.samples.points), row.distances);
    take(surface_->labels, now.distance.of(surface_->samples.points), row.distances);
  } else if (volume_ != nullptr) {
    take(now.labels, distances_to_observed(*volume_, now.samples.points), row.distances);
  } else {
    take({}, now.distance.of(measured_), row.distances);
  }
  take_measured(now.distance.of(measured_), row);
  rows_.push_back(std::move(row));
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

Json DeviationLedger::json(const Frame& frame) const {
  Json out = Json::array();
  for (const Row& row : rows_) {
    Json line = {{"step", row.step},
                 {"against", row.against},
                 {"with_evidence", nullptr},
                 {"inferred", nullptr},
                 {"from_measured", nullptr},
                 {"samples", row.samples}};
    if (row.distances.has_evidence) {
      line["with_evidence"] = statistics_json(row.distances.with_evidence, frame.scale);
    }
    if (row.distances.has_inferred) {
      line["inferred"] = statistics_json(row.distances.inferred, frame.scale);
    }
    if (row.outside < 1) {
      line["from_measured"] = statistics_json(row.from_measured, frame.scale);
      line["from_measured"]["outside"] = row.outside;
    }
    out.push_back(std::move(line));
  }
  return out;
}

}  // namespace cgs
