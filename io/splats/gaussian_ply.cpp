// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/gaussian_ply.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/percent_encoding.h"
#include "io/ply/frame.h"
#include "io/ply/rows.h"
#include "io/splats/splat_arrays.h"

namespace cgs {

namespace {

constexpr const char* kHeaderStart = "ply\nformat binary_little_endian 1.0\ncomment ";

constexpr const char* kProvenanceProperty = "provenance";
constexpr const char* kSyntheticProperty = "synthetic";
constexpr std::string_view kSyntheticComment = "synthetic ";

constexpr size_t kLongestHeader = 131072;  // of those that write_gaussian_ply() writes

std::string header_start(const Frame& frame,
                         const std::string& evidence,
                         const std::vector<SyntheticSource>& sources) {
  std::string out = kHeaderStart;
  out += kPlyGenerator;
  out += '\n' + ply_frame_comments(frame) + ply_evidence_comment(evidence);
  for (size_t k = 0; k < sources.size(); ++k) {
    const auto& [file, sha256] = sources[k];
    out += "comment " + std::string(kSyntheticComment) + std::to_string(k + 1) +
           " sha256:" + sha256 + " " + percent_encoded(one_line(file)) + "\n";
  }
  return out;
}

// What header_start() says of them, in files of ours.
std::vector<SyntheticSource> sources_in(const std::vector<std::string>& comments) {
  std::vector<SyntheticSource> out;
  if (!is_our_ply(comments)) return out;
  for (const std::string& comment : comments) {
    const std::string mark =
        std::string(kSyntheticComment) + std::to_string(out.size() + 1) + " sha256:";
    if (!comment.starts_with(mark)) continue;
    const std::string rest = comment.substr(mark.size());
    const size_t end = rest.find(' ');
    const std::string file = end == std::string::npos ? "" : rest.substr(end + 1);
    out.push_back({percent_decoded(file), rest.substr(0, end)});
  }
  return out;
}

std::string header_text(const Gaussians& g, const Frame& frame, const std::string& evidence) {
  std::string out = header_start(frame, evidence, g.synthetic_sources);
  out += "element vertex " + std::to_string(g.size()) + "\n";
  const auto add = [&](const std::string& name) { out += "property float " + name + "\n"; };
  for (const char* name : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"})
    add(name);
  for (int i = 0; i < 3 * (g.sh_count() - 1); ++i) add("f_rest_" + std::to_string(i));
  for (const char* name : {"opacity", "scale_0", "scale_1", "scale_2"}) add(name);
  for (const char* name : {"rot_0", "rot_1", "rot_2", "rot_3"}) add(name);
  if (!g.provenance.empty()) add(kProvenanceProperty);
  if (!g.synthetic.empty()) add(kSyntheticProperty);
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
  if (!g.provenance.empty()) append_bytes(out, static_cast<float>(g.provenance[i]));
  if (!g.synthetic.empty()) append_bytes(out, static_cast<float>(g.synthetic[i]));
}

/// Columns of the properties of a splat within the vertex element.
struct SplatColumns {
  std::array<int, 3> position{};
  std::array<int, 3> color{};  ///< f_dc_0..2, or red green blue.
  std::vector<int> rest;
  int opacity = -1;
  std::vector<int> scale;  ///< Three, or two of 2D splats.
  std::array<int, 4> rotation{};
  int filter = -1;            ///< filter_3D, -1 if there is none.
  int provenance = -1;        ///< -1 if there is none.
  int synthetic = -1;         ///< -1 if there is none.
  double color_range = 0;     ///< Largest value of red, green and blue; 0 = f_dc_*.
  bool may_be_bytes = false;  ///< These are floats, which some programs write up to 255.
};

class ColumnFinder {
 public:
  ColumnFinder(const PlyElement& vertex, const std::filesystem::path& path)
      : vertex_(vertex), path_(path) {}

  bool has(const std::string& name) const { return vertex_.find(name) >= 0; }

  /// -1 where there is no such number: what others call so is ignored, as all else.
  int optional_column(const std::string& name) const {
    const int i = vertex_.find(name);
    return i >= 0 && vertex_.properties[static_cast<size_t>(i)].is_list ? -1 : i;
  }

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

  /// Names that programs give to the three parts of a colour.
  std::optional<std::array<const char*, 3>> color_names() const {
    for (const std::array<const char*, 3>& names :
         {std::array{"red", "green", "blue"},
          std::array{"diffuse_red", "diffuse_green", "diffuse_blue"},
          std::array{"r", "g", "b"}}) {
      if (has(names[0]) && has(names[1]) && has(names[2])) return names;
    }
    return std::nullopt;
  }

  /// Colour as a byte, in a wider whole number too, as 16 bits, or a float in [0, 1].
  double color_range(int red) const {
    const PlyType type = vertex_.properties[static_cast<size_t>(red)].type;
    if (type == PlyType::Float32 || type == PlyType::Float64) return 1;
    return type == PlyType::UInt16 ? 65535 : 255;
  }

  std::vector<int> rest_columns() const {
    size_t count = 0;
    for (const PlyProperty& p : vertex_.properties) {
      if (p.name.compare(0, 7, "f_rest_") == 0) ++count;
    }
    if (count != 0 && count != 9 && count != 24 && count != 45 && count != 72) {
      fail(Defect::Schema,
           std::to_string(count) + " f_rest_* properties, allowed are 0, 9, 24, 45 and 72");
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
  SplatColumns out;
  out.position = {find.column("x"), find.column("y"), find.column("z")};
  out.scale = {find.column("scale_0"), find.column("scale_1")};
  const bool flat = !find.has("scale_2") && find.has("opacity") && find.has("rot_0");
  if (!flat) out.scale.push_back(find.column("scale_2"));
  out.rotation = find.columns<4>("rot_");
  out.opacity = find.column("opacity");
  if (find.has("filter_3D")) out.filter = find.column("filter_3D");
  out.provenance = find.optional_column(kProvenanceProperty);
  out.synthetic = find.optional_column(kSyntheticProperty);
  if (const auto names = find.color_names(); names && !find.has("f_dc_0")) {
    for (size_t k = 0; k < 3; ++k) out.color.at(k) = find.column(names->at(k));
    out.color_range = find.color_range(out.color[0]);
    out.may_be_bytes = out.color_range == 1;
  } else {
    out.color = find.columns<3>("f_dc_");
  }
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

/// Blurs a splat by the smoothing filter of its photographs' resolution, which is no part of its
/// scales and opacity as stored: sigma^2 + filter^2 along every axis, with as much mass as before.
/// Source: Yu et al. 2024, "Mip-Splatting", equation 9.
void apply_smoothing_filter(double filter, Eigen::Vector3d& log_scale, double& logit) {
  if (filter == 0) return;
  if (!(filter > 0) || !std::isfinite(filter)) {
    log_scale.setConstant(std::nan(""));  // as for a scale that is no number
    return;
  }
  const double log_variance = 2 * std::log(filter);
  double log_opacity = std::min(logit, 0.0) - std::log1p(std::exp(-std::abs(logit)));
  for (double& s : log_scale) {
    const double larger = std::max(2 * s, log_variance);
    const double smaller = std::min(2 * s, log_variance);
    const double blurred = (larger + std::log1p(std::exp(smaller - larger))) / 2;
    log_opacity += s - blurred;
    s = blurred;
  }
  const double rest = std::max(-std::expm1(log_opacity), std::numeric_limits<double>::min());
  logit = log_opacity - std::log(rest);
}

/// Collects the rows of the vertex element.
class SplatRows {
 public:
  SplatRows(SplatColumns columns, uint64_t count) : columns_(std::move(columns)) {
    const size_t per_channel = columns_.rest.size() / 3;
    splats_.sh_degree = per_channel == 0 ? 0 : per_channel == 3 ? 1 : per_channel == 8 ? 2 : 3;
    kept_per_channel_ = std::min<size_t>(per_channel, 15);
    if (per_channel > kept_per_channel_) {
      splats_.notes.emplace_back("spherical harmonics of degree 4 left out");
    }
    splats_.format = columns_.scale.size() == 2 ? "2DGS PLY" : "3DGS PLY";
    if (columns_.scale.size() == 2) {
      splats_.notes.emplace_back("2D splats (no scale_2): a thousandth of the smaller width thick");
    }
    if (columns_.filter >= 0) {
      splats_.notes.emplace_back("smoothing filter of every splat (filter_3D) applied");
    }
    splats_.reserve(count);
    if (columns_.provenance >= 0) splats_.provenance.reserve(count);
    if (columns_.synthetic >= 0) splats_.synthetic.reserve(count);
  }

  void add(const PlyRow& row) {
    splats_.position.push_back(gather<Eigen::Vector3d>(row, columns_.position));
    auto scale = gather<Eigen::Vector3d>(row, columns_.scale);
    constexpr double kThickness = -6.9077552789821370;  // log of 1/1000
    if (columns_.scale.size() == 2) scale[2] = std::min(scale[0], scale[1]) + kThickness;
    auto rotation = gather<Eigen::Vector4d>(row, columns_.rotation);
    constexpr double kLargest = 1e30;  // of double properties, which float may not hold
    const double largest = rotation.cwiseAbs().maxCoeff();
    if (largest > kLargest && std::isfinite(largest)) rotation /= largest;
    splats_.rotation.emplace_back(rotation.cast<float>());
    double logit = row.values[static_cast<size_t>(columns_.opacity)];
    if (columns_.filter >= 0) {
      apply_smoothing_filter(row.values[static_cast<size_t>(columns_.filter)], scale, logit);
    }
    splats_.log_scale.emplace_back(scale.cast<float>());
    splats_.logit.push_back(static_cast<float>(logit));
    if (columns_.provenance >= 0) {
      const double label = row.values[static_cast<size_t>(columns_.provenance)];
      splats_.provenance.push_back(static_cast<float>(label));
    }
    if (columns_.synthetic >= 0) {
      const double tag = row.values[static_cast<size_t>(columns_.synthetic)];
      splats_.synthetic.push_back(static_cast<float>(tag));
    }
    add_color(row);
  }

  RawSplats take() {
    if (columns_.may_be_bytes && brightest_ > kBeyondWhite) {
      splats_.notes.emplace_back("colours above 2: taken as values from 0 to 255");
      const auto count = static_cast<size_t>((splats_.sh_degree + 1) * (splats_.sh_degree + 1));
      for (size_t i = 0; i < splats_.sh.size(); i += count) {
        const Eigen::Array3f color = splats_.sh[i].array() * kShC0 + 0.5f;
        splats_.sh[i] = (color / 255 - 0.5f) / kShC0;
      }
    }
    return std::move(splats_);
  }

 private:
  void add_color(const PlyRow& row) {
    auto color = gather<Eigen::Vector3d>(row, columns_.color);
    if (color.allFinite()) brightest_ = std::max(brightest_, color.maxCoeff());
    if (columns_.color_range > 0) color = (color / columns_.color_range).array() - 0.5;
    if (columns_.color_range > 0) color /= double{kShC0};
    splats_.sh.emplace_back(color.cast<float>());
    const size_t per_channel = columns_.rest.size() / 3;
    for (size_t k = 0; k < kept_per_channel_; ++k) {
      Eigen::Vector3f c = Eigen::Vector3f::Zero();
      for (size_t channel = 0; channel < 3; ++channel) {
        const auto column = static_cast<size_t>(columns_.rest[channel * per_channel + k]);
        c[static_cast<Eigen::Index>(channel)] = static_cast<float>(row.values[column]);
      }
      splats_.sh.push_back(c);
    }
  }

  static constexpr double kBeyondWhite = 2;  // a little brighter than white colours may be
  SplatColumns columns_;
  double brightest_ = 0;  // of colours as stored
  size_t kept_per_channel_ = 0;
  RawSplats splats_;
};

}  // namespace

void write_gaussian_ply(const std::filesystem::path& path,
                        const Gaussians& gaussians,
                        const Frame& frame,
                        const std::string& evidence) {
  require_writable(gaussians);
  AtomicFile file(path);
  file.write(header_text(gaussians, frame, evidence));
  std::string record;
  for (size_t i = 0; i < gaussians.size(); ++i) {
    record.clear();
    append_gaussian(record, gaussians, frame, i);
    file.write(record);
  }
  file.commit();
}

bool restate_gaussian_ply(const std::filesystem::path& path, const Frame& frame) {
  const std::string bytes = read_file(path);
  const std::vector<std::string> comments = parse_ply_header(bytes, path).comments;
  // Other programs may keep our comments, but not the order of the lines around them.
  const size_t splats = bytes.find("\nelement vertex ");
  if (!bytes.starts_with(kHeaderStart) || !is_our_ply(comments) || splats > kLongestHeader) {
    return false;
  }
  AtomicFile file(path);
  file.write(header_start(frame, ply_evidence(comments), sources_in(comments)));
  file.write(std::string_view(bytes).substr(splats + 1));
  file.commit();
  return true;
}

RawSplats parse_gaussian_ply(std::string_view bytes, const std::filesystem::path& path) {
  const PlyHeader header = parse_ply_header(bytes, path);
  SplatColumns columns = splat_columns(header, path);
  const PlyElement& vertex = *header.find("vertex");
  // A count that the file cannot hold is refused by read_ply_rows(), not by the allocation.
  SplatRows rows(std::move(columns),
                 std::min<uint64_t>(vertex.count, bytes.size() / vertex.properties.size()));
  const uint64_t trailing = read_ply_rows(
      bytes, path, header, [&](const PlyElement& element, uint64_t, const PlyRow& row) {
        if (element.name == "vertex") rows.add(row);
      });
  RawSplats out = rows.take();
  out.comments = header.comments;
  out.evidence = ply_evidence(out.comments);
  out.synthetic_sources = sources_in(out.comments);
  out.may_be_linear =  // no program that states filters writes lengths
      vertex.find("filter_3D") < 0 && !is_our_ply(out.comments);
  const PlyProperty& x = vertex.properties[static_cast<size_t>(vertex.find("x"))];
  if (x.type == PlyType::Float64) out.digits = kDoubleDigits;
  if (trailing > 0) {
    out.notes.push_back("trailing " + std::to_string(trailing) + " bytes ignored");
  }
  return out;
}

GaussianFile read_gaussian_ply(const std::filesystem::path& path,
                               const std::optional<Frame>& frame) {
  return examine_splats(parse_gaussian_ply(read_file(path), path), path, frame);
}

}  // namespace cgs
