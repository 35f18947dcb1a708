// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/glb_colors.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "io/glb/extensions.h"
#include "io/images/image.h"
#include "libcgs/core/error.h"
#include "libcgs/core/srgb.h"

namespace cgs {

namespace {

constexpr int kRepeat = 10497;
constexpr int kClamp = 33071;
constexpr int kMirror = 33648;

/// Number of a pixel beyond the border of a texture.
int wrapped(int64_t at, int size, int wrap) {
  if (wrap == kClamp) return static_cast<int>(std::clamp<int64_t>(at, 0, size - 1));
  const int64_t period = wrap == kMirror ? int64_t{2} * size : size;
  const int64_t within = ((at % period) + period) % period;
  return static_cast<int>(within < size ? within : period - 1 - within);
}

/// Bilinear, in linear light. (0, 0) is the corner of the first pixel.
Eigen::Vector3f sampled(const ColorImage& image,
                        const std::array<double, 2>& uv,
                        const std::array<int, 2>& wrap) {
  constexpr double kFarthest = 1e6;     // repetitions
  const auto bounded = [&](double t) {  // large numbers transform to none
    return std::isfinite(t) ? std::clamp(t, -kFarthest, kFarthest) : 0;
  };
  const double x = bounded(uv[0]) * image.width - 0.5;
  const double y = bounded(uv[1]) * image.height - 0.5;
  const auto left = static_cast<int64_t>(std::floor(x));
  const auto top = static_cast<int64_t>(std::floor(y));
  Eigen::Vector3f out = Eigen::Vector3f::Zero();
  for (const int dy : {0, 1}) {
    for (const int dx : {0, 1}) {
      const double across = dx == 0 ? 1 - (x - double(left)) : x - double(left);
      const double down = dy == 0 ? 1 - (y - double(top)) : y - double(top);
      const Eigen::Vector3f& coded =
          image(wrapped(left + dx, image.width, wrap[0]), wrapped(top + dy, image.height, wrap[1]));
      for (int c = 0; c < 3; ++c) {
        out[c] += static_cast<float>(across * down) * linear_from_srgb(coded[c]);
      }
    }
  }
  return out;
}

}  // namespace

GlbColors::Base GlbColors::base(const JsonValue& primitive) const {
  const auto index = primitive.find("material");
  if (!index) return {};
  const JsonValue material = file_.element("materials", *index);
  // Comes first: what stands beside it is for programs that do not know it.
  const auto diffuse = extension_of(material, "KHR_materials_pbrSpecularGlossiness");
  const auto stated = diffuse ? diffuse : material.find("pbrMetallicRoughness");
  if (!stated) return {};
  return {numbers_or(*stated, diffuse ? "diffuseFactor" : "baseColorFactor", {1, 1, 1, 1}),
          stated->find(diffuse ? "diffuseTexture" : "baseColorTexture")};
}

GlbColors::Texture GlbColors::texture(const JsonValue& info) const {
  Texture out;
  const JsonValue texture = file_.element("textures", info.at("index"));
  if (const auto set = info.find("texCoord")) out.texcoord_set = set->count();
  auto source = texture.find("source");
  for (const char* name : {"EXT_texture_webp", "EXT_texture_avif"}) {
    const auto other = extension_of(texture, name);
    if (other && other->find("source")) source = other->find("source");
  }
  out.wrap = {kRepeat, kRepeat};
  if (const auto index = texture.find("sampler")) {
    const JsonValue sampler = file_.element("samplers", *index);
    if (const auto s = sampler.find("wrapS")) out.wrap[0] = s->count();
    if (const auto t = sampler.find("wrapT")) out.wrap[1] = t->count();
  }
  if (source) out.image = source->count();
  const auto transform = extension_of(info, "KHR_texture_transform");
  if (!transform) return out;
  out.offset = numbers_or(*transform, "offset", {0, 0});
  out.scale = numbers_or(*transform, "scale", {1, 1});
  if (const auto set = transform->find("texCoord")) out.texcoord_set = set->count();
  if (const auto rotation = transform->find("rotation")) out.rotation = rotation->number();
  return out;
}

// Counter-clockwise where v points down, as the text of the extension, its sample and all that read
// it have it; the matrix in its listing turns the other way.
std::array<double, 2> GlbColors::Texture::place(double u, double v) const {
  const double x = scale[0] * u;
  const double y = scale[1] * v;
  const double c = std::cos(rotation);
  const double s = std::sin(rotation);
  return {offset[0] + c * x + s * y, offset[1] - s * x + c * y};
}

int GlbColors::texcoord_set(const JsonValue& primitive) const {
  const auto info = base(primitive).texture;
  return info ? texture(*info).texcoord_set : -1;
}

void GlbColors::warn(const std::string& line) {
  if (std::find(warnings_.begin(), warnings_.end(), line) == warnings_.end()) {
    warnings_.push_back(line);
  }
}

const ColorImage* GlbColors::image(int index) {
  const auto known = images_.find(index);
  if (known != images_.end()) return known->second.empty() ? nullptr : &known->second;
  ColorImage& out = images_[index];
  if (index < 0) {
    warn("a texture is left out: it is packed for graphics cards");
    return nullptr;
  }
  const JsonValue images = file_.root().at("images");
  if (static_cast<size_t>(index) >= images.size()) images.fail(Defect::Ref, "has no such image");
  const auto leave_out = [&](const Error& error) {
    warn("texture " + std::to_string(index) + " is left out: " + error.what());
    return nullptr;
  };
  try {
    out = decode_image(file_.image_bytes(images.at(static_cast<size_t>(index))), file_.path());
  } catch (const BadInput& error) {
    return leave_out(error);
  } catch (const LimitError& error) {
    return leave_out(error);
  }
  return &out;
}

// Colours of vertices are those of opaque surface under white light.
void GlbColors::warn_of_material(const JsonValue& primitive) {
  const auto index = primitive.find("material");
  if (!index || has_tints_) return;
  const JsonValue material = file_.element("materials", *index);
  const auto alpha = material.find("alphaMode");
  if (alpha && alpha->text() != "OPAQUE") {
    warn("surface that is transparent, in part or as a whole, is read as opaque");
  }
  if (numbers_or(material, "emissiveFactor", {0, 0, 0}) != std::vector<double>{0, 0, 0}) {
    warn("light that surfaces give off is left out of their colours");
  }
}

std::vector<float> GlbColors::of_vertices(const JsonValue& primitive, const GlbFaces& faces) {
  std::vector<float> out = faces.colors;
  warn_of_material(primitive);
  const auto [factor, info] = base(primitive);
  const size_t vertices = faces.positions.size() / 3;
  const bool is_white = factor[0] == 1 && factor[1] == 1 && factor[2] == 1;
  const bool is_colored = !has_tints_ && !is_white;
  const Texture looked_up = info ? texture(*info) : Texture();
  const ColorImage* picture = info && !faces.texcoords.empty() ? image(looked_up.image) : nullptr;
  if (!is_colored && picture == nullptr) return out;
  has_textures_ = has_textures_ || picture != nullptr;
  if (out.empty()) out.assign(3 * vertices, 1.0f);
  for (size_t v = 0; v < vertices; ++v) {
    Eigen::Vector3f times = Eigen::Vector3f::Ones();
    if (picture != nullptr) {
      const auto stored = [&](size_t k) {
        const double coordinate = faces.texcoords[2 * v + k];
        return std::isfinite(coordinate) ? coordinate : 0;
      };
      times = sampled(*picture, looked_up.place(stored(0), stored(1)), looked_up.wrap);
    }
    for (size_t c = 0; c < 3; ++c) {
      if (is_colored) times[static_cast<Eigen::Index>(c)] *= static_cast<float>(factor.at(c));
      out[3 * v + c] *= times[static_cast<Eigen::Index>(c)];
    }
  }
  return out;
}

}  // namespace cgs
