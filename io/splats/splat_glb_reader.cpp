// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/splat_glb_reader.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "io/bytes/byte_writer.h"
#include "io/glb/container.h"
#include "io/glb/extensions.h"
#include "io/glb/scene.h"
#include "io/splats/sh_rotation.h"
#include "io/splats/splat_glb.h"
#include "io/splats/spz_reader.h"
#include "libcgs/core/error.h"
#include "libcgs/core/gaussians.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

// Nodes may repeat a mesh, so that the size of the file is no bound.
constexpr uint64_t kMostSplats = uint64_t{1} << 26;
constexpr uint64_t kMostHarmonics = uint64_t{1} << 28;
constexpr uint64_t kMostPrimitives = uint64_t{1} << 20;

constexpr const char* kSpz2 = "KHR_gaussian_splatting_compression_spz_2";

std::optional<JsonValue> splat_extension(const JsonValue& primitive) {
  return extension_of(primitive, kGaussianSplatting);
}

/// The extension by which splats are compressed with SPZ, inside that of splats.
std::optional<JsonValue> spz_extension(const JsonValue& splats) {
  const auto spz = extension_of(splats, kSpz2);
  return spz ? spz : extension_of(splats, "KHR_gaussian_splatting_compression_spz");
}

/// An attribute of splats as a primitive has it: drafts of the extension have _SCALE for
/// KHR_gaussian_splatting:SCALE, and so on.
std::string attribute_name(const JsonValue& attributes, const std::string& name) {
  const std::string draft = "_" + name.substr(name.find(':') + 1);
  return !attributes.find(name) && attributes.find(draft) ? draft : name;
}

/// The highest degree of which anything is there.
int sh_degree(const JsonValue& attributes) {
  for (int degree = 3; degree > 0; --degree) {
    for (int order = 0; order <= 2 * degree; ++order) {
      const std::string name = splat_harmonic_name(degree, order);
      if (attributes.find(attribute_name(attributes, name))) return degree;
    }
  }
  return 0;
}

/// The primitives of a scene, those of a mesh once for every node that shows it.
struct ScenePrimitives {
  uint64_t splats = 0;           ///< Entries of their positions.
  int sh_degree = 0;             ///< The highest.
  bool has_triangles = false;    ///< In primitives that are no splats.
  std::set<std::string> others;  ///< Those, by their place in the file.
};

ScenePrimitives scene_primitives(const GlbContainer& file,
                                 const std::vector<GlbInstance>& instances) {
  constexpr int kTriangles = 4;
  ScenePrimitives out;
  uint64_t visited = 0;
  for (const GlbInstance& instance : instances) {
    const JsonValue primitives = instance.mesh.at("primitives");
    visited += primitives.size();
    if (visited > kMostPrimitives) {
      throw LimitError(printable(file.path()) + ": the nodes show more than " +
                       std::to_string(kMostPrimitives) + " primitives");
    }
    for (size_t i = 0; i < primitives.size(); ++i) {
      const JsonValue primitive = primitives.at(i);
      const auto extension = splat_extension(primitive);
      if (!extension) {
        const auto mode = primitive.find("mode");
        out.has_triangles = out.has_triangles || !mode || mode->count() >= kTriangles;
        out.others.insert(primitive.pointer());
        continue;
      }
      if (const auto spz = spz_extension(*extension)) {
        const std::string_view bytes = file.view_bytes(spz->at("bufferView"));
        const SpzCount stated = stated_spz_splats(bytes, file.path());
        out.splats += std::min(stated.splats, kSpzSplatsPerByte * bytes.size());
        out.sh_degree =
            std::max(out.sh_degree, static_cast<int>(std::lround(std::sqrt(stated.harmonics))) - 1);
        continue;
      }
      const JsonValue attributes = primitive.at("attributes");
      out.sh_degree = std::max(out.sh_degree, sh_degree(attributes));
      const JsonValue positions = file.element("accessors", attributes.at("POSITION"));
      out.splats += std::min(whole_number(positions.at("count")), kMostSplats + 1);
    }
  }
  return out;
}

/// What a node does to splats: the linear part of its matrix.
class SplatTurn {
 public:
  /// \param linear  not singular
  explicit SplatTurn(const Eigen::Matrix3d& linear)
      : linear_(linear), factor_(std::cbrt(std::abs(linear.determinant()))) {
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(linear, Eigen::ComputeFullU | Eigen::ComputeFullV);
    rotation_ = svd.matrixU() * svd.matrixV().transpose();
    constexpr double kRounding = 1e-9;
    const Eigen::Vector3d sizes = svd.singularValues() / factor_;
    is_uniform_ = (sizes.array() - 1).abs().maxCoeff() < 1e-6;
    turns_ = !rotation_.isApprox(Eigen::Matrix3d::Identity(), kRounding);
    // A mirrored ellipsoid is also one that was turned, and not mirrored.
    const double sign = rotation_.determinant() < 0 ? -1 : 1;
    quaternion_ = Eigen::Quaterniond(Eigen::Matrix3d(sign * rotation_));
    harmonics_ = ShRotation(rotation_);
  }

  /// \param scale     of the splat; its length is returned here
  /// \param rotation  (w, x, y, z), of any length
  void apply(Eigen::Vector3d& scale, Eigen::Vector4f& rotation) const {
    if (is_uniform_) {
      scale *= factor_;
      if (turns_) rotation = turned(rotation);
      return;
    }
    const Eigen::Vector4d q = rotation.cast<double>();
    if (!q.allFinite() || q.isZero(0) || !scale.allFinite()) return;  // judged later
    const Eigen::Quaterniond local = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
    const Eigen::Matrix3d axes = linear_ * local.toRotationMatrix() * scale.asDiagonal();
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(axes, Eigen::ComputeFullU);
    Eigen::Matrix3d u = svd.matrixU();
    if (u.determinant() < 0) u.col(2) *= -1;
    scale = svd.singularValues();
    const Eigen::Quaterniond out(u);
    rotation = Eigen::Vector4d(out.w(), out.x(), out.y(), out.z()).cast<float>();
  }

  void apply(std::span<Eigen::Vector3f> harmonics) const {
    if (turns_) harmonics_.apply(harmonics);
  }

 private:
  Eigen::Vector4f turned(const Eigen::Vector4f& rotation) const {
    const Eigen::Vector4d q = rotation.cast<double>();
    const Eigen::Quaterniond out = quaternion_ * Eigen::Quaterniond(q[0], q[1], q[2], q[3]);
    return Eigen::Vector4d(out.w(), out.x(), out.y(), out.z()).cast<float>();
  }

  Eigen::Matrix3d linear_;
  double factor_;
  Eigen::Matrix3d rotation_;
  Eigen::Quaterniond quaternion_;
  ShRotation harmonics_ = ShRotation(Eigen::Matrix3d::Identity());
  bool is_uniform_ = true;
  bool turns_ = false;
};

/// Linear light to sRGB, the slope of the curve at the mean colour for what is added to it.
void srgb_from_linear_harmonics(std::span<Eigen::Vector3f> harmonics) {
  constexpr float kStep = 1e-3F;
  for (int channel = 0; channel < 3; ++channel) {
    const float mean = std::clamp(kShC0 * harmonics[0][channel] + 0.5F, 0.0F, 1.0F);
    const float low = std::max(0.0F, mean - kStep);
    const float high = std::min(1.0F, mean + kStep);
    const float slope = (srgb_from_linear(high) - srgb_from_linear(low)) / (high - low);
    harmonics[0][channel] = (srgb_from_linear(mean) - 0.5F) / kShC0;
    for (size_t k = 1; k < harmonics.size(); ++k) harmonics[k][channel] *= slope;
  }
}

/// The attributes of a primitive; all have `count` entries.
struct Attributes {
  size_t count = 0;
  std::vector<float> position, rotation, scale, opacity;
  std::vector<std::vector<float>> harmonics;
  std::vector<float> provenance;  ///< Empty = not stated.
  std::vector<float> synthetic;   ///< Likewise.
  double opacity_step = 0;        ///< Of whole numbers; 0 for floats.

  Eigen::Vector3d three(const std::vector<float>& values, size_t i) const {
    return {values[3 * i], values[3 * i + 1], values[3 * i + 2]};
  }
};

/// Puts the primitives of all nodes together.
class SplatScene {
 public:
  explicit SplatScene(const GlbContainer& file) : file_(file), origin_(glb_origin(file)) {
    splats_.format = "glTF (KHR_gaussian_splatting)";
    splats_.digits = kDoubleDigits;  // their rounding is judged here, before nodes move them
    splats_.comments = origin_.comments;
  }

  RawSplats read() {
    const GlbScene scene = glb_scene(file_);
    examine(scene.instances);
    place();
    for (const GlbInstance& instance : scene.instances) add_mesh(instance);
    if (!splats_.provenance.empty()) leave_unlabelled(splats_.size());
    if (!splats_.synthetic.empty()) splats_.synthetic.resize(splats_.size(), 0);
    if (splats_.size() == 0) throw BadInput(Defect::Empty, file_.path(), "holds no splats");
    const std::string odd = check_significance(file_.path(), stored_, kFloatDigits);
    if (!odd.empty()) splats_.notes.push_back(odd);
    splats_.notes.insert(splats_.notes.end(), scene.warnings.begin(), scene.warnings.end());
    if (others_ > 0) {
      splats_.notes.push_back("left out " + std::to_string(others_) +
                              " primitives of the file that are no splats");
    }
    if (has_unknown_) {
      splats_.notes.emplace_back("kernel or colour space is not known; read as ellipses in sRGB");
    }
    if (has_logarithms_) {
      splats_.notes.emplace_back("scales below 0: read as logarithms, as drafts of the format had");
    }
    if (has_draft_axes_) {
      splats_.notes.emplace_back(
          "SPZ of a draft that states neither kernel nor colour space: its axes are read as those "
          "of glTF");
    }
    if (is_linear_) {
      splats_.notes.emplace_back(
          "colours were in linear light, now in sRGB: where splats overlap, they blend "
          "differently");
    }
    return std::move(splats_);
  }

 private:
  /// Finds the degree, and refuses too many splats before any is read.
  void examine(const std::vector<GlbInstance>& instances) {
    const ScenePrimitives found = scene_primitives(file_, instances);
    splats_.sh_degree = found.sh_degree;
    others_ = found.others.size();
    const uint64_t most = std::min(kMostSplats, kMostHarmonics / splats_.sh_count());
    if (found.splats > most) {
      throw LimitError(printable(file_.path()) + ": more than " + std::to_string(most) + " splats");
    }
  }

  /// Where glTF coordinates lie in those that are read: the file's of ours, else of the 3DGS PLY.
  void place() {
    if (!origin_.is_ours) {
      file_from_gltf_.linear() = Eigen::Vector3d(-1, -1, 1).asDiagonal();
      splats_.comments.emplace_back("up 0 -1 0");
      return;
    }
    Eigen::Vector3d file_origin = Eigen::Vector3d::Zero();
    const JsonValue extras = file_.root().at("asset").at("extras");
    if (const auto stated = extras.find("file_origin")) {
      if (stated->size() != 3) stated->fail(Defect::Count, "needs 3 numbers");
      for (int i = 0; i < 3; ++i) file_origin[i] = stated->at(static_cast<size_t>(i)).number();
    }
    if (const auto stated = extras.find("evidence")) splats_.evidence = stated->text();
    if (const auto stated = extras.find("synthetic_sources")) {
      for (size_t i = 0; i < stated->size(); ++i) {
        const JsonValue source = stated->at(i);
        splats_.synthetic_sources.push_back({source.at("file").text(), source.at("sha256").text()});
      }
    }
    file_from_gltf_.linear() = origin_.units_per_metre * origin_.world_from_gltf;
    file_from_gltf_.translation() = origin_.origin - file_origin;
    add_comment("file_origin", file_origin);
    add_comment("up", origin_.world_from_gltf * Eigen::Vector3d::UnitY());
  }

  void add_comment(const char* key, const Eigen::Vector3d& value) {
    std::string line = key;
    for (const double c : value) {
      line += ' ';
      append_number(line, c);
    }
    splats_.comments.push_back(line);
  }

  void add_mesh(const GlbInstance& instance) {
    const JsonValue primitives = instance.mesh.at("primitives");
    for (size_t i = 0; i < primitives.size(); ++i) {
      const auto extension = splat_extension(primitives.at(i));
      if (!extension) continue;
      const Eigen::Affine3d file_from_mesh = file_from_gltf_ * instance.gltf_from_mesh;
      const Eigen::Matrix3d linear = file_from_mesh.linear();
      if (!linear.allFinite() || linear.determinant() == 0 ||
          !std::isfinite(linear.determinant())) {
        primitives.at(i).fail(Defect::Value, "lies in a node that flattens splats");
      }
      if (const auto spz = spz_extension(*extension)) {
        add_compressed(*spz, *extension, file_from_mesh);
      } else {
        add(primitives.at(i), *extension, file_from_mesh);
      }
    }
  }

  /// What parse_spz() turned into the axes of the 3DGS PLY is turned on into those of glTF: blobs
  /// are packed as left, up, front. Files of its draft that state neither kernel nor colour space,
  /// as Cesium ion makes them, hold the coordinates of glTF as they are.
  /// Source: Khronos Group, KHR_gaussian_splatting_compression_spz_2, draft of 2025.
  void add_compressed(const JsonValue& spz,
                      const JsonValue& extension,
                      const Eigen::Affine3d& file_from_mesh) {
    const RawSplats in = parse_spz(file_.view_bytes(spz.at("bufferView")), file_.path());
    const bool is_draft = extension_of(extension, kSpz2) && !extension.find("kernel") &&
                          !extension.find("colorSpace");
    has_draft_axes_ = has_draft_axes_ || is_draft;
    const bool is_linear = note_look(extension);
    const Eigen::Vector3d signs =
        is_draft ? Eigen::Vector3d(1, -1, -1) : Eigen::Vector3d(-1, -1, 1);
    const Eigen::Affine3d file_from_spz = file_from_mesh * Eigen::Affine3d(Eigen::Scaling(signs));
    splats_.is_antialiased = splats_.is_antialiased || in.is_antialiased;
    for (const std::string& note : in.notes) splats_.notes.push_back(note);
    if (!splats_.provenance.empty()) leave_unlabelled(splats_.size() + in.size());
    const SplatTurn turn(file_from_spz.linear());
    for (size_t i = 0; i < in.size(); ++i) {
      stored_.extend(file_from_spz.linear() * in.position[i]);
      splats_.position.push_back(file_from_spz * in.position[i]);
      Eigen::Vector3d scale = in.log_scale[i].cast<double>().array().exp();
      Eigen::Vector4f rotation = in.rotation[i];
      turn.apply(scale, rotation);
      splats_.log_scale.emplace_back(scale.array().log().matrix().cast<float>());
      splats_.rotation.push_back(rotation);
      splats_.logit.push_back(in.logit[i]);
      const size_t begin = splats_.sh.size();
      splats_.sh.resize(begin + splats_.sh_count(), Eigen::Vector3f::Zero());
      const std::span<Eigen::Vector3f> out = std::span(splats_.sh).subspan(begin);
      std::copy_n(in.sh.begin() + static_cast<std::ptrdiff_t>(i * in.sh_count()),
                  std::min(in.sh_count(), out.size()),
                  out.begin());
      if (is_linear) srgb_from_linear_harmonics(out);
      turn.apply(out);
    }
  }

  Attributes attributes_of(const JsonValue& primitive) const {
    const JsonValue in = primitive.at("attributes");
    const auto named = [&](const char* what) {
      return attribute_name(in, std::string(kGaussianSplatting) + ":" + what);
    };
    Attributes out;
    const auto accessor = [&](const std::string& name) {
      return file_.element("accessors", in.at(name));
    };
    const auto values = [&](const std::string& name, int components) {
      std::vector<float> floats = file_.floats(accessor(name), components);
      const size_t count = floats.size() / static_cast<size_t>(components);
      if (name == "POSITION") out.count = count;
      if (count != out.count) {
        in.at(name).fail(Defect::Count,
                         "has " + std::to_string(count) + " entries for " +
                             std::to_string(out.count) + " positions");
      }
      return floats;
    };
    out.position = values("POSITION", 3);
    out.rotation = values(named("ROTATION"), 4);
    out.scale = values(named("SCALE"), 3);
    // Drafts had the colour that all directions share, and the opacity, in COLOR_0.
    const bool has_colors =
        in.find("COLOR_0") && !in.find(named("OPACITY")) && !in.find(named("SH_DEGREE_0_COEF_0"));
    if (has_colors) {
      take_colors(values("COLOR_0", 4), out);
    } else {
      out.opacity = values(named("OPACITY"), 1);
      out.opacity_step = step_of(accessor(named("OPACITY")));
    }
    const int last = sh_degree(in);
    for (int degree = has_colors ? 1 : 0; degree <= last; ++degree) {
      for (int order = 0; order <= 2 * degree; ++order) {
        out.harmonics.push_back(values(attribute_name(in, splat_harmonic_name(degree, order)), 3));
      }
    }
    if (in.find(kSplatProvenance) && accessor(kSplatProvenance).at("type").text() == "SCALAR") {
      out.provenance = values(kSplatProvenance, 1);
    }
    if (in.find(kSplatSynthetic) && accessor(kSplatSynthetic).at("type").text() == "SCALAR") {
      out.synthetic = values(kSplatSynthetic, 1);
    }
    return out;
  }

  static double step_of(const JsonValue& accessor) {
    constexpr int kUnsignedByte = 5121;
    constexpr int kUnsignedShort = 5123;
    const auto normalized = accessor.find("normalized");
    const int type = accessor.at("componentType").count();
    if (!normalized || !normalized->boolean()) return 0;
    return type == kUnsignedByte ? 1 / 255.0 : type == kUnsignedShort ? 1 / 65535.0 : 0;
  }

  static void take_colors(const std::vector<float>& rgba, Attributes& out) {
    out.opacity_step = 1 / 255.0;
    out.harmonics.emplace_back();
    for (size_t i = 0; i < rgba.size(); ++i) {
      if (i % 4 == 3) out.opacity.push_back(rgba[i]);
      if (i % 4 != 3) out.harmonics[0].push_back((rgba[i] - 0.5F) / kShC0);
    }
  }

  /// \return whether colours are in linear light
  bool note_look(const JsonValue& extension) {
    const auto kernel = extension.find("kernel");
    const auto space = extension.find("colorSpace");
    const std::string color_space = space ? space->text() : "srgb_rec709_display";
    const bool is_linear = color_space == "lin_rec709_display";
    has_unknown_ = has_unknown_ || (kernel && kernel->text() != "ellipse") ||
                   (!is_linear && color_space != "srgb_rec709_display");
    is_linear_ = is_linear_ || is_linear;
    return is_linear;
  }

  void add(const JsonValue& primitive,
           const JsonValue& extension,
           const Eigen::Affine3d& file_from_mesh) {
    const auto mode = primitive.find("mode");
    if (!mode || mode->count() != 0) primitive.fail(Defect::Schema, "splats must be points");
    const bool is_linear = note_look(extension);
    const Eigen::Matrix3d linear = file_from_mesh.linear();
    Attributes in = attributes_of(primitive);
    // The extension's text says lengths; files after its draft hold logarithms.
    const bool is_negative =
        std::any_of(in.scale.begin(), in.scale.end(), [](float s) { return s < 0; });
    if (is_negative) {
      for (float& s : in.scale) s = std::exp(s);
      has_logarithms_ = true;
    }
    if (!in.provenance.empty()) {
      leave_unlabelled(splats_.size());
      splats_.provenance.insert(
          splats_.provenance.end(), in.provenance.begin(), in.provenance.end());
    }
    if (!in.synthetic.empty()) {
      splats_.synthetic.resize(splats_.size(), 0);
      splats_.synthetic.insert(splats_.synthetic.end(), in.synthetic.begin(), in.synthetic.end());
    }
    const SplatTurn turn(linear);
    for (size_t i = 0; i < in.count; ++i) {
      const Eigen::Vector3d p = in.three(in.position, i);
      if (p.allFinite()) stored_.extend(linear * p);
      splats_.position.push_back(file_from_mesh * p);
      append_shape(in, i, turn);
      append_harmonics(in, i, turn, is_linear);
    }
  }

  /// Splats up to there that no primitive gave a label.
  void leave_unlabelled(size_t end) {
    splats_.provenance.resize(end, std::numeric_limits<float>::quiet_NaN());
  }

  void append_shape(const Attributes& in, size_t i, const SplatTurn& turn) {
    Eigen::Vector3d scale = in.three(in.scale, i);
    const float* q = in.rotation.data() + 4 * i;
    Eigen::Vector4f rotation(q[3], q[0], q[1], q[2]);
    turn.apply(scale, rotation);
    splats_.log_scale.emplace_back(scale.array().log().matrix().cast<float>());
    splats_.rotation.push_back(rotation);
    double opacity = in.opacity[i];
    // As in a byte, the ends stand for what rounds to them.
    if (in.opacity_step > 0) {
      opacity = std::clamp(opacity, 0.25 * in.opacity_step, 1 - 0.25 * in.opacity_step);
    }
    splats_.logit.push_back(static_cast<float>(std::log(opacity) - std::log1p(-opacity)));
  }

  void append_harmonics(const Attributes& in, size_t i, const SplatTurn& turn, bool is_linear) {
    const size_t begin = splats_.sh.size();
    splats_.sh.resize(begin + splats_.sh_count(), Eigen::Vector3f::Zero());
    const std::span<Eigen::Vector3f> out = std::span(splats_.sh).subspan(begin);
    for (size_t k = 0; k < in.harmonics.size(); ++k) {
      out[k] = in.three(in.harmonics[k], i).cast<float>();
    }
    if (is_linear) srgb_from_linear_harmonics(out);
    turn.apply(out);
  }

  const GlbContainer& file_;
  GlbOrigin origin_;
  Eigen::Affine3d file_from_gltf_ = Eigen::Affine3d::Identity();
  RawSplats splats_;
  Eigen::AlignedBox3d stored_;  // of the positions as they were rounded to float
  size_t others_ = 0;           // primitives
  bool has_unknown_ = false;    // kernel or colour space
  bool is_linear_ = false;
  bool has_draft_axes_ = false;
  bool has_logarithms_ = false;
};

}  // namespace

GlbSplatCount count_glb_splats(const std::filesystem::path& path) {
  const GlbContainer file(path);
  const ScenePrimitives found = scene_primitives(file, glb_scene(file).instances);
  const uint64_t side = static_cast<uint64_t>(found.sh_degree) + 1;
  return {found.splats, side * side, found.has_triangles};
}

bool is_splat_glb(const std::filesystem::path& path) {
  const GlbSplatCount found = count_glb_splats(path);
  return found.splats > 0 && !found.has_triangles;
}

RawSplats parse_splat_glb(std::string content, const std::filesystem::path& path) {
  const GlbContainer file(std::move(content), path);
  return SplatScene(file).read();
}

}  // namespace cgs
