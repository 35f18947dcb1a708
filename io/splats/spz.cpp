// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/spz.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/compression.h"
#include "io/splats/raw_splats.h"
#include "io/splats/sh_rotation.h"
#include "io/splats/splat_arrays.h"
#include "io/splats/spz_format.h"
#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"

namespace cgs {

namespace {

/// Fills the parts splat by splat and counts what had to be clamped.
class Packer {
 public:
  Packer(const Gaussians& gaussians, const Frame& frame, const SpzOptions& options, int bits)
      : g_(gaussians),
        frame_(frame),
        y_up_(options.y_up),
        quaternion_(options.y_up),
        harmonics_(options.y_up),
        version_(options.version),
        steps_(std::ldexp(1.0, bits)) {}

  void add(size_t i) {
    clamped_ = false;
    const Eigen::Vector3d p = y_up_ * frame_.file_from_internal(g_.position[i].cast<double>());
    for (const double c : p) {
      const auto value = static_cast<uint32_t>(std::lround(c * steps_));
      for (const int shift : {0, 8, 16}) {
        append_bytes(parts_[Positions], static_cast<uint8_t>(value >> shift));
      }
    }
    append_bytes(parts_[Opacities], unit_byte(g_.opacity[i]));
    const auto sh_count = static_cast<size_t>(g_.sh_count());
    std::array<Eigen::Vector3f, 16> turned;
    const std::span<Eigen::Vector3f> sh(turned.data(), sh_count);
    std::copy_n(g_.sh.begin() + static_cast<std::ptrdiff_t>(i * sh_count), sh_count, sh.begin());
    harmonics_.apply(sh);
    for (const float c : sh[0]) add_byte(Colors, 255 * (kSpzColorScale * c + 0.5));
    for (const float s : g_.scale[i]) add_byte(Scales, 16 * (std::log(s * frame_.scale) + 10));
    add_rotation(g_.rotation[i].cast<double>().normalized());
    for (size_t k = 1; k < sh_count; ++k) {
      for (const float c : sh[k]) add_byte(Harmonics, 128 + 128 * double{c});
    }
    clamped_splats_ += clamped_ ? 1 : 0;
  }

  std::string bytes(int bits) const {
    std::string out(kSpzMagic);
    append_bytes(out, static_cast<uint32_t>(version_));
    append_bytes(out, static_cast<uint32_t>(g_.size()));
    append_bytes(out, static_cast<uint8_t>(g_.sh_degree));
    append_bytes(out, static_cast<uint8_t>(bits));
    append_bytes(out, uint16_t{0});  // flags, reserved
    for (const std::string& part : parts_) out += part;
    return out;
  }

  uint64_t clamped_splats() const { return clamped_splats_; }

 private:
  void add_byte(SpzPart part, double value) {
    const double rounded = std::round(value);
    clamped_ = clamped_ || rounded < 0 || rounded > 255;
    append_bytes(parts_.at(part), static_cast<uint8_t>(std::clamp(rounded, 0.0, 255.0)));
  }

  void add_rotation(const Eigen::Vector4d& wxyz) {
    // The ellipsoid's own axes are turned half round, as parse_spz() turns them back.
    const Eigen::Quaterniond half_turn(0, 1, 0, 0);
    const Eigen::Quaterniond turned = quaternion_ *
                                      Eigen::Quaterniond(wxyz[0], wxyz[1], wxyz[2], wxyz[3]) *
                                      half_turn.conjugate();
    Eigen::Vector4d q = turned.coeffs();  // x, y, z, w
    if (version_ == 2) {
      if (q[3] < 0) q = -q;
      for (int k = 0; k < 3; ++k) add_byte(Rotations, 127.5 * (q[k] + 1));
      return;
    }
    int largest = 0;
    (void)q.cwiseAbs().maxCoeff(&largest);
    if (q[largest] < 0) q = -q;
    auto packed = static_cast<uint32_t>(largest);
    for (int k = 0; k < 4; ++k) {
      if (k == largest) continue;
      const double magnitude =
          std::min(511.0, std::round(511 * std::numbers::sqrt2 * std::abs(q[k])));
      packed = packed << 10 | (q[k] < 0 ? 512U : 0U) | static_cast<uint32_t>(magnitude);
    }
    append_bytes(parts_[Rotations], packed);
  }

  const Gaussians& g_;
  const Frame& frame_;
  Eigen::Matrix3d y_up_;
  Eigen::Quaterniond quaternion_;
  ShRotation harmonics_;
  int version_;
  double steps_;
  std::array<std::string, PartCount> parts_;
  uint64_t clamped_splats_ = 0;
  bool clamped_ = false;
};

/// Fractional bits with which every position fits into 24 bits, see write_spz().
int fitting_bits(const Gaussians& g, const Frame& frame, const SpzOptions& options) {
  const double finest = options.finest;
  double farthest = 0;
  std::array<std::vector<float>, 3> axes;
  for (const Eigen::Vector3f& position : g.position) {
    const Eigen::Vector3d p = frame.file_from_internal(position.cast<double>());
    farthest = std::max(farthest, (options.y_up * p).cwiseAbs().maxCoeff());
    for (size_t k = 0; k < 3; ++k) axes.at(k).push_back(position[static_cast<int>(k)]);
  }
  double extent = 0;  // of the inner 98 %
  for (std::vector<float>& values : axes) {
    const size_t cut = values.size() / 100;
    const float low = nth_smallest(values, cut);
    const float high = nth_smallest(values, values.size() - 1 - cut);
    extent = std::max(extent, double{high} - double{low});
  }
  extent *= frame.scale;
  constexpr double kReach = (1 << 23) - 1;  // steps to either side
  constexpr double kFineSteps = 1 << 16;    // across the scene, wanted
  constexpr double kCoarseSteps = 1 << 10;  // needed
  int bits = finest > 0 ? 0 : 12;
  const double fine =
      finest > 0 ? std::min(finest * frame.scale, extent / kCoarseSteps) : extent / kFineSteps;
  while (bits < kMostSpzFractionalBits && std::ldexp(fine, bits) < 1) ++bits;
  while (bits > 0 && std::ldexp(farthest, bits) > kReach) --bits;
  const bool fits = std::ldexp(farthest, bits) <= kReach &&
                    (extent == 0 || std::ldexp(extent, bits) >= kCoarseSteps || bits >= 12);
  if (!fits) {
    std::string text = "splats lie too far out for the 24 bits of SPZ: one has a coordinate of ";
    append_number(text, static_cast<float>(farthest));
    text += " in a scene of ";
    append_number(text, static_cast<float>(extent));
    throw InvalidInput(text + "; leave it out, or write .ply or .glb");
  }
  return bits;
}

}  // namespace

void SpzOptions::validate() const {
  require(version == 2 || version == 3, "SpzOptions.version must be 2 or 3", version);
  require(finest >= 0 && std::isfinite(finest), "SpzOptions.finest must be >= 0", finest);
  require_rotation(y_up, "SpzOptions.y_up must be a rotation; error");
}

SpzReport write_spz(const std::filesystem::path& path,
                    const Gaussians& gaussians,
                    const Frame& frame,
                    const SpzOptions& options) {
  options.validate();
  require_writable(gaussians);
  SpzReport report;
  report.fractional_bits = fitting_bits(gaussians, frame, options);
  Packer packer(gaussians, frame, options, report.fractional_bits);
  for (size_t i = 0; i < gaussians.size(); ++i) packer.add(i);
  report.clamped = packer.clamped_splats();
  const std::string bytes = gzip(packer.bytes(report.fractional_bits));
  report.bytes = bytes.size();
  write_file(path, bytes);
  return report;
}

}  // namespace cgs
