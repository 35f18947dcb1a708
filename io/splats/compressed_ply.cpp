// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/compressed_ply.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include <Eigen/Geometry>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/morton_order.h"
#include "io/ply/frame.h"
#include "io/ply/rows.h"
#include "io/splats/splat_arrays.h"
#include "libcgs/core/error.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

namespace {

constexpr uint64_t kChunk = 256;  // splats that share their ranges

constexpr std::array<const char*, 4> kPacked = {
    "packed_position", "packed_rotation", "packed_scale", "packed_color"};

/// The lowest `bits` bits as a number in [0, 1].
double unit(uint32_t packed, int bits) {
  const uint32_t mask = (1U << bits) - 1;
  return static_cast<double>(packed & mask) / mask;
}

/// 11, 10 and 11 bits from the highest on.
Eigen::Vector3d three_units(uint32_t packed) {
  return {unit(packed >> 21, 11), unit(packed >> 11, 10), unit(packed, 11)};
}

/// The index of the largest entry (w, x, y, z) in two bits, the others in ten each.
Eigen::Vector4f unpacked_rotation(uint32_t packed) {
  const std::array<double, 3> others = {
      unit(packed >> 20, 10), unit(packed >> 10, 10), unit(packed, 10)};
  const auto largest = static_cast<int>(packed >> 30);
  Eigen::Vector4d q = Eigen::Vector4d::Zero();
  double rest = 1;
  for (int i = 0, k = 0; i < 4; ++i) {
    if (i == largest) continue;
    q[i] = (others.at(static_cast<size_t>(k++)) - 0.5) * std::numbers::sqrt2;
    rest -= q[i] * q[i];
  }
  q[largest] = std::sqrt(std::max(0.0, rest));
  return q.cast<float>();
}

struct Range {
  Eigen::Vector3d low, high;
  Eigen::Vector3d at(const Eigen::Vector3d& t) const {
    return low.cwiseProduct(Eigen::Vector3d::Ones() - t) + high.cwiseProduct(t);
  }
};

struct Chunk {
  Range position, log_scale, color;
};

/// A splat in the numbers that are packed.
struct PackedValues {
  Eigen::Vector3d position, log_scale, color;
};

/// A number in [0, 1] in the nearest of 2^bits steps.
uint32_t packed_unit(double value, int bits) {
  const double most = (1U << bits) - 1;
  return static_cast<uint32_t>(std::lround(most * std::clamp(value, 0.0, 1.0)));
}

uint32_t packed_three(const Eigen::Vector3d& t) {
  return packed_unit(t[0], 11) << 21 | packed_unit(t[1], 10) << 11 | packed_unit(t[2], 11);
}

uint32_t packed_rotation(const Eigen::Vector4f& rotation) {
  Eigen::Vector4d q = rotation.cast<double>().normalized();
  Eigen::Index largest = 0;
  q.cwiseAbs().maxCoeff(&largest);
  if (q[largest] < 0) q = -q;
  auto out = static_cast<uint32_t>(largest);
  for (Eigen::Index i = 0; i < 4; ++i) {
    if (i != largest) out = out << 10 | packed_unit(q[i] / std::numbers::sqrt2 + 0.5, 10);
  }
  return out;
}

/// A harmonic in [-4, 4]; the reader takes the middle of the step.
uint8_t harmonic_byte(float c) {
  return static_cast<uint8_t>(std::clamp(std::floor(256 * (double{c} / 8 + 0.5)), 0.0, 255.0));
}

/// The range of float that holds a box.
Range rounded_outwards(const Eigen::AlignedBox3d& box) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  Range out{box.min(), box.max()};
  for (int k = 0; k < 3; ++k) {
    const auto low = static_cast<float>(box.min()[k]);
    const auto high = static_cast<float>(box.max()[k]);
    out.low[k] = low > box.min()[k] ? std::nextafter(low, -kInfinity) : low;
    out.high[k] = high < box.max()[k] ? std::nextafter(high, kInfinity) : high;
  }
  return out;
}

/// Where a value lies in its range, in [0, 1].
Eigen::Vector3d placed(const Range& range, const Eigen::Vector3d& value) {
  const Eigen::Vector3d size = range.high - range.low;
  const Eigen::Vector3d t = (value - range.low).cwiseQuotient(size);
  return (size.array() > 0).select(t, Eigen::Vector3d::Zero());
}

/// Packs splats in their order, chunk by chunk.
class SplatPacker {
 public:
  SplatPacker(const Gaussians& g, const Frame& frame, const std::vector<uint32_t>& order)
      : g_(g), frame_(frame), order_(order) {}

  std::string chunk_bytes() {
    std::string out;
    for (size_t begin = 0; begin < order_.size(); begin += kChunk) {
      chunks_.push_back(chunk_of(
          std::span(order_).subspan(begin, std::min<size_t>(kChunk, order_.size() - begin))));
      for (const Range* range :
           {&chunks_.back().position, &chunks_.back().log_scale, &chunks_.back().color}) {
        for (const double c : range->low) append_bytes(out, static_cast<float>(c));
        for (const double c : range->high) append_bytes(out, static_cast<float>(c));
      }
    }
    return out;
  }

  /// \pre chunk_bytes() was called
  void append_splat(std::string& out, size_t place) const {
    const size_t i = order_[place];
    const Chunk& chunk = chunks_[place / kChunk];
    const PackedValues values = values_of(i);
    const Eigen::Vector3d color = placed(chunk.color, values.color);
    append_bytes(out, packed_three(placed(chunk.position, values.position)));
    append_bytes(out, packed_rotation(g_.rotation[i]));
    append_bytes(out, packed_three(placed(chunk.log_scale, values.log_scale)));
    append_bytes(out,
                 packed_unit(color[0], 8) << 24 | packed_unit(color[1], 8) << 16 |
                     packed_unit(color[2], 8) << 8 | unit_byte(g_.opacity[i]));
  }

  /// \return whether a harmonic was out of range
  bool append_harmonics(std::string& out, size_t place) const {
    const auto count = static_cast<size_t>(g_.sh_count());
    const Eigen::Vector3f* sh = g_.sh.data() + order_[place] * count;
    bool clamped = false;
    for (int channel = 0; channel < 3; ++channel) {
      for (size_t k = 1; k < count; ++k) {
        append_bytes(out, harmonic_byte(sh[k][channel]));
        clamped = clamped || std::abs(sh[k][channel]) > 4;
      }
    }
    return clamped;
  }

 private:
  PackedValues values_of(size_t i) const {
    const Eigen::Vector3f& dc = g_.sh[i * static_cast<size_t>(g_.sh_count())];
    return {frame_.file_from_internal(g_.position[i].cast<double>()),
            (frame_.scale * g_.scale[i].cast<double>()).array().log(),
            (double{kShC0} * dc.cast<double>()).array() + 0.5};
  }

  Chunk chunk_of(std::span<const uint32_t> splats) const {
    Eigen::AlignedBox3d position;
    Eigen::AlignedBox3d log_scale;
    Eigen::AlignedBox3d color;
    for (const uint32_t i : splats) {
      const PackedValues values = values_of(i);
      position.extend(values.position);
      log_scale.extend(values.log_scale);
      color.extend(values.color);
    }
    return {rounded_outwards(position), rounded_outwards(log_scale), rounded_outwards(color)};
  }

  const Gaussians& g_;
  const Frame& frame_;
  const std::vector<uint32_t>& order_;
  std::vector<Chunk> chunks_;
};

std::string packed_header(const Gaussians& g, const Frame& frame, const std::string& evidence) {
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment ";
  out += kPlyGenerator;
  out += '\n';
  out += ply_frame_comments(frame) + ply_evidence_comment(evidence);
  out += "element chunk " + std::to_string((g.size() + kChunk - 1) / kChunk) + "\n";
  for (const auto& [prefix, names] : {std::pair(std::string(), "xyz"),
                                      std::pair(std::string("scale_"), "xyz"),
                                      std::pair(std::string(), "rgb")}) {
    for (const char* end : {"min_", "max_"}) {
      for (const char axis : std::string(names)) {
        out += "property float " + (end + prefix) + axis + "\n";
      }
    }
  }
  out += "element vertex " + std::to_string(g.size()) + "\n";
  for (const char* name : kPacked) out += std::string("property uint ") + name + "\n";
  if (g.sh_degree > 0) out += "element sh " + std::to_string(g.size()) + "\n";
  for (int k = 0; k < 3 * (g.sh_count() - 1); ++k) {
    out += "property uchar f_rest_" + std::to_string(k) + "\n";
  }
  return out + "end_header\n";
}

class PackedRows {
 public:
  PackedRows(const PlyHeader& header, const std::filesystem::path& path)
      : path_(path), chunk_(*header.find("chunk")), vertex_(*header.find("vertex")) {
    for (const char* axis : {"x", "y", "z"}) add_range(position_, "", axis);
    for (const char* axis : {"x", "y", "z"}) add_range(scale_, "scale_", axis);
    if (chunk_.find("min_r") >= 0) {
      for (const char* channel : {"r", "g", "b"}) add_range(color_, "", channel);
    }
    for (size_t k = 0; k < packed_.size(); ++k) packed_.at(k) = word_column(kPacked.at(k));
    const PlyElement* sh = header.find("sh");
    if (sh != nullptr) find_coefficients(*sh);
    const uint64_t needed = (vertex_.count + kChunk - 1) / kChunk;
    if (chunk_.count < needed) {
      fail(Defect::Count,
           std::to_string(vertex_.count) + " splats need " + std::to_string(needed) +
               " chunks, the file has " + std::to_string(chunk_.count));
    }
    splats_.format = "compressed PLY";
  }

  void add(const PlyElement& element, uint64_t row, const PlyRow& values) {
    if (element.name == "chunk") add_chunk(values);
    if (element.name == "vertex") add_splat(row, values);
    if (element.name == "sh") add_coefficients(row, values);
  }

  RawSplats take() { return std::move(splats_); }

 private:
  int column(const PlyElement& element, const std::string& name) const {
    const int i = element.find(name);
    if (i < 0 || element.properties[static_cast<size_t>(i)].is_list) {
      fail(Defect::Schema, "element " + element.name + " has no number " + name);
    }
    return i;
  }

  int word_column(const char* name) const {
    const int i = column(vertex_, name);
    const PlyType type = vertex_.properties[static_cast<size_t>(i)].type;
    if (type != PlyType::UInt32 && type != PlyType::Int32) {
      fail(Defect::Schema, std::string(name) + " is no whole number of 32 bits");
    }
    return i;
  }

  void add_range(std::vector<std::array<int, 2>>& out, const std::string& of, const char* axis) {
    out.push_back({column(chunk_, "min_" + of + axis), column(chunk_, "max_" + of + axis)});
  }

  void find_coefficients(const PlyElement& sh) {
    if (sh.count != vertex_.count) {
      fail(Defect::Count,
           std::to_string(sh.count) + " rows of sh for " + std::to_string(vertex_.count) +
               " splats");
    }
    const size_t count = sh.properties.size();
    if (count != 9 && count != 24 && count != 45) {
      fail(Defect::Schema, std::to_string(count) + " coefficients, allowed are 9, 24 and 45");
    }
    for (size_t k = 0; k < count; ++k) rest_.push_back(column(sh, "f_rest_" + std::to_string(k)));
    splats_.sh_degree = count == 9 ? 1 : count == 24 ? 2 : 3;
  }

  static Range range(const PlyRow& row, const std::vector<std::array<int, 2>>& columns) {
    Range out{Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones()};
    for (size_t k = 0; k < columns.size(); ++k) {
      out.low[static_cast<int>(k)] = row.values[static_cast<size_t>(columns[k][0])];
      out.high[static_cast<int>(k)] = row.values[static_cast<size_t>(columns[k][1])];
    }
    return out;
  }

  void add_chunk(const PlyRow& row) {
    chunks_.push_back({range(row, position_), range(row, scale_), range(row, color_)});
  }

  void add_splat(uint64_t row, const PlyRow& values) {
    if (row / kChunk >= chunks_.size()) fail(Defect::Schema, "element chunk after vertex");
    const Chunk& chunk = chunks_[row / kChunk];
    const auto packed = [&](size_t k) {
      return static_cast<uint32_t>(
          static_cast<int64_t>(values.values[static_cast<size_t>(packed_.at(k))]));
    };
    splats_.position.emplace_back(chunk.position.at(three_units(packed(0))));
    splats_.rotation.emplace_back(unpacked_rotation(packed(1)));
    splats_.log_scale.emplace_back(chunk.log_scale.at(three_units(packed(2))).cast<float>());
    const uint32_t color = packed(3);
    const Eigen::Vector3d t(unit(color >> 24, 8), unit(color >> 16, 8), unit(color >> 8, 8));
    const Eigen::Vector3d dc = (chunk.color.at(t).array() - 0.5) / double{kShC0};
    splats_.sh.emplace_back(dc.cast<float>());
    splats_.logit.push_back(logit_of_byte(static_cast<uint8_t>(color)));
    splats_.sh.resize(splats_.sh.size() + rest_.size() / 3, Eigen::Vector3f::Zero());
  }

  void add_coefficients(uint64_t row, const PlyRow& values) {
    const size_t per_channel = rest_.size() / 3;
    if (splats_.size() <= row) fail(Defect::Schema, "element sh before vertex");
    for (size_t k = 0; k < rest_.size(); ++k) {
      const double byte = values.values[static_cast<size_t>(rest_[k])];
      const double t = byte <= 0 ? 0 : byte >= 255 ? 1 : (byte + 0.5) / 256;
      const size_t at = row * (per_channel + 1) + 1 + k % per_channel;
      splats_.sh[at][static_cast<int>(k / per_channel)] = static_cast<float>(8 * (t - 0.5));
    }
  }

  [[noreturn]] void fail(Defect defect, const std::string& reason) const {
    throw BadInput(defect, path_, reason);
  }

  const std::filesystem::path& path_;
  const PlyElement& chunk_;
  const PlyElement& vertex_;
  std::vector<std::array<int, 2>> position_, scale_, color_;  // columns of lowest and highest
  std::array<int, 4> packed_{};
  std::vector<int> rest_;
  std::vector<Chunk> chunks_;
  RawSplats splats_;
};

}  // namespace

bool is_compressed_ply(const PlyHeader& header) {
  const PlyElement* vertex = header.find("vertex");
  return vertex != nullptr && header.find("chunk") != nullptr &&
         vertex->find("packed_position") >= 0;
}

RawSplats parse_compressed_ply(std::string_view bytes, const std::filesystem::path& path) {
  const PlyHeader header = parse_ply_header(bytes, path);
  if (!is_compressed_ply(header)) throw BadInput(Defect::Schema, path, "no packed splats");
  if (header.find("vertex")->count == 0) throw BadInput(Defect::Empty, path, "0 vertices");
  PackedRows rows(header, path);
  const uint64_t trailing = read_ply_rows(
      bytes, path, header, [&](const PlyElement& element, uint64_t row, const PlyRow& values) {
        rows.add(element, row, values);
      });
  RawSplats out = rows.take();
  out.comments = header.comments;
  out.evidence = ply_evidence(out.comments);
  if (trailing > 0) {
    out.notes.push_back("trailing " + std::to_string(trailing) + " bytes ignored");
  }
  return out;
}

CompressedPlyReport write_compressed_ply(const std::filesystem::path& path,
                                         const Gaussians& gaussians,
                                         const Frame& frame,
                                         const std::string& evidence) {
  require_writable(gaussians);
  require(gaussians.size() < std::numeric_limits<uint32_t>::max(),
          "write_compressed_ply: number of splats must be below 2^32",
          gaussians.size());
  CompressedPlyReport report;
  report.order = morton_order(gaussians.position);
  SplatPacker packer(gaussians, frame, report.order);
  AtomicFile file(path);
  const auto write = [&](const std::string& bytes) {
    file.write(bytes);
    report.bytes += bytes.size();
  };
  write(packed_header(gaussians, frame, evidence));
  write(packer.chunk_bytes());
  std::string record;
  for (size_t place = 0; place < gaussians.size(); ++place) {
    record.clear();
    packer.append_splat(record, place);
    write(record);
  }
  for (size_t place = 0; gaussians.sh_degree > 0 && place < gaussians.size(); ++place) {
    record.clear();
    report.clamped += packer.append_harmonics(record, place) ? 1 : 0;
    write(record);
  }
  file.commit();
  return report;
}

}  // namespace cgs
