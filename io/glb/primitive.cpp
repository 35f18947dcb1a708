// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/primitive.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "io/bytes/mesh_arrays.h"
#include "libcgs/core/crease_normals.h"
#include "libcgs/core/srgb.h"
#include "libcgs/core/texture_corners.h"

namespace cgs {

namespace {

/// What says something of where the surface is: NaN does not, nor what exceeds all coordinates.
bool is_known_sigma(double sigma) { return sigma >= 0 && sigma <= kFarthestInGlb; }

/// glTF forbids NaN: no statement becomes a negative number, smaller than the others so that it
/// hardly coarsens a quantisation of them.
float unknown_sigma(const TriangleMesh& mesh, double scale) {
  constexpr double kShare = 1.0 / 8;
  double largest = 0;
  for (const float s : mesh.sigma) {
    if (is_known_sigma(s * scale)) largest = std::max(largest, s * scale);
  }
  return largest > 0 ? -static_cast<float>(kShare * largest) : -1.0f;
}

/// A number of views, as every encoding can hold it: Draco's encoder crashes beyond its grid.
float stored_support(float support) {
  constexpr float kMost = 65535;
  return support > 0 ? std::min(support, kMost) : 0.0f;  // NaN is none
}

/// Splats hold the light of the scene, as photographs do. Also where no photograph fits: beside
/// photographs, lit surface would look like another. What they do not vouch for is tinted and lit.
bool is_unlit(std::optional<Provenance> label, bool textured) {
  if (label && !was_seen(*label) && label != Provenance::Virtual) return false;
  return textured || label == Provenance::Virtual;
}

ShadingVertices with_normals_of(const TriangleMesh& mesh) {
  std::vector<uint32_t> vertices(mesh.vertices.size());
  std::iota(vertices.begin(), vertices.end(), 0U);
  return {vertices, mesh.normals, mesh.faces};
}

class Splitter {
 public:
  Splitter(const TriangleMesh& mesh,
           const GlbPlacement& placement,
           const PhotoTexture& texture,
           std::span<const TextureImage> images)
      : mesh_(mesh),
        placement_(placement),
        texture_(texture),
        images_(images),
        unknown_sigma_(unknown_sigma(mesh, placement.scale)) {
    positions_.reserve(mesh.vertices.size());
    for (const Eigen::Vector3f& v : mesh.vertices) positions_.push_back(placement(v));
    shading_ = mesh.normals.empty() ? split_at_creases(mesh) : with_normals_of(mesh);
  }

  /// Faces of a class (all without labels) and an image.
  GlbPrimitive part(std::optional<Provenance> label, int image) const {
    GlbPrimitive out;
    out.name = label ? provenance_name(*label) : "surface";
    out.image = image;
    out.is_unlit = is_unlit(label, !texture_.empty());
    if (image != PhotoTexture::kNone) out.texture_size = images_[static_cast<size_t>(image)].size;
    std::vector<int> photographs;
    for (size_t f = 0; f < mesh_.faces.size(); ++f) {
      if (label && mesh_.provenance[f] != *label) continue;
      if (image_of(f) != image || !has_three_places(mesh_.faces[f])) continue;
      out.faces.push_back(shading_.faces[f]);
      photographs.push_back(image == PhotoTexture::kNone ? 0 : texture_.of_face[f]);
    }
    const TextureCorners corners(out.faces, photographs, shading_.vertex.size());
    for (size_t i = 0; i < corners.size(); ++i) {
      append_vertex(out, corners.vertex(i), static_cast<size_t>(corners.photograph(i)));
    }
    if (label) out.features.assign(out.positions.size(), static_cast<float>(*label));
    for (size_t f = 0; f < out.faces.size(); ++f) {
      for (uint32_t& corner : out.faces[f]) {
        corner = static_cast<uint32_t>(corners(corner, photographs[f]));
      }
    }
    return out;
  }

 private:
  int image_of(size_t face) const {
    const int photograph = texture_.empty() ? PhotoTexture::kNone : texture_.of_face[face];
    if (photograph == PhotoTexture::kNone) return photograph;
    return images_[static_cast<size_t>(photograph)].image;
  }

  bool has_three_places(const std::array<uint32_t, 3>& f) const {
    const Eigen::Vector3f& a = positions_[f[0]];
    const Eigen::Vector3f& b = positions_[f[1]];
    const Eigen::Vector3f& c = positions_[f[2]];
    return a != b && b != c && c != a;
  }

  void append_vertex(GlbPrimitive& out, uint32_t shaded, size_t photograph) const {
    const uint32_t v = shading_.vertex[shaded];
    out.positions.push_back(positions_[v]);
    const Eigen::Vector3d normal = placement_.rotation * shading_.normal[shaded].cast<double>();
    const bool known = normal.allFinite() && normal.norm() > 0;
    out.normals.push_back(known ? Eigen::Vector3f(normal.stableNormalized().cast<float>())
                                : Eigen::Vector3f::UnitY());
    if (out.image != PhotoTexture::kNone) {
      const Camera& camera = texture_.photographs[photograph].camera;
      const Eigen::Vector3d uvz = camera.project(mesh_.vertices[v].cast<double>());
      out.texcoords.push_back(images_[photograph].texcoord(uvz));
    } else if (!mesh_.colors.empty()) {
      Eigen::Vector3f color = Eigen::Vector3f::Zero();
      for (int c = 0; c < 3; ++c) {
        const float coded = mesh_.colors[v][c];
        if (coded > 0) color[c] = std::min(1.0f, linear_from_srgb(coded));  // NaN stays 0
      }
      out.colors.push_back(color);
    }
    if (!mesh_.support.empty()) {
      out.support.push_back(stored_support(mesh_.support[v]));
    }
    if (!mesh_.sigma.empty()) {
      const double sigma = mesh_.sigma[v] * placement_.scale;
      out.sigma.push_back(is_known_sigma(sigma) ? static_cast<float>(sigma) : unknown_sigma_);
    }
  }

  const TriangleMesh& mesh_;
  const GlbPlacement& placement_;
  const PhotoTexture& texture_;
  std::span<const TextureImage> images_;
  float unknown_sigma_;
  std::vector<Eigen::Vector3f> positions_;
  ShadingVertices shading_;
};

}  // namespace

std::vector<GlbPrimitive> glb_primitives(const TriangleMesh& mesh,
                                         const GlbPlacement& placement,
                                         const PhotoTexture& texture,
                                         std::span<const TextureImage> images) {
  const Splitter splitter(mesh, placement, texture, images);
  std::vector<std::optional<Provenance>> labels;
  if (mesh.provenance.empty()) {
    labels.emplace_back();
  } else {
    labels.assign(kProvenanceOrder.begin(), kProvenanceOrder.end());
  }
  std::vector<GlbPrimitive> out;
  for (const std::optional<Provenance> label : labels) {
    for (size_t i = 0; i < images.size(); ++i) {
      if (images[i].image != static_cast<int>(i)) continue;
      out.push_back(splitter.part(label, static_cast<int>(i)));
    }
    out.push_back(splitter.part(label, PhotoTexture::kNone));
  }
  std::erase_if(out, [](const GlbPrimitive& part) { return part.faces.empty(); });
  return out;
}

}  // namespace cgs
