// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/dot_splat.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/atomic_file.h"
#include "io/byte_reader.h"
#include "io/byte_writer.h"
#include "io/splat_arrays.h"

namespace cgs {

namespace {

constexpr size_t kRecord = 32;

struct Record {
  std::array<float, 3> position;
  std::array<float, 3> scale;
  std::array<uint8_t, 4> color;
  std::array<uint8_t, 4> rotation;
};

Record record_at(ByteReader& reader) {
  Record out{};
  for (float& value : out.position) value = reader.get<float>("position");
  for (float& value : out.scale) value = reader.get<float>("scale");
  for (uint8_t& value : out.color) value = reader.get<uint8_t>("colour");
  for (uint8_t& value : out.rotation) value = reader.get<uint8_t>("rotation");
  return out;
}

Eigen::Vector4f rotation_of(const Record& record) {
  Eigen::Vector4f q = Eigen::Vector4f::Zero();
  for (size_t k = 0; k < 4; ++k) {
    q[static_cast<int>(k)] = (static_cast<float>(record.rotation.at(k)) - 128) / 128;
  }
  return q;
}

/// Quaternions say little: some writers quantise them without normalising them first.
bool is_plausible(const Record& record) {
  constexpr float kFarthest = 1e12F;
  constexpr float kSmallest = 1e-12F;
  bool good = true;
  for (const float p : record.position) {
    good = good && std::abs(p) < kFarthest && (p == 0 || std::abs(p) > kSmallest);
  }
  // Flat splats have a scale of 0.
  const auto [low, high] = std::minmax_element(record.scale.begin(), record.scale.end());
  return good && *low >= 0 && *high > kSmallest && *high < kFarthest;
}

uint8_t rotation_byte(float q) {
  return static_cast<uint8_t>(std::lround(std::clamp(128 * double{q} + 128, 0.0, 255.0)));
}

}  // namespace

bool looks_like_dot_splat(std::string_view bytes) {
  if (bytes.empty() || bytes.size() % kRecord != 0) return false;
  constexpr size_t kSamples = 1000;
  ByteReader reader(bytes, {});
  size_t good = 0;
  size_t seen = 0;
  for (; seen < kSamples && reader.remaining() > 0; ++seen) good += is_plausible(record_at(reader));
  return 100 * good >= 99 * seen;  // single records may be damaged
}

RawSplats parse_dot_splat(std::string_view bytes, const std::filesystem::path& path) {
  if (bytes.size() % kRecord != 0) {
    throw BadInput(Defect::Truncated,
                   path,
                   std::to_string(bytes.size()) + " bytes, .splat files have 32 per splat");
  }
  RawSplats out;
  out.format = ".splat";
  out.reserve(bytes.size() / kRecord);
  ByteReader reader(bytes, path);
  while (reader.remaining() > 0) {
    const Record r = record_at(reader);
    out.position.emplace_back(r.position[0], r.position[1], r.position[2]);
    out.log_scale.emplace_back(std::log(r.scale[0]), std::log(r.scale[1]), std::log(r.scale[2]));
    out.rotation.push_back(rotation_of(r));
    out.logit.push_back(logit_of_byte(r.color[3]));
    const Eigen::Vector3d color(r.color[0], r.color[1], r.color[2]);
    out.sh.emplace_back((((color / 255).array() - 0.5) / double{kShC0}).matrix().cast<float>());
  }
  return out;
}

DotSplatReport write_dot_splat(const std::filesystem::path& path,
                               const Gaussians& g,
                               const Frame& frame) {
  require_writable(g);
  DotSplatReport report;
  report.bytes = g.size() * kRecord;
  report.dropped_sh = g.sh_degree > 0;
  AtomicFile file(path);
  std::string record;
  for (size_t i = 0; i < g.size(); ++i) {
    record.clear();
    const Eigen::Vector3d p = frame.file_from_internal(g.position[i].cast<double>());
    for (const double c : p) append_bytes(record, static_cast<float>(c));
    for (const float s : g.scale[i]) append_bytes(record, static_cast<float>(s * frame.scale));
    const Eigen::Vector3f& dc = g.sh[i * static_cast<size_t>(g.sh_count())];
    const Eigen::Vector3d color = (double{kShC0} * dc.cast<double>()).array() + 0.5;
    if (color.minCoeff() < 0 || color.maxCoeff() > 1) ++report.clamped_colors;
    for (const double c : color) append_bytes(record, unit_byte(c));
    append_bytes(record, unit_byte(g.opacity[i]));
    for (const float q : g.rotation[i]) append_bytes(record, rotation_byte(q));
    file.write(record);
  }
  file.commit();
  return report;
}

}  // namespace cgs
