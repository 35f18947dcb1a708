// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/splats/splat_glb.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "io/bytes/atomic_file.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/json_file.h"
#include "io/glb/bytes.h"
#include "io/glb/place.h"
#include "io/glb/scene.h"
#include "io/splats/splat_arrays.h"
#include "libcgs/core/error.h"
#include "libcgs/core/order_statistics.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

using Json = nlohmann::ordered_json;

constexpr int kFloat = 5126;  // glTF's number of the component type
constexpr int kArrayBuffer = 34962;

Eigen::Vector3f median_position(const Gaussians& g) {
  Eigen::Vector3f out = Eigen::Vector3f::Zero();
  std::vector<float> values(g.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(g.position.begin(), g.position.end(), values.begin(), [&](const auto& p) {
      return p[axis];
    });
    out[axis] = median(values);
  }
  return out;
}

/// Attributes one after the other in one buffer, each with its view and accessor.
class SplatBuffer {
 public:
  explicit SplatBuffer(size_t count) : count_(count) {}

  /// \param value  the floats of splat i
  template <typename Value>
  void add(const std::string& attribute, const char* type, const Value& value) {
    const size_t begin = bytes_.size();
    for (size_t i = 0; i < count_; ++i) {
      for (const float c : value(i)) append_bytes(bytes_, c);
    }
    attributes_[attribute] = accessors_.size();
    views_.push_back({{"buffer", 0},
                      {"byteOffset", begin},
                      {"byteLength", bytes_.size() - begin},
                      {"target", kArrayBuffer}});
    accessors_.push_back({{"bufferView", views_.size() - 1},
                          {"componentType", kFloat},
                          {"count", count_},
                          {"type", type}});
  }

  void set_bounds_of_last(const Eigen::AlignedBox3f& box) {
    const auto corner = [](const Eigen::Vector3f& p) { return Json{p.x(), p.y(), p.z()}; };
    accessors_.back()["min"] = corner(box.min());
    accessors_.back()["max"] = corner(box.max());
  }

  Json document() const {
    const Json primitive = {
        {"mode", 0},
        {"attributes", attributes_},
        {"extensions",
         {{kGaussianSplatting, {{"kernel", "ellipse"}, {"colorSpace", "srgb_rec709_display"}}}}}};
    return {{"asset", {{"version", "2.0"}, {"generator", "cgs"}}},
            {"extensionsUsed", {kGaussianSplatting}},
            {"scene", 0},
            {"scenes", {{{"nodes", {0}}}}},
            {"nodes", {{{"name", "splats"}, {"mesh", 0}}}},
            {"meshes", {{{"primitives", {primitive}}}}},
            {"buffers", {{{"byteLength", bytes_.size()}}}},
            {"bufferViews", views_},
            {"accessors", accessors_}};
  }

  std::string take_bytes() { return std::move(bytes_); }

 private:
  size_t count_;
  std::string bytes_;
  Json views_ = Json::array();
  Json accessors_ = Json::array();
  Json attributes_ = Json::object();
};

void add_harmonics(SplatBuffer& buffer, const Gaussians& g) {
  const auto count = static_cast<size_t>(g.sh_count());
  for (int degree = 0, k = 0; degree <= g.sh_degree; ++degree) {
    for (int order = 0; order <= 2 * degree; ++order, ++k) {
      buffer.add(splat_harmonic_name(degree, order), "VEC3", [&](size_t i) {
        return g.sh[i * count + static_cast<size_t>(k)];
      });
    }
  }
}

/// As floats, like all else: whole numbers of one or two bytes would be padded to four.
void add_provenance(SplatBuffer& buffer, const Gaussians& g) {
  if (!g.provenance.empty()) {
    buffer.add(kSplatProvenance, "SCALAR", [&](size_t i) {
      return std::array{static_cast<float>(g.provenance[i])};
    });
  }
  if (g.synthetic.empty()) return;
  buffer.add(kSplatSynthetic, "SCALAR", [&](size_t i) {
    return std::array{static_cast<float>(g.synthetic[i])};
  });
}

Json sources_json(const std::vector<SyntheticSource>& sources) {
  Json out = Json::array();
  for (const auto& [file, sha256] : sources) out.push_back({{"file", file}, {"sha256", sha256}});
  return out;
}

std::string named(const char* what) { return std::string(kGaussianSplatting) + ":" + what; }

/// Colours for readers that only know points, rotations and opacities.
void add_looks(SplatBuffer& buffer, const Gaussians& g) {
  buffer.add("COLOR_0", "VEC4", [&](size_t i) {
    const Eigen::Vector3f& dc = g.sh[i * static_cast<size_t>(g.sh_count())];
    Eigen::Vector4f out = Eigen::Vector4f::Constant(g.opacity[i]);
    for (int k = 0; k < 3; ++k) {
      out[k] = linear_from_srgb(std::clamp(kShC0 * dc[k] + 0.5f, 0.0f, 1.0f));
    }
    return out;
  });
  buffer.add(named("ROTATION"), "VEC4", [&](size_t i) {
    const Eigen::Vector4f q = g.rotation[i].normalized();
    return Eigen::Vector4f(q[1], q[2], q[3], q[0]);
  });
  buffer.add(named("OPACITY"), "SCALAR", [&](size_t i) { return std::array{g.opacity[i]}; });
}

}  // namespace

std::string splat_harmonic_name(int degree, int order) {
  return std::string(kGaussianSplatting) + ":SH_DEGREE_" + std::to_string(degree) + "_COEF_" +
         std::to_string(order);
}

void SplatGlbOptions::validate() const {
  require_rotation(y_up, "SplatGlbOptions.y_up must be a rotation; error");
}

size_t write_splat_glb(const std::filesystem::path& path,
                       const Gaussians& g,
                       const Frame& frame,
                       const SplatGlbOptions& options) {
  options.validate();
  require_writable(g);
  require(g.size() > 0, "write_splat_glb: number of splats must be > 0", 0);
  const double unit = GlbPlace::unit(frame);
  const Eigen::Vector3f center = median_position(g);
  const auto placed = [&](size_t i) {
    return Eigen::Vector3f((unit * (g.position[i] - center).cast<double>()).cast<float>());
  };
  const auto length = [&](size_t i) {
    return Eigen::Vector3f((unit * g.scale[i].cast<double>()).cast<float>());
  };
  Eigen::AlignedBox3f box;
  for (size_t i = 0; i < g.size(); ++i) {
    box.extend(placed(i));
    require(placed(i).allFinite() && length(i).allFinite(),
            "write_splat_glb: splats must stay in the range of float; index",
            i);
  }
  constexpr size_t kRoomForJson = size_t{1} << 20;
  const size_t labels = (g.provenance.empty() ? 0U : 1U) + (g.synthetic.empty() ? 0U : 1U);
  const size_t floats = 15 + 3 * static_cast<size_t>(g.sh_count()) + labels;
  if (g.size() > (std::numeric_limits<uint32_t>::max() - kRoomForJson) / (4 * floats)) {
    throw LimitError("write_splat_glb: glTF binary files end at 4 GiB");
  }
  SplatBuffer buffer(g.size());
  buffer.add("POSITION", "VEC3", placed);
  buffer.set_bounds_of_last(box);
  add_looks(buffer, g);
  buffer.add(named("SCALE"), "VEC3", length);
  add_harmonics(buffer, g);
  add_provenance(buffer, g);
  Json document = buffer.document();
  const auto vector = [](const Eigen::Vector3d& v) { return Json{v.x(), v.y(), v.z()}; };
  const GlbPlace place{options.y_up, options.local_origin};
  const Eigen::Quaterniond turn(options.y_up);
  Json& node = document["nodes"][0];
  node["translation"] = vector(place.of(center.cast<double>(), frame));
  node["rotation"] = {turn.x(), turn.y(), turn.z(), turn.w()};
  Json& extras = document["asset"]["extras"];
  extras = glb_place_to_json(place, frame);
  extras["file_origin"] = vector(frame.file_origin);
  if (!options.evidence.empty()) extras["evidence"] = options.evidence;
  if (!g.synthetic.empty()) extras["synthetic_sources"] = sources_json(g.synthetic_sources);
  const std::string out = glb_bytes(json_text(document, -1), buffer.take_bytes());
  write_file(path, out);
  return out.size();
}

}  // namespace cgs
