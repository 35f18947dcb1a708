// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/splat_doctor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include "io/ply/frame.h"
#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"

namespace cgs {

namespace {

/// Internal scales stay where their squares are normal floats.
constexpr double kSmallestScale = 0x1p-60;
constexpr double kLargestScale = 0x1p60;

/// Places beyond this would not survive being written as floats again.
constexpr double kFarthestKept = 0x1p127;

/// Splats that cover the scene more often than this are no picture of anything.
constexpr double kSuspiciousFill = 1e3;

/// Corners of the box from the 1st to the 99th percentile along each axis.
std::vector<Eigen::Vector3d> inner_corners(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();
  const size_t cut = points.size() / 100;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(
        points.begin(), points.end(), values.begin(), [&](const auto& p) { return p[axis]; });
    low[axis] = nth_smallest(values, cut);
    high[axis] = nth_smallest(values, points.size() - 1 - cut);
  }
  return {low, high};
}

/// How often the largest cross sections (ellipses at 3 sigma) would cover a square of the extent.
template <typename ToLength>
double fill_ratio(const std::vector<Eigen::Vector3f>& scales, double extent, ToLength length) {
  double area = 0;
  for (const Eigen::Vector3f& s : scales) {
    const Eigen::Vector3d d = s.cast<double>().unaryExpr(length);
    if (!(d.maxCoeff() <= kLargestScale * extent)) continue;  // will be dropped
    area += 9 * std::numbers::pi * d.prod() / std::max(d.minCoeff(), kSmallestScale);
  }
  return extent > 0 ? area / (extent * extent) : 0;
}

std::string counted(uint64_t count, const std::string& what) {
  return std::to_string(count) + (count == 1 ? " splat" : " splats") + what;
}

/// Whether comments of a PLY say so: those of Brush, or of Postshot in two versions. The last one
/// counts.
bool states_antialiasing(const std::vector<std::string>& comments) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kKnown = {
      {{"splatrendermode:", "mip"}, {"antialiased", "1"}, {"postshot.anti_aliasing=", "1"}}};
  bool out = false;
  for (const std::string& comment : comments) {
    std::string text;  // in lower case, without blanks
    for (const char c : comment) {
      if (c == ' ' || c == '\t') continue;
      text += c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    }
    for (const auto& [key, value] : kKnown) {
      if (text.starts_with(key)) out = text.substr(key.size()) == value;
    }
  }
  return out;
}

class Examination {
 public:
  Examination(RawSplats raw, const std::filesystem::path& path)
      : raw_(std::move(raw)), path_(path) {
    findings_.in_file = raw_.size();
  }

  GaussianFile into(const std::optional<Frame>& frame) {
    drop_unusable();
    if (raw_.size() == 0) throw BadInput(Defect::Value, path_, "no finite splats");
    const std::vector<Eigen::Vector3d> corners = inner_corners(raw_.position);
    const double extent = (corners[1] - corners[0]).maxCoeff();
    judge_coding(extent);
    if (findings_.linear_opacity) drop_unusable();  // opacity 0 is only known now
    if (raw_.size() == 0) throw BadInput(Defect::Value, path_, "no splat can be seen");
    judge_labels();
    const Eigen::AlignedBox3d box = widened({corners[0], corners[1]}, largest_radius(raw_));
    const std::string odd = check_significance(path_, box, raw_.digits);
    count_flyaways(corners, extent);
    PlyPlacement placement = ply_placement(raw_.comments, {box.min(), box.max()}, frame);
    GaussianFile out;
    const size_t usable = raw_.size();
    out.gaussians = into_frame(placement);
    if (out.gaussians.size() == 0) {
      throw BadInput(Defect::Value, path_, "no finite splats: every one leaves the range of float");
    }
    const bool is_own_frame = !frame.has_value();
    if (is_own_frame && out.gaussians.size() < usable) {
      check_as_floats(out.gaussians, placement.frame);
    }
    out.frame = placement.frame;
    out.file_origin = placement.file_origin;
    out.format = std::move(raw_.format);
    out.evidence = std::move(raw_.evidence);
    out.warnings = std::move(placement.warnings);
    if (!odd.empty()) out.warnings.push_back(odd);
    add_warnings(out.warnings);
    out.findings = findings_;
    return out;
  }

 private:
  /// Of splats that a file can hold. Vanishing ones tell no size: 2, for the smallest one, rounded.
  static double largest_radius(const RawSplats& raw) {
    double out = 0;
    for (const Eigen::Vector3f& s : raw.log_scale) {
      const double radius = std::exp(double{s.maxCoeff()});
      if (radius > 2 * kSmallestScale && radius <= kFarthestKept) out = std::max(out, radius);
    }
    return raw.size() > 1 ? out : 0;
  }

  /// Where rounding has put all splats in one place, their radii tell how large the box was.
  static Eigen::AlignedBox3d widened(Eigen::AlignedBox3d box, double radius) {
    if (radius == 0 || !box.sizes().isZero(0)) return box;
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    double& high = box.max().x();
    high = std::max(high + radius, std::nextafter(high, kInfinity));
    return box;
  }

  /// What is left must be told apart where it is written again.
  void check_as_floats(const Gaussians& g, const Frame& frame) const {
    std::vector<Eigen::Vector3d> in_file;
    double radius = 0;
    for (size_t i = 0; i < g.size(); ++i) {
      const Eigen::Vector3d p = frame.file_from_internal(g.position[i].cast<double>());
      in_file.emplace_back(p.cast<float>().cast<double>());
      radius = std::max(radius, double{g.scale[i].maxCoeff()} * frame.scale);
    }
    const std::vector<Eigen::Vector3d> corners = inner_corners(in_file);
    const bool is_told = g.size() > 1 && radius > 2 * kSmallestScale;
    (void)check_significance(
        path_, widened({corners[0], corners[1]}, is_told ? radius : 0), kFloatDigits);
  }

  /// Where the judgement of splat i is counted; null for a good one.
  uint64_t* defect_of(size_t i) {
    const size_t sh_count = raw_.sh_count();
    const float logit = raw_.logit[i];
    bool finite = raw_.position[i].allFinite() && !raw_.log_scale[i].hasNaN();
    finite = finite && raw_.rotation[i].allFinite() && !std::isnan(logit);
    for (size_t k = 0; k < sh_count; ++k) finite = finite && raw_.sh[i * sh_count + k].allFinite();
    if (!finite) return &findings_.not_finite;
    if (raw_.position[i].cwiseAbs().maxCoeff() > kFarthestKept) return &findings_.out_of_range;
    if (!(raw_.rotation[i].cwiseAbs().maxCoeff() > 0)) return &findings_.without_rotation;
    if (logit == -std::numeric_limits<float>::infinity()) return &findings_.transparent;
    return nullptr;
  }

  void move_down(size_t from, size_t to) {
    const size_t sh_count = raw_.sh_count();
    raw_.position[to] = raw_.position[from];
    raw_.log_scale[to] = raw_.log_scale[from];
    raw_.rotation[to] = raw_.rotation[from];
    raw_.logit[to] = raw_.logit[from];
    std::copy_n(raw_.sh.begin() + static_cast<ptrdiff_t>(from * sh_count),
                sh_count,
                raw_.sh.begin() + static_cast<ptrdiff_t>(to * sh_count));
    if (!raw_.provenance.empty()) raw_.provenance[to] = raw_.provenance[from];
    if (!raw_.synthetic.empty()) raw_.synthetic[to] = raw_.synthetic[from];
  }

  void shrink_to(size_t count) {
    raw_.position.resize(count);
    raw_.log_scale.resize(count);
    raw_.rotation.resize(count);
    raw_.logit.resize(count);
    raw_.sh.resize(count * raw_.sh_count());
    if (!raw_.provenance.empty()) raw_.provenance.resize(count);
    if (!raw_.synthetic.empty()) raw_.synthetic.resize(count);
  }

  void drop_unusable() {
    size_t kept = 0;
    for (size_t i = 0; i < raw_.size(); ++i) {
      if (uint64_t* const count = defect_of(i)) {
        ++*count;
      } else {
        if (kept != i) move_down(i, kept);
        ++kept;
      }
    }
    shrink_to(kept);
  }

  /// Decides whether scales are logarithms and opacities logits, as the format has them.
  void judge_coding(double extent) {
    const auto& scales = raw_.log_scale;
    findings_.fill_ratio = fill_ratio(scales, extent, [](double s) { return std::exp(s); });
    if (!raw_.may_be_linear) return;
    judge_opacities();
    // A flat splat has a length of 0.
    all_scales_positive_ =
        std::all_of(scales.begin(), scales.end(), [](const auto& s) { return s.minCoeff() >= 0; });
    // A file that holds one thing as it is will not hold the other as a logarithm.
    const bool is_suspicious =
        findings_.linear_opacity || !(findings_.fill_ratio < kSuspiciousFill);
    if (!all_scales_positive_ || !is_suspicious) return;
    const double as_lengths = fill_ratio(scales, extent, [](double s) { return s; });
    if (!(as_lengths < kSuspiciousFill)) return;
    findings_.linear_scales = true;
    findings_.fill_ratio = as_lengths;
    for (Eigen::Vector3f& s : raw_.log_scale) s = s.array().log();
  }

  void judge_opacities() {
    const auto [low, high] = std::minmax_element(raw_.logit.begin(), raw_.logit.end());
    constexpr float kSpread = 0.1f;
    all_probabilities_ = *low >= 0 && *high <= 1;
    if (!all_probabilities_ || *high - *low < kSpread) return;
    findings_.linear_opacity = true;
    for (float& value : raw_.logit) value = std::log(value) - std::log1p(-value);
  }

  /// Labels of some splats, or of none that there are, would be taken for those of all.
  void judge_labels() {
    const auto is_label = [](float number) {
      return number >= 0 && number < float{kProvenanceCount} && number == std::floor(number);
    };
    const auto labelled = std::count_if(raw_.provenance.begin(), raw_.provenance.end(), is_label);
    unlabelled_ = raw_.provenance.size() - static_cast<size_t>(labelled);
    if (unlabelled_ > 0) raw_.provenance.clear();
  }

  void count_flyaways(const std::vector<Eigen::Vector3d>& corners, double extent) {
    constexpr double kFar = 10;
    const Eigen::Vector3d middle = 0.5 * (corners[0] + corners[1]);
    for (const Eigen::Vector3d& p : raw_.position) {
      if ((p - middle).cwiseAbs().maxCoeff() > kFar * extent && extent > 0) ++findings_.flyaways;
    }
  }

  float opacity_of(float logit) {
    if (std::isinf(logit)) {
      ++findings_.clamped;
      return logit > 0 ? 0.99f : std::numeric_limits<float>::min();
    }
    constexpr float kLargest = 1 - std::numeric_limits<float>::epsilon() / 2;
    const auto opacity = static_cast<float>(1 / (1 + std::exp(-double{logit})));
    if (opacity > 0 && opacity <= kLargest) return opacity;
    ++findings_.clamped;
    return opacity > 0 ? kLargest : std::numeric_limits<float>::min();
  }

  static Eigen::Vector4f unit_length(const Eigen::Vector4f& rotation) {
    // Divided by its largest entry first, or squares of 1e20 overflow. A unit quaternion passes
    // unchanged, so that a second round trip changes nothing.
    const double largest = rotation.cwiseAbs().maxCoeff();
    const Eigen::Vector4d q = rotation.cast<double>() / largest;
    const double norm = q.norm() * largest;
    return (q / (std::abs(norm - 1) < 1e-6 ? 1 / largest : q.norm())).cast<float>();
  }

  /// Moves what is left into the frame; drops splats that leave the range of float there.
  Gaussians into_frame(const PlyPlacement& placement) {
    Gaussians out;
    out.sh_degree = raw_.sh_degree;
    out.position.reserve(raw_.size());
    out.opacity.reserve(raw_.size());
    const double log_unit = std::log(placement.frame.scale);
    size_t kept = 0;
    for (size_t i = 0; i < raw_.size(); ++i) {
      const Eigen::Vector3f p = placement.internal(raw_.position[i]).cast<float>();
      const Eigen::Vector3d s = (raw_.log_scale[i].cast<double>().array() - log_unit).exp();
      if (!p.allFinite() || !(s.maxCoeff() <= kLargestScale)) {
        ++findings_.out_of_range;
        continue;
      }
      if (s.minCoeff() < kSmallestScale) ++findings_.clamped;
      if (kept != i) move_down(i, kept);
      out.position.push_back(p);
      out.opacity.push_back(opacity_of(raw_.logit[kept]));
      raw_.log_scale[kept] = s.cwiseMax(kSmallestScale).cast<float>();
      raw_.rotation[kept] = unit_length(raw_.rotation[kept]);
      ++kept;
    }
    shrink_to(kept);
    out.scale = std::move(raw_.log_scale);
    out.rotation = std::move(raw_.rotation);
    out.sh = std::move(raw_.sh);
    out.provenance.reserve(raw_.provenance.size());
    for (const float number : raw_.provenance) {
      out.provenance.push_back(static_cast<Provenance>(number));
    }
    tag_synthetic(out);
    return out;
  }

  /// A tag whose picture the file does not list stays one: nobody says which picture it was. So
  /// does what is no tag at all.
  void tag_synthetic(Gaussians& out) {
    constexpr size_t kMost = 255;
    std::vector<SyntheticSource>& sources = raw_.synthetic_sources;
    if (sources.size() > kMost) sources.resize(kMost);
    size_t largest = 0;
    for (const float number : raw_.synthetic) {
      const bool is_tag = number >= 0 && number <= float{kMost} && number == std::floor(number);
      const auto tag = is_tag ? static_cast<uint8_t>(number) : uint8_t{kMost};
      out.synthetic.push_back(tag);
      largest = std::max(largest, size_t{tag});
    }
    if (largest == 0) out.synthetic.clear();
    if (largest == 0) return;
    if (sources.size() < largest) sources.resize(largest);
    out.synthetic_sources = std::move(sources);
  }

  void add_warnings(std::vector<std::string>& out) const {
    const SplatFindings& f = findings_;
    out.insert(out.end(), raw_.notes.begin(), raw_.notes.end());
    if (raw_.is_antialiased || states_antialiasing(raw_.comments)) {
      out.emplace_back(
          "trained for viewers that smooth edges (antialiased); what is written from it does not "
          "say so");
    }
    if (f.dropped() > 0) out.push_back("dropped " + counted(f.dropped(), dropped_reasons()));
    if (f.clamped > 0) out.push_back("clamped opacity or scale of " + counted(f.clamped, ""));
    if (all_scales_positive_) {
      out.push_back("scale_* look linear, not log: all are positive; read as " +
                    std::string(f.linear_scales ? "lengths" : "logarithms"));
    }
    if (all_probabilities_) {
      out.push_back("opacity looks like a probability, not a logit; read as a " +
                    std::string(f.linear_opacity ? "probability" : "logit"));
    }
    if (unlabelled_ > 0) {
      out.push_back("provenance of the splats left out: " +
                    counted(unlabelled_, " without a label from 0 to 5"));
    }
    if (f.flyaways > 0) {
      out.push_back(counted(f.flyaways, " more than ten times the scene's size away from it"));
    }
    if (f.fill_ratio > kSuspiciousFill) {
      out.push_back("fill ratio " +
                    std::to_string(static_cast<int64_t>(std::min(f.fill_ratio, 1e18))) +
                    ": the splats cover the scene that many times over");
    }
  }

  std::string dropped_reasons() const {
    std::string out;
    const auto add = [&](uint64_t count, const char* why) {
      if (count > 0) out += (out.empty() ? "" : ", ") + std::to_string(count) + " " + why;
    };
    add(findings_.not_finite, "not finite");
    add(findings_.without_rotation, "without rotation");
    add(findings_.transparent, "of opacity 0");
    add(findings_.out_of_range, "too large or too far away");
    return " that cannot be drawn (" + out + ")";
  }

  RawSplats raw_;
  const std::filesystem::path& path_;
  SplatFindings findings_;
  bool all_scales_positive_ = false;
  bool all_probabilities_ = false;
  uint64_t unlabelled_ = 0;  // splats, where others have a label
};

}  // namespace

GaussianFile examine_splats(RawSplats raw,
                            const std::filesystem::path& path,
                            const std::optional<Frame>& frame) {
  return Examination(std::move(raw), path).into(frame);
}

}  // namespace cgs
