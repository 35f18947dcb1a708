// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/spz_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>
#include <span>
#include <string>

#include "io/bytes/byte_reader.h"
#include "io/bytes/compression.h"
#include "io/splats/sh_rotation.h"
#include "io/splats/splat_arrays.h"
#include "io/splats/spz_format.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr std::string_view kGzipMagic = "\x1f\x8b";
constexpr size_t kSpzHeaderBytes = 16;  // of versions 2 and 3
constexpr size_t kHeader4Bytes = 32;    // of version 4
constexpr uint8_t kHasExtensions = 2;   // flag
constexpr size_t kMostExtensionBytes = 1 << 20;
constexpr uint32_t kCoordinateSystem = 0xADBE0003;  // extension of Adobe

/// Where x, y and z point (right, left, up, down, back, forward) by the numbers of that extension;
/// 0 is not stated.
constexpr std::array<std::string_view, 17> kAxes = {"RUB",
                                                    "LDB",
                                                    "RDB",
                                                    "LUB",
                                                    "RUB",
                                                    "LDF",
                                                    "RDF",
                                                    "LUF",
                                                    "RUF",
                                                    "LFD",
                                                    "RFD",
                                                    "LFU",
                                                    "RFU",
                                                    "LBD",
                                                    "RBD",
                                                    "LBU",
                                                    "RBU"};

/// Signs of the harmonics beyond degree 0 when y and z change theirs.
constexpr std::array<float, 15> kShSigns = {-1, -1, 1, -1, 1, 1, -1, 1, -1, 1, -1, -1, 1, -1, 1};

struct SpzHeader {
  uint32_t version = 0;
  uint32_t count = 0;
  int degree = 0;
  int fractional_bits = 0;
  uint8_t flags = 0;
  uint8_t streams = 0;  // version 4

  size_t sh_in_file() const {
    constexpr std::array<size_t, 5> kCoefficients = {0, 3, 8, 15, 24};
    return kCoefficients.at(static_cast<size_t>(degree));
  }
  size_t rotation_bytes() const { return version == 2 ? 3 : 4; }
};

SpzHeader header_of(ByteReader& reader) {
  if (reader.take(4, "magic") != kSpzMagic) reader.fail(Defect::Magic, "expected SPZ, no NGSP");
  SpzHeader out;
  out.version = reader.get<uint32_t>("version");
  if (out.version < 2 || out.version > 4) {
    reader.fail(Defect::Unsupported,
                "SPZ version " + std::to_string(out.version) + ", known are 2, 3 and 4");
  }
  out.count = reader.get<uint32_t>("number of splats");
  out.degree = reader.get<uint8_t>("degree");
  out.fractional_bits = reader.get<uint8_t>("fractional bits");
  out.flags = reader.get<uint8_t>("flags");
  out.streams = reader.get<uint8_t>("reserved");
  if (out.count == 0) reader.fail(Defect::Empty, "0 splats");
  if (out.degree > 4) {
    reader.fail(Defect::Schema, "degree " + std::to_string(out.degree) + ", allowed are 0 to 4");
  }
  if (out.fractional_bits > kMostSpzFractionalBits) {
    reader.fail(Defect::Schema,
                std::to_string(out.fractional_bits) + " fractional bits, allowed are 0 to 23");
  }
  return out;
}

/// That of the beginning of a file.
SpzHeader header_at(std::string_view bytes, const std::filesystem::path& path) {
  std::string start;
  if (bytes.substr(0, 2) == kGzipMagic) {
    start = inflate_start(bytes, DeflateWrapping::Gzip, kSpzHeaderBytes, path, "SPZ header");
  }
  ByteReader reader(start.empty() ? bytes : std::string_view(start), path);
  return header_of(reader);
}

constexpr std::array<const char*, PartCount> kPartNames = {
    "positions", "opacities", "colours", "scales", "rotations", "harmonics"};

std::array<size_t, PartCount> part_sizes(const SpzHeader& header) {
  const size_t n = header.count;
  return {9 * n, n, 3 * n, 3 * n, header.rotation_bytes() * n, 3 * header.sh_in_file() * n};
}

/// What the bytes of each part are once they are not compressed.
struct Parts {
  std::string storage;
  std::array<std::string, PartCount> own;
  std::array<std::string_view, PartCount> bytes;
  std::string_view extensions;
};

Parts parts_of_one_stream(std::string_view file,
                          const SpzHeader& header,
                          const std::filesystem::path& path) {
  const std::array<size_t, PartCount> sizes = part_sizes(header);
  size_t total = kSpzHeaderBytes;
  for (const size_t size : sizes) total += size;
  const size_t more = (header.flags & kHasExtensions) != 0 ? kMostExtensionBytes : 0;
  Parts out;
  std::string_view all = file;
  if (file.substr(0, 2) == kGzipMagic) {
    const SizeRange size{total, total + more};
    out.storage = inflate(file, DeflateWrapping::Gzip, size, path, "SPZ content");
    all = out.storage;
  }
  ByteReader reader(all, path);
  (void)reader.take(kSpzHeaderBytes, "header");
  for (size_t k = 0; k < PartCount; ++k) out.bytes.at(k) = reader.take(sizes[k], kPartNames.at(k));
  if (more > 0) out.extensions = all.substr(total);
  return out;
}

Parts parts_of_streams(std::string_view file,
                       const SpzHeader& header,
                       const std::filesystem::path& path) {
  const std::array<size_t, PartCount> sizes = part_sizes(header);
  ByteReader reader(file, path);
  (void)reader.take(kSpzHeaderBytes, "header");
  const auto table_at = reader.get<uint32_t>("place of the table of streams");
  if (table_at < kHeader4Bytes || table_at > file.size()) {
    reader.fail(Defect::Schema, "the table of streams cannot begin at " + std::to_string(table_at));
  }
  const size_t needed = header.degree > 0 ? PartCount : size_t{Harmonics};
  if (header.streams < needed) {
    reader.fail(Defect::Schema,
                std::to_string(header.streams) + " streams, needed are " + std::to_string(needed));
  }
  (void)reader.take(kHeader4Bytes - reader.offset(), "header");
  const std::string_view extensions = reader.take(table_at - kHeader4Bytes, "extensions");
  ByteReader streams = reader;
  (void)streams.take(16 * size_t{header.streams}, "table of streams");
  Parts out;
  if ((header.flags & kHasExtensions) != 0) out.extensions = extensions;
  for (size_t k = 0; k < needed; ++k) {
    const auto packed = reader.get<uint64_t>("length of a stream");
    const auto unpacked = reader.get<uint64_t>("length of a stream");
    if (unpacked != sizes[k]) {
      reader.fail(Defect::Count,
                  std::string(kPartNames.at(k)) + " have " + std::to_string(unpacked) +
                      " bytes, needed are " + std::to_string(sizes[k]));
    }
    const std::string_view stream = streams.take(packed, kPartNames.at(k));
    out.own.at(k) = zstd_decompress(stream, sizes[k], path, kPartNames.at(k));
    out.bytes.at(k) = out.own.at(k);
  }
  return out;
}

/// What follows the splats, or precedes them in version 4: records of a number, a length and a
/// content.
struct Extensions {
  std::string_view axes = kAxes[0];
  size_t others = 0;
};

Extensions extensions_of(std::string_view records, const std::filesystem::path& path) {
  Extensions out;
  ByteReader reader(records, path);
  while (reader.remaining() > 0) {
    const auto type = reader.get<uint32_t>("extension");
    const auto length = reader.get<uint32_t>("length of an extension");
    ByteReader content(reader.take(length, "extension"), path);
    if (type != kCoordinateSystem) {
      ++out.others;
      continue;
    }
    const auto system = content.get<uint32_t>("coordinate system");
    if (system >= kAxes.size()) {
      reader.fail(Defect::Unsupported,
                  "coordinate system " + std::to_string(system) + ", known are 0 to 16");
    }
    out.axes = kAxes.at(system);
  }
  return out;
}

/// Turns splats, read as if x, y and z were right, up and back, from other axes.
void turn_from(std::string_view axes, RawSplats& splats) {
  const std::string_view letters = "RDF";  // axes of the 3DGS PLY
  const std::string_view opposites = "LUB";
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < 3; ++j) {
      const char letter = axes[static_cast<size_t>(k)];
      if (letter == letters[static_cast<size_t>(j)]) M(j, k) = 1;
      if (letter == opposites[static_cast<size_t>(j)]) M(j, k) = -1;
    }
  }
  const Eigen::Matrix3d turn = M * Eigen::Vector3d(1, -1, -1).asDiagonal();
  // A mirrored ellipsoid is also one that was turned, and not mirrored.
  const Eigen::Quaterniond q(Eigen::Matrix3d(turn.determinant() * turn));
  const ShRotation harmonics(turn);
  for (size_t i = 0; i < splats.size(); ++i) {
    splats.position[i] = turn * splats.position[i];
    const Eigen::Vector4d r = splats.rotation[i].cast<double>();
    const Eigen::Quaterniond out = q * Eigen::Quaterniond(r[0], r[1], r[2], r[3]);
    splats.rotation[i] = Eigen::Vector4d(out.w(), out.x(), out.y(), out.z()).cast<float>();
    harmonics.apply(std::span(splats.sh).subspan(i * splats.sh_count(), splats.sh_count()));
  }
}

double byte_at(std::string_view bytes, size_t i) { return static_cast<uint8_t>(bytes[i]); }

double fixed_point(std::string_view bytes, size_t i, double step) {
  const uint32_t value = static_cast<uint8_t>(bytes[3 * i]) |
                         uint32_t{static_cast<uint8_t>(bytes[3 * i + 1])} << 8 |
                         uint32_t{static_cast<uint8_t>(bytes[3 * i + 2])} << 16;
  return step * (static_cast<int32_t>(value << 8) >> 8);
}

/// (w, x, y, z) from three bytes x y z; w is what is left of the unit length.
Eigen::Vector4f three_byte_rotation(std::string_view bytes, size_t i) {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  for (size_t k = 0; k < 3; ++k) v[static_cast<int>(k)] = byte_at(bytes, 3 * i + k) / 127.5 - 1;
  const double w = std::sqrt(std::max(0.0, 1 - v.squaredNorm()));
  return Eigen::Vector4d(w, v.x(), v.y(), v.z()).cast<float>();
}

/// The same from 32 bits: the index of the largest of (x, y, z, w) in two, the others, last one
/// lowest, as sign and nine bits of up to 1 / sqrt 2.
Eigen::Vector4f four_byte_rotation(std::string_view bytes, size_t i) {
  uint32_t packed = 0;
  std::memcpy(&packed, bytes.data() + 4 * i, 4);
  const auto largest = static_cast<int>(packed >> 30);
  Eigen::Vector4d q = Eigen::Vector4d::Zero();  // x, y, z, w
  double rest = 1;
  for (int k = 3; k >= 0; --k) {
    if (k == largest) continue;
    const double value = (packed & 511U) / 511.0 / std::numbers::sqrt2;
    q[k] = (packed >> 9 & 1U) != 0 ? -value : value;
    rest -= value * value;
    packed >>= 10;
  }
  q[largest] = std::sqrt(std::max(0.0, rest));
  return Eigen::Vector4d(q[3], q[0], q[1], q[2]).cast<float>();
}

RawSplats splats_of(const Parts& parts, const SpzHeader& header) {
  RawSplats out;
  out.format = "SPZ " + std::to_string(header.version);
  out.sh_degree = std::min(header.degree, 3);
  out.reserve(header.count);
  if (header.degree > 3) out.notes.emplace_back("spherical harmonics of degree 4 left out");
  out.is_antialiased = (header.flags & 1U) != 0;
  const double step = std::ldexp(1.0, -header.fractional_bits);
  const size_t kept = out.sh_count() - 1;
  for (size_t i = 0; i < header.count; ++i) {
    const auto coordinate = [&](size_t k) {
      return fixed_point(parts.bytes[Positions], 3 * i + k, step);
    };
    out.position.emplace_back(coordinate(0), -coordinate(1), -coordinate(2));
    out.logit.push_back(logit_of_byte(static_cast<uint8_t>(parts.bytes[Opacities][i])));
    Eigen::Vector3f color = Eigen::Vector3f::Zero();
    Eigen::Vector3f scale = Eigen::Vector3f::Zero();
    for (size_t k = 0; k < 3; ++k) {
      const double c = byte_at(parts.bytes[Colors], 3 * i + k);
      color[static_cast<int>(k)] = static_cast<float>((c / 255 - 0.5) / kSpzColorScale);
      const double s = byte_at(parts.bytes[Scales], 3 * i + k);
      scale[static_cast<int>(k)] = static_cast<float>(s / 16 - 10);
    }
    out.log_scale.push_back(scale);
    Eigen::Vector4f q = header.version == 2 ? three_byte_rotation(parts.bytes[Rotations], i)
                                            : four_byte_rotation(parts.bytes[Rotations], i);
    q.tail<2>() *= -1;
    out.rotation.push_back(q);
    out.sh.push_back(color);
    for (size_t k = 0; k < kept; ++k) {
      const size_t at = 3 * (i * header.sh_in_file() + k);
      Eigen::Vector3f c = Eigen::Vector3f::Zero();
      for (size_t channel = 0; channel < 3; ++channel) {
        const double byte = byte_at(parts.bytes[Harmonics], at + channel);
        c[static_cast<int>(channel)] = static_cast<float>((byte - 128) / 128);
      }
      out.sh.emplace_back(kShSigns.at(k) * c);
    }
  }
  return out;
}

}  // namespace

bool looks_like_spz(std::string_view bytes) {
  return bytes.substr(0, 4) == kSpzMagic || bytes.substr(0, 3) == "\x1f\x8b\x08";  // gzip, deflated
}

SpzCount stated_spz_splats(std::string_view start, const std::filesystem::path& path) {
  const SpzHeader header = header_at(start, path);
  const auto side = static_cast<uint64_t>(std::min(header.degree, 3)) + 1;
  return {header.count, side * side};
}

RawSplats parse_spz(std::string_view bytes, const std::filesystem::path& path) {
  const SpzHeader header = header_at(bytes, path);
  if (header.version == 4 && bytes.substr(0, 2) == kGzipMagic) {
    throw BadInput(Defect::Schema, path, "SPZ 4 inside a gzip stream");
  }
  // Told before memory is taken.
  if (header.count / kSpzSplatsPerByte > bytes.size()) {
    throw BadInput(Defect::Count,
                   path,
                   "declares " + std::to_string(header.count) + " splats, " +
                       std::to_string(bytes.size()) + " bytes cannot hold them");
  }
  const Parts parts = header.version == 4 ? parts_of_streams(bytes, header, path)
                                          : parts_of_one_stream(bytes, header, path);
  const Extensions extensions = extensions_of(parts.extensions, path);
  RawSplats out = splats_of(parts, header);
  if (extensions.axes != kAxes[0]) turn_from(extensions.axes, out);
  if (extensions.others > 0) {
    out.notes.push_back(std::to_string(extensions.others) + " extensions of the SPZ left out");
  }
  return out;
}

}  // namespace cgs
