// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/gaussian_ply.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "io/atomic_file.h"
#include "io/byte_writer.h"
#include "io/ply_frame.h"
#include "io/ply_rows.h"

namespace cgs {

namespace {

/// Internal scales stay where their squares are normal floats.
constexpr double kSmallestScale = 0x1p-60;
constexpr double kLargestScale = 0x1p60;

void require_writable(const Gaussians& g) {
  require(g.sh_degree >= 0 && g.sh_degree <= 3, "Gaussians.sh_degree must be 0 to 3", g.sh_degree);
  const size_t n = g.size();
  const size_t sh = n * static_cast<size_t>(g.sh_count());
  require(g.scale.size() == n, "Gaussians.scale must be as long as position", g.scale.size());
  require(g.rotation.size() == n, "Gaussians.rotation must be as long as position", n);
  require(g.opacity.size() == n, "Gaussians.opacity must be as long as position", n);
  require(g.sh.size() == sh, "Gaussians.sh must have sh_count() entries per Gaussian", g.sh.size());
  for (size_t i = 0; i < n; ++i) {
    require(g.position[i].allFinite() && g.rotation[i].allFinite(),
            "Gaussians: positions and rotations must be finite; index",
            i);
    require(g.scale[i].allFinite() && g.scale[i].minCoeff() > 0, "Gaussians.scale must be > 0", i);
    require(
        g.opacity[i] > 0 && g.opacity[i] < 1, "Gaussians.opacity must be in (0, 1)", g.opacity[i]);
  }
  for (const Eigen::Vector3f& c : g.sh) {
    require(c.allFinite(), "Gaussians.sh must be finite", c.transpose());
  }
}

std::string header_text(const Gaussians& g, const Frame& frame) {
  std::string out = "ply\nformat binary_little_endian 1.0\ncomment generator cgs\n";
  out += ply_frame_comments(frame);
  out += "element vertex " + std::to_string(g.size()) + "\n";
  const auto add = [&](const std::string& name) { out += "property float " + name + "\n"; };
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"})
    add(name);
  for (int i = 0; i < 3 * (g.sh_count() - 1); ++i) add("f_rest_" + std::to_string(i));
  for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2"}) add(name);
  for (const char* name : {"rot_0", "rot_1", "rot_2", "rot_3"}) add(name);
  return out + "end_header\n";
}

void append_gaussian(std::string& out, const Gaussians& g, const Frame& frame, size_t i) {
  const Eigen::Vector3d p = frame.file_from_internal(g.position[i].cast<double>());
  for (const double c : p) append_bytes(out, static_cast<float>(c));
  for (int k = 0; k < 3; ++k) append_bytes(out, 0.0f);  // nx ny nz
  const auto count = static_cast<size_t>(g.sh_count());
  const Eigen::Vector3f* sh = g.sh.data() + i * count;
  for (const float c : sh[0]) append_bytes(out, c);
  for (int channel = 0; channel < 3; ++channel) {
    for (size_t k = 1; k < count; ++k) append_bytes(out, sh[k][channel]);
  }
  const double opacity = g.opacity[i];
  append_bytes(out, static_cast<float>(std::log(opacity) - std::log1p(-opacity)));
  for (const float s : g.scale[i]) append_bytes(out, static_cast<float>(std::log(s * frame.scale)));
  for (const float q : g.rotation[i]) append_bytes(out, q);
}

/// Columns of the properties of a splat within the vertex element.
struct SplatColumns {
  std::array<int, 3> position{};
  std::array<int, 3> dc{};
  std::vector<int> rest;
  int opacity = -1;
  std::array<int, 3> scale{};
  std::array<int, 4> rotation{};
};

class ColumnFinder {
 public:
  ColumnFinder(const PlyElement& vertex, const std::filesystem::path& path)
      : vertex_(vertex), path_(path) {}

  bool has(const std::string& name) const { return vertex_.find(name) >= 0; }

  int column(const std::string& name) const {
    const int i = vertex_.find(name);
    if (i < 0) {
      const bool mesh = !has("f_dc_0") && !has("opacity");
      fail(Defect::Schema, (mesh ? "plain point cloud? missing " : "missing property ") + name);
    }
    if (vertex_.properties[static_cast<size_t>(i)].is_list) {
      fail(Defect::Schema, "property " + name + " is a list");
    }
    return i;
  }

  template <size_t N>
  std::array<int, N> columns(const std::string& prefix) const {
    std::array<int, N> out{};
    for (size_t k = 0; k < N; ++k) out.at(k) = column(prefix + std::to_string(k));
    return out;
  }

  std::vector<int> rest_columns() const {
    size_t count = 0;
    for (const PlyProperty& p : vertex_.properties) {
      if (p.name.compare(0, 7, "f_rest_") == 0) ++count;
    }
    if (count != 0 && count != 9 && count != 24 && count != 45) {
      fail(Defect::Schema,
           std::to_string(count) + " f_rest_* properties, allowed are 0, 9, 24 and 45");
    }
    std::vector<int> out;
    for (size_t k = 0; k < count; ++k) out.push_back(column("f_rest_" + std::to_string(k)));
    return out;
  }

  [[noreturn]] void fail(Defect defect, const std::string& reason) const {
    throw BadInput(defect, path_, reason);
  }

 private:
  const PlyElement& vertex_;
  const std::filesystem::path& path_;
};

SplatColumns splat_columns(const PlyHeader& header, const std::filesystem::path& path) {
  const PlyElement* vertex = header.find("vertex");
  if (vertex == nullptr) throw BadInput(Defect::Schema, path, "missing element vertex");
  if (vertex->count == 0) throw BadInput(Defect::Empty, path, "0 vertices");
  const ColumnFinder find(*vertex, path);
  if (find.has("scale_0") && find.has("scale_1") && !find.has("scale_2")) {
    find.fail(Defect::Unsupported, "2D splats (no scale_2)");
  }
  SplatColumns out;
  out.position = {find.column("x"), find.column("y"), find.column("z")};
  out.scale = find.columns<3>("scale_");
  out.rotation = find.columns<4>("rot_");
  out.opacity = find.column("opacity");
  out.dc = find.columns<3>("f_dc_");
  out.rest = find.rest_columns();
  return out;
}

template <typename Vector, typename Columns>
Vector gather(const PlyRow& row, const Columns& columns) {
  Vector out = Vector::Zero();
  for (size_t k = 0; k < columns.size(); ++k) {
    out[static_cast<Eigen::Index>(k)] = row.values[static_cast<size_t>(columns[k])];
  }
  return out;
}

/// Collects splats; positions and log scales stay in file units until the frame is known.
class SplatRows {
 public:
  explicit SplatRows(SplatColumns columns) : columns_(std::move(columns)) {
    const size_t rest = columns_.rest.size() / 3;
    gaussians.sh_degree = rest == 0 ? 0 : rest == 3 ? 1 : rest == 8 ? 2 : 3;
  }

  void add(const PlyRow& row) {
    const auto p = gather<Eigen::Vector3d>(row, columns_.position);
    const auto log_scale = gather<Eigen::Vector3d>(row, columns_.scale);
    auto rotation = gather<Eigen::Vector4d>(row, columns_.rotation);
    const double logit = row.values[static_cast<size_t>(columns_.opacity)];
    const double largest = rotation.cwiseAbs().maxCoeff();
    bool good = p.allFinite() && !log_scale.hasNaN() && rotation.allFinite() && largest > 0;
    good = good && !std::isnan(logit) && logit > -std::numeric_limits<double>::infinity();
    const size_t sh_size = gaussians.sh.size();
    good = good && add_sh(row);
    if (!good) {
      gaussians.sh.resize(sh_size);
      ++dropped;
      return;
    }
    raw_linear_scales_ = raw_linear_scales_ && log_scale.minCoeff() > 0;
    raw_probabilities_ = raw_probabilities_ && logit >= 0 && logit <= 1;
    rotation /= largest;  // first, or squares of 1e200 overflow
    // A unit quaternion passes unchanged, so that a second round trip changes nothing.
    const double norm = rotation.norm() * largest;
    const double length = std::abs(norm - 1) < 1e-6 ? 1 / largest : rotation.norm();
    positions.push_back(p);
    log_scales.push_back(log_scale);
    gaussians.rotation.emplace_back((rotation / length).cast<float>());
    gaussians.opacity.push_back(opacity_from(logit));
  }

  bool scales_look_linear() const { return raw_linear_scales_; }
  bool opacity_looks_linear() const { return raw_probabilities_; }

  Gaussians gaussians;
  std::vector<Eigen::Vector3d> positions;   ///< [file coordinates]
  std::vector<Eigen::Vector3d> log_scales;  ///< [log of world units]
  uint64_t dropped = 0;
  uint64_t clamped = 0;

 private:
  bool add_sh(const PlyRow& row) {
    const size_t per_channel = columns_.rest.size() / 3;
    gaussians.sh.emplace_back(gather<Eigen::Vector3d>(row, columns_.dc).cast<float>());
    bool finite = gaussians.sh.back().allFinite();
    for (size_t k = 0; k < per_channel; ++k) {
      Eigen::Vector3f c = Eigen::Vector3f::Zero();
      for (size_t channel = 0; channel < 3; ++channel) {
        const auto column = static_cast<size_t>(columns_.rest[channel * per_channel + k]);
        c[static_cast<Eigen::Index>(channel)] = static_cast<float>(row.values[column]);
      }
      finite = finite && c.allFinite();
      gaussians.sh.push_back(c);
    }
    return finite;
  }

  float opacity_from(double logit) {
    if (std::isinf(logit)) {
      ++clamped;
      return 0.99f;
    }
    constexpr float kLargest = 1 - std::numeric_limits<float>::epsilon() / 2;
    const auto opacity = static_cast<float>(1 / (1 + std::exp(-logit)));
    if (opacity > 0 && opacity <= kLargest) return opacity;
    ++clamped;
    return opacity > 0 ? kLargest : std::numeric_limits<float>::min();
  }

  SplatColumns columns_;
  bool raw_linear_scales_ = true;
  bool raw_probabilities_ = true;
};

/// Corners of the box from the 1st to the 99th percentile along each axis.
std::vector<Eigen::Vector3d> inner_corners(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();
  const size_t cut = points.size() / 100;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(
        points.begin(), points.end(), values.begin(), [&](const auto& p) { return p[axis]; });
    const auto at = [&](size_t i) {
      std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(i), values.end());
      return values[i];
    };
    low[axis] = at(cut);
    high[axis] = at(points.size() - 1 - cut);
  }
  return {low, high};
}

/// Moves what was collected into the frame; drops splats that leave the range of float there.
Gaussians into_frame(SplatRows& rows, const PlyPlacement& placement) {
  Gaussians& from = rows.gaussians;
  Gaussians out;
  out.sh_degree = from.sh_degree;
  const auto sh_count = static_cast<size_t>(out.sh_count());
  const double log_unit = std::log(placement.frame.scale);
  for (size_t i = 0; i < rows.positions.size(); ++i) {
    const Eigen::Vector3f p = placement.internal(rows.positions[i]).cast<float>();
    const Eigen::Vector3d s = (rows.log_scales[i].array() - log_unit).exp();
    if (!p.allFinite() || !(s.maxCoeff() <= kLargestScale)) {
      ++rows.dropped;
      continue;
    }
    if (s.minCoeff() < kSmallestScale) ++rows.clamped;
    out.position.push_back(p);
    out.scale.emplace_back(s.cwiseMax(kSmallestScale).cast<float>());
    out.rotation.push_back(from.rotation[i]);
    out.opacity.push_back(from.opacity[i]);
    const auto first = from.sh.begin() + static_cast<ptrdiff_t>(i * sh_count);
    out.sh.insert(out.sh.end(), first, first + static_cast<ptrdiff_t>(sh_count));
  }
  return out;
}

/// How often the largest cross sections (ellipses at 3 sigma) would cover a square of the extent.
double fill_ratio(const Gaussians& gaussians,
                  const std::vector<Eigen::Vector3d>& corners,
                  double scale) {
  const double extent = (corners[1] - corners[0]).maxCoeff() / scale;
  double area = 0;
  for (const Eigen::Vector3f& s : gaussians.scale) {
    const Eigen::Vector3d d = s.cast<double>();
    area += 9 * std::numbers::pi * d.prod() / d.minCoeff();
  }
  return extent > 0 ? area / (extent * extent) : 0;
}

std::string counted(uint64_t count, const std::string& what) {
  return std::to_string(count) + (count == 1 ? " splat" : " splats") + what;
}

}  // namespace

void write_gaussian_ply(const std::filesystem::path& path,
                        const Gaussians& gaussians,
                        const Frame& frame) {
  require_writable(gaussians);
  AtomicFile file(path);
  file.write(header_text(gaussians, frame));
  std::string record;
  for (size_t i = 0; i < gaussians.size(); ++i) {
    record.clear();
    append_gaussian(record, gaussians, frame, i);
    file.write(record);
  }
  file.commit();
}

GaussianFile read_gaussian_ply(const std::filesystem::path& path,
                               const std::optional<Frame>& frame) {
  const std::string bytes = read_file(path);
  const PlyHeader header = parse_ply_header(bytes, path);
  SplatRows rows(splat_columns(header, path));
  const uint64_t trailing = read_ply_rows(
      bytes, path, header, [&](const PlyElement& element, uint64_t, const PlyRow& row) {
        if (element.name == "vertex") rows.add(row);
      });
  if (rows.positions.empty()) throw BadInput(Defect::Value, path, "no finite splats");
  const std::vector<Eigen::Vector3d> corners = inner_corners(rows.positions);
  PlyPlacement placement = ply_placement(header.comments, corners, frame);
  GaussianFile out{into_frame(rows, placement), placement.frame, std::move(placement.warnings)};
  if (out.gaussians.size() == 0) {
    throw BadInput(Defect::Value, path, "no finite splats: every one leaves the range of float");
  }
  const auto warn = [&](const std::string& text) { out.warnings.push_back(text); };
  if (trailing > 0) warn("trailing " + std::to_string(trailing) + " bytes ignored");
  if (rows.dropped > 0) warn("dropped " + counted(rows.dropped, " that cannot be drawn"));
  if (rows.clamped > 0) warn("clamped opacity or scale of " + counted(rows.clamped, ""));
  if (rows.scales_look_linear()) warn("scale_* look linear, not log: all are positive");
  if (rows.opacity_looks_linear()) warn("opacity looks like a probability, not a logit");
  const double fill = fill_ratio(out.gaussians, corners, out.frame.scale);
  constexpr double kSuspiciousFill = 1e3;
  if (fill > kSuspiciousFill) {
    warn("fill ratio " + std::to_string(static_cast<int64_t>(std::min(fill, 1e18))) +
         ": the splats cover the scene that many times over");
  }
  return out;
}

}  // namespace cgs
