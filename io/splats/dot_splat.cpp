// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/dot_splat.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_reader.h"
#include "io/bytes/byte_writer.h"
#include "io/splats/splat_arrays.h"

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

constexpr float kFarthest = 1e12F;
constexpr float kSmallest = 1e-12F;

/// Quaternions say little: some writers quantise them without normalising them first.
bool is_plausible(const Record& record) {
  bool good = true;
  for (const float p : record.position) {
    good = good && std::abs(p) < kFarthest && (p == 0 || std::abs(p) > kSmallest);
  }
  // Flat splats have a scale of 0.
  const auto [low, high] = std::minmax_element(record.scale.begin(), record.scale.end());
  return good && *low >= 0 && *high > kSmallest && *high < kFarthest;
}

constexpr size_t kSamples = 1000;  // records from the start that tell whether a file is one

/// Single records may be damaged.
bool are_enough(size_t plausible, size_t seen) { return 100 * plausible >= 99 * seen; }

uint8_t rotation_byte(float q) {
  return static_cast<uint8_t>(std::lround(std::clamp(128 * double{q} + 128, 0.0, 255.0)));
}

/// Zero where a difference that is rounded away would make the number implausible.
float coordinate(double c) {
  const auto rounded = static_cast<float>(c);
  return std::abs(rounded) > kSmallest ? rounded : 0.0F;
}

Eigen::Vector3d color_of(const Eigen::Vector3f& dc) {
  return (double{kShC0} * dc.cast<double>()).array() + 0.5;
}

Record record_of(const Gaussians& g, size_t i, const Eigen::Vector3d& color, const Frame& frame) {
  Record out{};
  const Eigen::Vector3d p = frame.file_from_internal(g.position[i].cast<double>());
  for (int k = 0; k < 3; ++k) {
    const auto at = static_cast<size_t>(k);
    out.position.at(at) = coordinate(p[k]);
    out.scale.at(at) = static_cast<float>(g.scale[i][k] * frame.scale);
    out.color.at(at) = unit_byte(color[k]);
  }
  out.color[3] = unit_byte(g.opacity[i]);
  const Eigen::Vector4f rotation = g.rotation[i].stableNormalized();  // a byte holds 1 at most
  for (size_t k = 0; k < 4; ++k) {
    out.rotation.at(k) = rotation_byte(rotation[static_cast<int>(k)]);
  }
  return out;
}

void append_record(std::string& out, const Record& record) {
  for (const float value : record.position) append_bytes(out, value);
  for (const float value : record.scale) append_bytes(out, value);
  for (const uint8_t value : record.color) append_bytes(out, value);
  for (const uint8_t value : record.rotation) append_bytes(out, value);
}

}  // namespace

bool looks_like_dot_splat(std::string_view bytes) {
  if (bytes.empty() || bytes.size() % kRecord != 0) return false;
  ByteReader reader(bytes, {});
  size_t good = 0;
  size_t seen = 0;
  for (; seen < kSamples && reader.remaining() > 0; ++seen) good += is_plausible(record_at(reader));
  return are_enough(good, seen);
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
  std::string bytes;
  size_t plausible = 0;
  size_t seen = 0;
  for (size_t i = 0; i < g.size(); ++i) {
    const Eigen::Vector3d color = color_of(g.sh[i * static_cast<size_t>(g.sh_count())]);
    if (color.minCoeff() < 0 || color.maxCoeff() > 1) ++report.clamped_colors;
    const Record record = record_of(g, i, color, frame);
    if (seen < kSamples) {
      ++seen;
      plausible += is_plausible(record);
    }
    bytes.clear();
    append_record(bytes, record);
    file.write(bytes);
  }
  if (!are_enough(plausible, seen)) {
    throw InvalidInput("write_dot_splat: " + std::to_string(seen - plausible) + " of the first " +
                       std::to_string(seen) +
                       " splats are not between 1e-12 and 1e12 in size and place, and a .splat, "
                       "which has no header, is known by that; write .ply or .glb");
  }
  file.commit();
  return report;
}

}  // namespace cgs
