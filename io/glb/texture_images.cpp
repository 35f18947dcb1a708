// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/texture_images.h"

#include <algorithm>

#include <tbb/parallel_for.h>

#include "io/images/png.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr int kBlock = 16;   // [pixels]; a multiple of JPEG's 8, so that fills stay in their blocks
constexpr int kPadding = 8;  // [pixels]

/// Which blocks of a photograph faces use.
class UsedBlocks {
 public:
  explicit UsedBlocks(const Camera& camera)
      : limit_(camera.width, camera.height),
        used_((camera.width - 1) / kBlock + 1, (camera.height - 1) / kBlock + 1, 0) {}

  void add(const Eigen::AlignedBox2d& box) {
    const Eigen::Vector2i low = block_of(box.min().array() - double{kPadding});
    const Eigen::Vector2i high = block_of(box.max().array() + double{kPadding});
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) used_(x, y) = 1;
    }
    bounds_.extend(low);
    bounds_.extend(high);
  }

  bool empty() const { return bounds_.isEmpty(); }
  Eigen::Vector2i corner() const { return bounds_.min() * kBlock; }
  Eigen::Vector2i size() const {
    const Eigen::Vector2i end = (bounds_.max().array() + 1) * kBlock;
    return end.cwiseMin(limit_) - corner();
  }
  bool operator()(int x, int y) const { return used_(x / kBlock, y / kBlock) != 0; }

 private:
  Eigen::Vector2i block_of(const Eigen::Array2d& pixel) const {
    const Eigen::Array2d block = (pixel / double{kBlock}).floor();
    return block.max(0.0)
        .min(Eigen::Array2d(used_.width - 1, used_.height - 1))
        .matrix()
        .cast<int>();
  }

  Eigen::Vector2i limit_;
  MaskMap used_;
  Eigen::AlignedBox2i bounds_;
};

TextureImage encoded(const ColorImage& photograph, const UsedBlocks& used, int quality) {
  TextureImage out;
  if (used.empty()) return out;
  out.corner = used.corner();
  out.size = used.size();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (int y = 0; y < out.size.y(); ++y) {
    for (int x = 0; x < out.size.x(); ++x) {
      const Eigen::Vector2i p = out.corner + Eigen::Vector2i(x, y);
      if (!used(p.x(), p.y())) continue;
      sum += photograph(p.x(), p.y()).cast<double>();
      ++count;
    }
  }
  ColorImage image(out.size.x(), out.size.y(), (sum / count).cast<float>());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const Eigen::Vector2i p = out.corner + Eigen::Vector2i(x, y);
      if (used(p.x(), p.y())) image(x, y) = photograph(p.x(), p.y());
    }
  }
  out.jpeg = encode_jpeg(image, quality);
  return out;
}

/// A picture of all photographs; between them is their mean colour.
std::string encoded_atlas(const PhotoTexture& texture, int quality) {
  const TextureAtlas& atlas = *texture.atlas;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  size_t count = 0;
  for (const Photograph& photograph : texture.photographs) {
    for (const Eigen::Vector3f& color : photograph.image.data) sum += color.cast<double>();
    count += photograph.image.data.size();
  }
  const Eigen::Vector3d mean = sum / double(std::max(count, size_t(1)));
  ColorImage picture(atlas.size.x(), atlas.size.y(), mean.cast<float>());
  for (size_t i = 0; i < texture.photographs.size(); ++i) {
    const ColorImage& image = texture.photographs[i].image;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) {
        picture(atlas.corner[i].x() + x, atlas.corner[i].y() + y) = image(x, y);
      }
    }
  }
  return encode_jpeg(picture, quality);
}

std::vector<TextureImage> atlas_images(const PhotoTexture& texture, int quality) {
  std::vector<TextureImage> out;
  for (const Eigen::Vector2i& corner : texture.atlas->corner) {
    out.push_back({{}, 0, -corner, texture.atlas->size});
  }
  if (!out.empty()) out[0].jpeg = encoded_atlas(texture, quality);
  return out;
}

void require_atlas(const PhotoTexture& texture, const std::string& prefix) {
  const TextureAtlas& atlas = *texture.atlas;
  require(atlas.corner.size() == texture.photographs.size(),
          prefix + "atlas.corner must be " + std::to_string(texture.photographs.size()) + " long",
          atlas.corner.size());
  for (size_t i = 0; i < atlas.corner.size(); ++i) {
    const Camera& camera = texture.photographs[i].camera;
    const Eigen::Vector2i end = atlas.corner[i] + Eigen::Vector2i(camera.width, camera.height);
    require(atlas.corner[i].minCoeff() >= 0 && (atlas.size - end).minCoeff() >= 0,
            prefix + "atlas must hold all of every photograph",
            texture.photographs[i].name);
  }
}

}  // namespace

std::vector<TextureImage> texture_images(const TriangleMesh& mesh,
                                         const PhotoTexture& texture,
                                         int quality) {
  if (texture.atlas) return atlas_images(texture, quality);
  std::vector<TextureImage> out(texture.photographs.size());
  tbb::parallel_for(size_t(0), out.size(), [&](size_t i) {
    const Camera& camera = texture.photographs[i].camera;
    UsedBlocks used(camera);
    for (size_t f = 0; f < mesh.faces.size(); ++f) {
      if (texture.of_face[f] != static_cast<int>(i)) continue;
      Eigen::AlignedBox2d box;
      for (const uint32_t v : mesh.faces[f]) {
        box.extend(camera.project(mesh.vertices[v].cast<double>()).head<2>());
      }
      used.add(box);
    }
    out[i] = encoded(texture.photographs[i].image, used, quality);
    out[i].image = static_cast<int>(i);
  });
  return out;
}

std::vector<std::string> texture_names(const PhotoTexture& texture) {
  std::vector<std::string> out;
  for (const Photograph& photograph : texture.photographs) {
    out.push_back(texture.atlas ? "atlas" : photograph.name);
  }
  return out;
}

void require_texture(const TriangleMesh& mesh,
                     const PhotoTexture& texture,
                     std::string_view writer) {
  if (texture.empty()) return;
  const std::string prefix = std::string(writer) + ": PhotoTexture.";
  require(texture.of_face.size() == mesh.faces.size(),
          prefix + "of_face must be empty or " + std::to_string(mesh.faces.size()) + " long",
          texture.of_face.size());
  for (const Photograph& photograph : texture.photographs) {
    require(photograph.image.width == photograph.camera.width &&
                photograph.image.height == photograph.camera.height && !photograph.image.empty(),
            prefix + "photographs must be as large as their cameras",
            photograph.name);
  }
  if (texture.atlas) require_atlas(texture, prefix);
  const int count = static_cast<int>(texture.photographs.size());
  for (size_t f = 0; f < mesh.faces.size(); ++f) {
    const int i = texture.of_face[f];
    require(i >= PhotoTexture::kNone && i < count,
            prefix + "of_face must be below " + std::to_string(count),
            i);
    if (i == PhotoTexture::kNone) continue;
    const Photograph& photograph = texture.photographs[static_cast<size_t>(i)];
    for (const uint32_t v : mesh.faces[f]) {
      require(photograph.camera.sees(photograph.camera.project(mesh.vertices[v].cast<double>())),
              prefix + "of_face must name a photograph that holds the whole face",
              f);
    }
  }
}

}  // namespace cgs
