// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/gltf.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "io/bytes/atomic_file.h"
#include "io/bytes/mesh_arrays.h"
#include "io/glb/meshopt.h"
#include "io/glb/place.h"
#include "io/glb/primitive.h"
#include "io/glb/quantized.h"
#include "io/glb/texture_images.h"
#include "io/meshes/draco_codec.h"
#include "io/meshes/glb_builder.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

nlohmann::json parsed_summary(const std::string& text) {
  nlohmann::json json = nlohmann::json::parse(text, nullptr, /*allow_exceptions=*/false);
  require(!json.is_discarded(), "GlbOptions.summary_json must be JSON", text.substr(0, 40));
  return json;
}

/// Corners of the box around the vertices that faces use.
std::pair<Eigen::Vector3f, Eigen::Vector3f> bounds(const TriangleMesh& mesh) {
  Eigen::Vector3f low = mesh.vertices[mesh.faces.front()[0]];
  Eigen::Vector3f high = low;
  for (const auto& face : mesh.faces) {
    for (const uint32_t corner : face) {
      low = low.cwiseMin(mesh.vertices[corner]);
      high = high.cwiseMax(mesh.vertices[corner]);
    }
  }
  return {low, high};
}

/// Below it the encoder's quantisation of floats breaks down.
constexpr float kSmallestDracoExtent = 1e-6f;

Eigen::AlignedBox3f box_of(const std::vector<GlbPrimitive>& primitives) {
  Eigen::AlignedBox3f box;
  for (const GlbPrimitive& primitive : primitives) {
    for (const Eigen::Vector3f& p : primitive.positions) box.extend(p);
  }
  return box;
}

float extent_of(const std::vector<GlbPrimitive>& primitives) {
  return box_of(primitives).sizes().maxCoeff();
}

/// The nearest number at or below (above) that survives the encoder, which passes the grid on as
/// decimals of six places: on any other grid it would not round positions as we expect it to.
float decimal_below(float value) {
  constexpr float kPlace = 1e-6f;
  const auto stored = [](float v) { return std::stof(std::to_string(v)); };
  const float nearest = stored(value);
  return nearest <= value ? nearest : stored(nearest - kPlace);
}
float decimal_above(float value) { return -decimal_below(-value); }

double error_or_default(double max_error, double extent) {
  return max_error > 0 ? max_error : std::ldexp(extent, -14);
}

/// The cube that holds every position, and as few bits as keep the error.
DracoGrid grid_for(const std::vector<GlbPrimitive>& primitives, double max_error) {
  const Eigen::AlignedBox3f box = box_of(primitives);
  const Eigen::Vector3f origin = box.min().unaryExpr(&decimal_below);
  DracoGrid grid{origin, decimal_above((box.max() - origin).maxCoeff()), 1};
  const double half_diagonal = std::sqrt(3.0) / 2;  // of a cell: the farthest a vertex can move
  const double wanted = error_or_default(max_error, double{grid.range});
  while (grid.bits < kMaxDracoBits && grid.step() * half_diagonal > wanted) ++grid.bits;
  require(grid.step() * half_diagonal <= wanted,
          "GlbOptions.max_error must be above extent / 2^21",
          max_error);
  return grid;
}

nlohmann::json extras_for(const TriangleMesh& mesh,
                          const Frame& frame,
                          const GlbPlacement& placement,
                          const GlbOptions& options) {
  nlohmann::json out = glb_place_to_json({options.y_up, options.local_origin}, frame);
  if (!mesh.provenance.empty()) {
    const auto area = area_by_provenance(mesh);
    for (const Provenance label : kProvenanceOrder) {
      out["area"][std::string(provenance_name(label))] =
          area.at(static_cast<size_t>(label)) * placement.scale * placement.scale;
    }
    for (size_t id = 0; id < kProvenanceCount; ++id) {
      out["provenance_names"].push_back(provenance_name(static_cast<Provenance>(id)));
    }
  }
  if (!options.summary_json.empty()) out["summary"] = parsed_summary(options.summary_json);
  return out;
}

GlbPlacement placement_for(const TriangleMesh& mesh,
                           const Frame& frame,
                           const GlbOptions& options) {
  const auto [low, high] = bounds(mesh);
  GlbPlacement out;
  out.rotation = options.y_up;
  out.scale = GlbPlace::unit(frame);
  out.center = options.center.value_or(0.5 * (low.cast<double>() + high.cast<double>()));
  const double reach = out.scale * std::max((high.cast<double>() - out.center).norm(),
                                            (low.cast<double>() - out.center).norm());
  require(reach > 1 / kFarthestInGlb && reach < kFarthestInGlb,
          "write_glb: the mesh must have an extent between 1e-18 and 1e18",
          reach);
  return out;
}

/// What Draco leaves out, too.
constexpr QuantizedRounding kPackedRounding = {kDracoColorBits, kDracoTextureError};

bool is_compressed(GlbEncoding encoding) {
  return encoding == GlbEncoding::Draco || encoding == GlbEncoding::Meshopt;
}

/// How the primitives of a file are stored, on which grid.
struct GlbStore {
  GlbEncoding encoding = GlbEncoding::Plain;
  DracoGrid draco;
  QuantizedGrid whole;
  int speed = 0;

  int position_bits() const {
    if (encoding == GlbEncoding::Plain) return 0;
    return encoding == GlbEncoding::Draco ? draco.bits : whole.bits;
  }
};

GlbStore store_for(const std::vector<GlbPrimitive>& primitives,
                   const GlbOptions& options,
                   double max_error) {
  GlbStore out;
  out.encoding = options.encoding;
  const bool is_too_small = extent_of(primitives) < kSmallestDracoExtent;
  if (out.encoding == GlbEncoding::Draco && is_too_small) out.encoding = GlbEncoding::Plain;
  if (out.encoding == GlbEncoding::Draco) out.draco = grid_for(primitives, max_error);
  const Eigen::AlignedBox3f box = box_of(primitives);
  out.whole = QuantizedGrid::around(box);
  if (out.encoding == GlbEncoding::Meshopt) {
    out.whole = QuantizedGrid::within(error_or_default(max_error, box.sizes().maxCoeff()), box);
  }
  out.speed = options.speed;
  return out;
}

/// \return the largest move of a vertex [units of the file]
double add_primitive(GlbBuilder& builder,
                     const GlbPrimitive& primitive,
                     const GlbStore& store,
                     GlbReport& report) {
  report.triangles += primitive.faces.size();
  if (!primitive.texcoords.empty()) report.textured_triangles += primitive.faces.size();
  double error = 0;
  double texture_error = 0;
  size_t vertices = primitive.positions.size();
  if (store.encoding == GlbEncoding::Draco) {
    const DracoPrimitive compressed = draco_compress(primitive, store.draco, store.speed);
    builder.add_compressed(primitive, compressed);
    vertices = compressed.vertices;
    error = compressed.max_error;
    texture_error = compressed.max_texture_error;
    report.collapsed_triangles += compressed.collapsed_faces;
  } else if (store.encoding == GlbEncoding::Plain) {
    builder.add_plain(primitive);
  } else {
    const bool packed = store.encoding == GlbEncoding::Meshopt;
    const QuantizedPrimitive stored =
        quantized(primitive, store.whole, packed ? kPackedRounding : QuantizedRounding{});
    builder.add_quantized(primitive, stored, store.whole);
    error = stored.max_error;
    texture_error = stored.max_texture_error;
    report.collapsed_triangles += stored.collapsed_faces;
  }
  report.vertices += vertices;
  report.measured_texture_error = std::max(report.measured_texture_error, texture_error);
  return error;
}

}  // namespace

std::map<std::string, GlbEncoding> glb_encodings() {
  return {{"draco", GlbEncoding::Draco},
          {"meshopt", GlbEncoding::Meshopt},
          {"quantized", GlbEncoding::Quantized},
          {"plain", GlbEncoding::Plain}};
}

void GlbOptions::validate() const {
  require(
      max_error >= 0 && std::isfinite(max_error), "GlbOptions.max_error must be >= 0", max_error);
  require(speed >= 0 && speed <= 10, "GlbOptions.speed must be 0 to 10", speed);
  const double off = (y_up * y_up.transpose() - Eigen::Matrix3d::Identity()).norm();
  require(off < 1e-6 && y_up.determinant() > 0, "GlbOptions.y_up must be a rotation; error", off);
  require(jpeg_quality >= 1 && jpeg_quality <= 100,
          "GlbOptions.jpeg_quality must be 1 to 100",
          jpeg_quality);
  if (!summary_json.empty()) (void)parsed_summary(summary_json);
}

GlbReport write_glb(const std::filesystem::path& path,
                    const TriangleMesh& mesh,
                    const Frame& frame,
                    const GlbOptions& options) {
  return write_glb(path, mesh, PhotoTexture{}, frame, options);
}

GlbReport write_glb(const std::filesystem::path& path,
                    const TriangleMesh& mesh,
                    const PhotoTexture& texture,
                    const Frame& frame,
                    const GlbOptions& options) {
  const GlbFile file = make_glb(mesh, texture, frame, options);
  write_file(path, file.bytes);
  return file.report;
}

GlbFile make_glb(const TriangleMesh& mesh,
                 const PhotoTexture& texture,
                 const Frame& frame,
                 const GlbOptions& options) {
  options.validate();
  require_writable(mesh, "write_glb");
  require_texture(mesh, texture, "write_glb");
  require(!mesh.faces.empty(), "write_glb: number of faces must be > 0", mesh.faces.size());
  const GlbPlacement placement = placement_for(mesh, frame, options);
  std::vector<TextureImage> images;
  if (!texture.empty()) images = texture_images(mesh, texture, options.jpeg_quality);
  std::vector<GlbPrimitive> primitives = glb_primitives(mesh, placement, texture, images);
  require(!primitives.empty(), "write_glb: faces with three different corners must be > 0", 0);
  const double world_scale = placement.scale / frame.scale;  // units of the file per world unit
  const double max_error = options.max_error * world_scale;
  GlbReport report;
  const GlbPlace place{options.y_up, options.local_origin};
  GlbBuilder builder(place.of(placement.center, frame));
  builder.set_extras(extras_for(mesh, frame, placement, options));
  builder.add_photographs(texture, images);
  for (const TextureImage& image : images) report.texture_bytes += image.jpeg.size();
  const GlbStore store = store_for(primitives, options, max_error);
  double worst = 0;
  for (GlbPrimitive& primitive : primitives) {
    if (is_compressed(store.encoding) && primitive.is_unlit) primitive.normals.clear();
    if (store.encoding == GlbEncoding::Meshopt) primitive = in_cache_order(std::move(primitive));
    worst = std::max(worst, add_primitive(builder, primitive, store, report));
  }
  if (report.collapsed_triangles == report.triangles) {
    throw NumericalError(
        "write_glb: rounded to the grid of the encoding, no triangle has an area left; plain "
        "encoding keeps them, or a smaller error where one was given");
  }
  // Half a rounding error of float coordinates is not the compression's.
  const double slack = 1e-6 * double{store.draco.range};
  if (max_error > 0 && worst > max_error + slack) {
    throw NumericalError("write_glb: compression moves a vertex by " +
                         std::to_string(worst / world_scale) + ", allowed are " +
                         std::to_string(options.max_error) +
                         "; another encoding or a larger error may do");
  }
  report.primitives = primitives.size();
  report.dropped_triangles = mesh.faces.size() - report.triangles;
  report.position_bits = store.position_bits();
  report.measured_max_error = worst / world_scale;
  std::string bytes = builder.bytes();
  if (store.encoding == GlbEncoding::Meshopt) bytes = meshopt_compressed(bytes);
  report.bytes = bytes.size();
  return {std::move(bytes), report};
}

}  // namespace cgs
