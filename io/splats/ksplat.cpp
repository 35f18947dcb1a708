// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/ksplat.h"

#include <array>
#include <cmath>

#include <Eigen/Core>

#include "io/bytes/byte_reader.h"
#include "libcgs/core/gaussians.h"

namespace cgs {

namespace {

constexpr size_t kHeaderBytes = 4096;
constexpr size_t kSectionHeaderBytes = 1024;
constexpr uint32_t kDefaultSteps = 32767;  // to either side of the centre of a bucket
constexpr float kDefaultRange = 1.5F;      // of harmonics

/// RGB coefficients beyond degree 0.
constexpr std::array<size_t, 4> kHarmonics = {0, 3, 8, 15};

struct Header {
  uint32_t sections = 0;
  uint32_t splats = 0;
  uint16_t level = 0;
  float lowest_harmonic = 0;
  float highest_harmonic = 0;
};

struct Section {
  uint32_t splats = 0;  ///< Of those that have room.
  uint32_t room = 0;    ///< Splats.
  uint32_t bucket_size = 0;
  uint32_t buckets = 0;
  uint32_t full_buckets = 0;
  uint32_t other_buckets = 0;
  uint16_t bucket_bytes = 0;
  uint16_t degree = 0;
  double step = 0;   ///< Of a position [file units].
  double steps = 0;  ///< To either side of the centre of a bucket.
};

Header header_of(std::string_view bytes, const std::filesystem::path& path) {
  ByteReader in(bytes, path);
  const auto major = in.get<uint8_t>("version");
  const auto minor = in.get<uint8_t>("version");
  if (major != 0 || minor != 1) {
    in.fail(
        Defect::Unsupported,
        ".ksplat version " + std::to_string(major) + "." + std::to_string(minor) + "; 0.1 is read");
  }
  (void)in.take(2, "header");
  Header out;
  out.sections = in.get<uint32_t>("number of sections");
  (void)in.take(8, "header");
  out.splats = in.get<uint32_t>("number of splats");
  out.level = in.get<uint16_t>("compression level");
  (void)in.take(14, "header");  // and the centre of the scene
  out.lowest_harmonic = in.get<float>("range of harmonics");
  out.highest_harmonic = in.get<float>("range of harmonics");
  if (out.level > 2) {
    in.fail(Defect::Unsupported,
            "compression level " + std::to_string(out.level) + ", known are 0, 1 and 2");
  }
  if (out.splats == 0) in.fail(Defect::Empty, "0 splats");
  if (!std::isfinite(out.lowest_harmonic) || !std::isfinite(out.highest_harmonic)) {
    in.fail(Defect::Value, "the range of harmonics is not finite");
  }
  if (out.lowest_harmonic == 0) out.lowest_harmonic = -kDefaultRange;
  if (out.highest_harmonic == 0) out.highest_harmonic = kDefaultRange;
  return out;
}

Section section_of(std::string_view bytes, const Header& header, ByteReader& file) {
  ByteReader in(bytes, file.path());
  Section out;
  out.splats = in.get<uint32_t>("number of splats");
  out.room = in.get<uint32_t>("number of splats");
  out.bucket_size = in.get<uint32_t>("size of a bucket");
  out.buckets = in.get<uint32_t>("number of buckets");
  const auto block = in.get<float>("size of a block");
  out.bucket_bytes = in.get<uint16_t>("bytes of a bucket");
  (void)in.take(2, "section header");
  const auto steps = in.get<uint32_t>("steps of a position");
  (void)in.take(4, "section header");
  out.full_buckets = in.get<uint32_t>("number of buckets");
  out.other_buckets = in.get<uint32_t>("number of buckets");
  out.degree = in.get<uint16_t>("degree");
  if (out.splats > out.room) {
    file.fail(Defect::Count,
              "a section has " + std::to_string(out.splats) + " splats in room for " +
                  std::to_string(out.room));
  }
  if (out.degree > 3) {
    file.fail(Defect::Schema, "degree " + std::to_string(out.degree) + ", allowed are 0 to 3");
  }
  if (header.level == 0) return out;
  out.steps = steps == 0 ? kDefaultSteps : steps;
  out.step = block / 2 / out.steps;
  if (!std::isfinite(out.step)) file.fail(Defect::Value, "the size of a block is not finite");
  if (uint64_t{out.full_buckets} + out.other_buckets > out.buckets ||
      (out.buckets > 0 && out.bucket_bytes < 3 * sizeof(float))) {
    file.fail(Defect::Count, "the buckets of a section do not fit each other");
  }
  return out;
}

/// Splats of a section, one after the other.
class SectionReader {
 public:
  SectionReader(const Header& header, const Section& section, int degree, ByteReader& file)
      : header_(header), section_(section), degree_(degree), file_(file) {}

  void append_to(RawSplats& out) {
    file_.expect_records(section_.other_buckets, sizeof(uint32_t), "buckets");
    for (uint32_t k = 0; k < section_.other_buckets; ++k) {
      sizes_.push_back(file_.get<uint32_t>("size of a bucket"));
    }
    file_.expect_records(section_.buckets, section_.bucket_bytes, "buckets");
    centers_ = file_.take(size_t{section_.buckets} * section_.bucket_bytes, "buckets");
    file_.expect_records(section_.room, bytes_each(), "splats");
    for (uint32_t i = 0; i < section_.splats; ++i) append_splat(out, i);
    (void)file_.take((section_.room - section_.splats) * bytes_each(), "splats");
  }

 private:
  size_t bytes_each() const {
    constexpr std::array<size_t, 3> kBytes = {44, 24, 24};
    constexpr std::array<size_t, 3> kHarmonicBytes = {4, 2, 1};
    return kBytes.at(header_.level) +
           3 * kHarmonics.at(section_.degree) * kHarmonicBytes.at(header_.level);
  }

  /// A float of 32 bits, or of 16.
  float number(const char* what) {
    if (header_.level == 0) return file_.get<float>(what);
    return static_cast<float>(Eigen::half_impl::half_to_float(
        Eigen::half_impl::raw_uint16_to_half(file_.get<uint16_t>(what))));
  }

  float harmonic() {
    if (header_.level < 2) return number("harmonics");
    const float t = static_cast<float>(file_.get<uint8_t>("harmonics")) / 255;
    return header_.lowest_harmonic + t * (header_.highest_harmonic - header_.lowest_harmonic);
  }

  /// The centre of the bucket of splat i, which is asked for in order.
  Eigen::Vector3d center_of(uint32_t i) {
    const uint64_t in_full = uint64_t{section_.full_buckets} * section_.bucket_size;
    uint64_t bucket = 0;
    if (i < in_full) {
      bucket = i / section_.bucket_size;
    } else {
      while (other_ < sizes_.size() && i - in_full >= before_ + sizes_[other_]) {
        before_ += sizes_[other_++];
      }
      bucket = section_.full_buckets + other_;
    }
    if (bucket >= uint64_t{section_.full_buckets} + section_.other_buckets) {
      file_.fail(Defect::Count, "splat " + std::to_string(i) + " of a section lies in no bucket");
    }
    ByteReader in(centers_.substr(bucket * section_.bucket_bytes, section_.bucket_bytes),
                  file_.path());
    Eigen::Vector3d out = Eigen::Vector3d::Zero();
    for (double& c : out) c = in.get<float>("centre of a bucket");
    return out;
  }

  void append_splat(RawSplats& out, uint32_t i) {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    if (header_.level == 0) {
      for (double& p : position) p = file_.get<float>("position");
    } else {
      position = center_of(i);
      for (double& p : position)
        p += section_.step * (file_.get<uint16_t>("position") - section_.steps);
    }
    out.position.push_back(position);
    Eigen::Vector3f scale = Eigen::Vector3f::Zero();
    for (float& s : scale) s = std::log(number("scale"));
    out.log_scale.push_back(scale);
    Eigen::Vector4f rotation = Eigen::Vector4f::Zero();
    for (float& q : rotation) q = number("rotation");
    out.rotation.push_back(rotation);
    Eigen::Vector3d color = Eigen::Vector3d::Zero();
    for (double& c : color) c = (file_.get<uint8_t>("colour") / 255.0 - 0.5) / double{kShC0};
    out.sh.emplace_back(color.cast<float>());
    out.logit.push_back(logit_of_byte(file_.get<uint8_t>("opacity")));
    append_harmonics(out);
  }

  /// In the file degree after degree, and in each channel after channel.
  void append_harmonics(RawSplats& out) {
    const size_t begin = out.sh.size();
    out.sh.resize(begin + kHarmonics.at(static_cast<size_t>(degree_)), Eigen::Vector3f::Zero());
    for (size_t degree = 1, at = begin; degree <= section_.degree; ++degree) {
      const size_t count = 2 * degree + 1;
      for (int channel = 0; channel < 3; ++channel) {
        for (size_t k = 0; k < count; ++k) out.sh[at + k][channel] = harmonic();
      }
      at += count;
    }
  }

  const Header& header_;
  const Section& section_;
  int degree_;  // of what is read into
  ByteReader& file_;
  std::vector<uint32_t> sizes_;  // of the buckets that are not full
  std::string_view centers_;
  size_t other_ = 0;     // bucket that is not full
  uint64_t before_ = 0;  // splats in those before it
};

}  // namespace

bool looks_like_ksplat(std::string_view bytes) {
  return bytes.size() > kHeaderBytes && bytes[0] == 0 && bytes[1] == 1 && bytes[2] == 0 &&
         bytes[3] == 0;
}

RawSplats parse_ksplat(std::string_view bytes, const std::filesystem::path& path) {
  ByteReader file(bytes, path);
  const Header header = header_of(file.take(kHeaderBytes, "header"), path);
  file.expect_records(header.sections, kSectionHeaderBytes, "sections");
  RawSplats out;
  out.format = ".ksplat, compression level " + std::to_string(header.level);
  std::vector<Section> sections;
  uint64_t splats = 0;
  for (uint32_t k = 0; k < header.sections; ++k) {
    sections.push_back(section_of(file.take(kSectionHeaderBytes, "section header"), header, file));
    splats += sections.back().splats;
    if (sections.back().splats > 0) {
      out.sh_degree = std::max(out.sh_degree, int{sections.back().degree});
    }
  }
  if (splats != header.splats) {
    file.fail(Defect::Count,
              "declares " + std::to_string(header.splats) + " splats, its sections have " +
                  std::to_string(splats));
  }
  constexpr uint64_t kFewestBytes = 24;
  file.expect_records(splats, kFewestBytes, "splats");
  out.reserve(splats);
  for (const Section& section : sections) {
    SectionReader(header, section, out.sh_degree, file).append_to(out);
  }
  return out;
}

}  // namespace cgs
