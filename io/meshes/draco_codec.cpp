// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/draco_codec.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include <draco/compression/decode.h>
#include <draco/compression/expert_encode.h>
#include <draco/mesh/mesh.h>

#include "io/bytes/spare_color_bits.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

constexpr int kNormalBits = 10;
constexpr int kSigmaBits = 11;

[[noreturn]] void fail(const std::string& reason) {
  throw NumericalError("Draco compression: " + reason);
}

/// The mesh in the library's form, attributes one entry per vertex.
class DracoInput {
 public:
  explicit DracoInput(const GlbPrimitive& primitive) : size_(primitive.positions.size()) {
    mesh_.set_num_points(static_cast<uint32_t>(size_));
    for (const auto& f : primitive.faces) {
      mesh_.AddFace({draco::PointIndex(f[0]), draco::PointIndex(f[1]), draco::PointIndex(f[2])});
    }
  }

  int add(draco::GeometryAttribute::Type type, const std::vector<Eigen::Vector3f>& values) {
    return add(type, values.data()->data(), 3);
  }
  int add(draco::GeometryAttribute::Type type, const std::vector<Eigen::Vector2f>& values) {
    return add(type, values.data()->data(), 2);
  }
  int add(draco::GeometryAttribute::Type type, const std::vector<float>& values) {
    return add(type, values.data(), 1);
  }

  const draco::Mesh& mesh() const { return mesh_; }

 private:
  int add(draco::GeometryAttribute::Type type, const float* values, int8_t components) {
    const size_t stride = sizeof(float) * static_cast<size_t>(components);
    draco::GeometryAttribute attribute;
    attribute.Init(
        type, nullptr, components, draco::DT_FLOAT32, false, static_cast<int64_t>(stride), 0);
    const int id = mesh_.AddAttribute(attribute, true, static_cast<uint32_t>(size_));
    mesh_.attribute(id)->buffer()->Write(0, values, stride * size_);
    return id;
  }

  draco::Mesh mesh_;
  size_t size_;
};

void quantize(draco::ExpertEncoder& encoder, int id, int bits, float origin, float range) {
  const std::array<float, 3> origins = {origin, origin, origin};
  encoder.SetAttributeExplicitQuantization(id, bits, 1, origins.data(), range);
}

/// The smallest number of bits that holds every value as a whole number.
int whole_bits(const std::vector<float>& values) {
  const float largest = *std::max_element(values.begin(), values.end());
  int bits = 1;
  while (bits < 16 && static_cast<float>((1 << bits) - 1) < largest) ++bits;
  return bits;
}

/// Keeps whole numbers up to 65535 exactly.
void quantize_whole(draco::ExpertEncoder& encoder, int id, const std::vector<float>& values) {
  const int bits = whole_bits(values);
  quantize(encoder, id, bits, 0, static_cast<float>((1 << bits) - 1));
}

/// As few bits as keep the error of texture coordinates, which lie in [0, 1].
int texcoord_bits(const GlbPrimitive& primitive) {
  const double pixels = primitive.texture_size.maxCoeff();
  const double half_diagonal = std::sqrt(2.0) / 2;  // of a cell: the farthest a value can move
  int bits = 1;
  while (bits < kMaxDracoBits &&
         pixels / double((1 << bits) - 1) * half_diagonal > 0.95 * kDracoTextureError) {
    ++bits;
  }
  return bits;
}

/// What nine in ten of the known values are at least; 0 if none is.
float small_value(const std::vector<float>& sigma) {
  std::vector<float> known;
  for (const float value : sigma) {
    if (value > 0) known.push_back(value);
  }
  if (known.empty()) return 0;
  const auto tenth = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 10);
  std::nth_element(known.begin(), tenth, known.end());
  return *tenth;
}

/// Sigma on its grid. What is known stays above zero, where it would count as unknown: values
/// below a step become a step.
struct StoredSigma {
  std::vector<float> values;
  float low = 0;
  float range = 1;
  int bits = kSigmaBits;

  explicit StoredSigma(const std::vector<float>& sigma) : values(sigma) {
    if (values.empty()) return;
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    low = *least;
    if (*most > *least) range = *most - *least;
    // One place that is known badly must not make the steps of all others coarse.
    constexpr int kMostBits = 16;
    constexpr float kFine = 0.05f;  // of what most are larger than
    const auto step = [&] { return range / static_cast<float>((1 << bits) - 1); };
    while (bits < kMostBits && step() > kFine * small_value(sigma)) ++bits;
    const float largest = *most;  // never less than was known
    for (float& value : values) {
      if (!(value >= 0)) continue;
      const float steps = std::ceil((value - low) / step() - 1e-3f);
      value = std::min(largest, std::max(low + steps * step(), step()));
    }
  }
};

/// Colours with zeros where bits say nothing, which the encoder packs to nothing.
std::vector<Eigen::Vector3f> stored_colors(std::vector<Eigen::Vector3f> colors) {
  constexpr auto kMost = static_cast<float>((1 << kDracoColorBits) - 1);
  for (Eigen::Vector3f& color : colors) {
    for (float& c : color) {
      const auto place = static_cast<float>(1 << spare_color_bits(c, kDracoColorBits));
      c = std::min(1.0f, std::round(c * kMost / place) * place / kMost);
    }
  }
  return colors;
}

std::string encode(const GlbPrimitive& primitive,
                   const DracoGrid& grid,
                   int speed,
                   std::map<std::string, int>& ids) {
  using Attribute = draco::GeometryAttribute;
  DracoInput input(primitive);
  ids["POSITION"] = input.add(Attribute::POSITION, primitive.positions);
  if (!primitive.normals.empty()) {
    ids["NORMAL"] = input.add(Attribute::NORMAL, primitive.normals);
  }
  if (!primitive.texcoords.empty()) {
    ids["TEXCOORD_0"] = input.add(Attribute::TEX_COORD, primitive.texcoords);
  }
  if (!primitive.colors.empty()) {
    ids["COLOR_0"] = input.add(Attribute::COLOR, stored_colors(primitive.colors));
  }
  if (!primitive.support.empty())
    ids["_SUPPORT"] = input.add(Attribute::GENERIC, primitive.support);
  const StoredSigma sigma(primitive.sigma);
  if (!sigma.values.empty()) ids["_SIGMA"] = input.add(Attribute::GENERIC, sigma.values);
  if (!primitive.features.empty()) {
    ids["_FEATURE_ID_0"] = input.add(Attribute::GENERIC, primitive.features);
  }

  draco::ExpertEncoder encoder(input.mesh());
  // Slower ones gain 2 % at most by a prediction that crashes on some meshes (Draco 1.5.5).
  constexpr int kSlowest = 2;
  encoder.SetSpeedOptions(std::max(speed, kSlowest), std::max(speed, kSlowest));
  // Not left to the library: its sequential method cannot be decoded for large meshes before 1.5.7.
  encoder.SetEncodingMethod(draco::MESH_EDGEBREAKER_ENCODING);
  encoder.SetAttributeExplicitQuantization(
      ids["POSITION"], grid.bits, 3, grid.origin.data(), grid.range);
  if (ids.count("NORMAL") != 0) encoder.SetAttributeQuantization(ids["NORMAL"], kNormalBits);
  const Eigen::Vector3f black = Eigen::Vector3f::Zero();
  if (ids.count("TEXCOORD_0") != 0) {
    encoder.SetAttributeExplicitQuantization(
        ids["TEXCOORD_0"], texcoord_bits(primitive), 2, black.data(), 1.0f);
  }
  if (ids.count("COLOR_0") != 0) {
    encoder.SetAttributeExplicitQuantization(
        ids["COLOR_0"], kDracoColorBits, 3, black.data(), 1.0f);
  }
  if (ids.count("_SUPPORT") != 0) quantize_whole(encoder, ids["_SUPPORT"], primitive.support);
  if (ids.count("_FEATURE_ID_0") != 0) {
    quantize_whole(encoder, ids["_FEATURE_ID_0"], primitive.features);
  }
  if (ids.count("_SIGMA") != 0) {
    quantize(encoder, ids["_SIGMA"], sigma.bits, sigma.low, sigma.range);
  }
  draco::EncoderBuffer buffer;
  const draco::Status status = encoder.EncodeToBuffer(&buffer);
  if (!status.ok()) fail(status.error_msg_string());
  return {buffer.data(), buffer.size()};
}

/// The geometry in a Draco buffer, as a decoder gives it.
struct Decoded {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector2f> texcoords;  // may be empty
  std::vector<std::array<uint32_t, 3>> faces;
};

Decoded decode(const std::string& bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  auto result = decoder.DecodeMeshFromBuffer(&buffer);
  if (!result.ok()) fail("cannot be decoded: " + result.status().error_msg_string());
  const std::unique_ptr<draco::Mesh> mesh = std::move(result).value();
  const draco::PointAttribute* position =
      mesh->GetNamedAttribute(draco::GeometryAttribute::POSITION);
  if (position == nullptr) fail("positions are lost");
  Decoded out;
  out.positions.resize(mesh->num_points());
  for (uint32_t i = 0; i < mesh->num_points(); ++i) {
    position->GetMappedValue(draco::PointIndex(i), out.positions[i].data());
  }
  const draco::PointAttribute* texcoord =
      mesh->GetNamedAttribute(draco::GeometryAttribute::TEX_COORD);
  if (texcoord != nullptr) out.texcoords.resize(mesh->num_points());
  for (uint32_t i = 0; i < out.texcoords.size(); ++i) {
    texcoord->GetMappedValue(draco::PointIndex(i), out.texcoords[i].data());
  }
  for (uint32_t i = 0; i < mesh->num_faces(); ++i) {
    const draco::Mesh::Face& f = mesh->face(draco::FaceIndex(i));
    out.faces.push_back({f[0].value(), f[1].value(), f[2].value()});
  }
  return out;
}

/// Decoded vertices by the grid cell they lie on. Draco reorders vertices and faces, so places are
/// what both sides have in common.
class Cells {
 public:
  Cells(const std::vector<Eigen::Vector3f>& decoded, const DracoGrid& grid) : grid_(grid) {
    keys_.reserve(decoded.size());
    for (const Eigen::Vector3f& p : decoded) keys_.push_back(key(cell(p).array().round()));
    std::vector<std::pair<uint64_t, uint32_t>> sorted(decoded.size());
    for (uint32_t i = 0; i < decoded.size(); ++i) sorted[i] = {keys_[i], i};
    std::sort(sorted.begin(), sorted.end());
    for (const auto& [k, i] : sorted) {
      if (!unique_.empty() && unique_.back() == k) continue;
      unique_.push_back(k);
      places_.push_back(decoded[i]);
    }
  }

  size_t size() const { return unique_.size(); }
  const Eigen::Vector3f& place(uint32_t cell_number) const { return places_[cell_number]; }
  uint32_t of_decoded(uint32_t vertex) const { return *number(keys_[vertex]); }

  /// The cell that the encoder rounds a point to, if a decoded vertex lies there; the second
  /// nearest along each axis counts too.
  std::optional<uint32_t> nearest(const Eigen::Vector3f& p) const {
    const Eigen::Vector3d exact = cell(p);
    // In float and in the encoder's order: where a point lies between two cells that both hold
    // vertices, the other one would be taken for a changed face.
    const float cells_per_unit = static_cast<float>((1 << grid_.bits) - 1) / grid_.range;
    const Eigen::Array3f scaled = (p - grid_.origin).array() * cells_per_unit;
    const Eigen::Vector3d near = (scaled + 0.5f).floor().matrix().cast<double>();
    for (int side = 0; side < 8; ++side) {
      Eigen::Vector3d candidate = near;
      for (int k = 0; k < 3; ++k) {
        if ((side >> k & 1) != 0) candidate[k] += exact[k] > near[k] ? 1 : -1;
      }
      if (candidate.minCoeff() < 0) continue;
      if (const auto found = number(key(candidate))) return found;
    }
    return std::nullopt;
  }

 private:
  Eigen::Vector3d cell(const Eigen::Vector3f& p) const {
    return (p - grid_.origin).cast<double>() / grid_.step();
  }
  static uint64_t key(const Eigen::Vector3d& whole) {
    constexpr int kBits = kMaxDracoBits;
    // A decoded vertex may lie before the grid: by way of numbers that may be negative.
    const auto bits = [](double coordinate) {
      return static_cast<uint64_t>(static_cast<int64_t>(coordinate));
    };
    return bits(whole.x()) << 2 * kBits | bits(whole.y()) << kBits | bits(whole.z());
  }
  std::optional<uint32_t> number(uint64_t k) const {
    const auto it = std::lower_bound(unique_.begin(), unique_.end(), k);
    if (it == unique_.end() || *it != k) return std::nullopt;
    return static_cast<uint32_t>(it - unique_.begin());
  }

  const DracoGrid& grid_;
  std::vector<uint64_t> keys_;    // per decoded vertex
  std::vector<uint64_t> unique_;  // ascending
  std::vector<Eigen::Vector3f> places_;
};

/// Faces as cell numbers, each beginning with its smallest, in ascending order.
template <typename CellOf>
std::vector<std::array<uint32_t, 3>> faces_by_cell(
    const std::vector<std::array<uint32_t, 3>>& faces, const CellOf& cell_of) {
  std::vector<std::array<uint32_t, 3>> out;
  out.reserve(faces.size());
  for (const auto& f : faces) {
    std::array<uint32_t, 3> c = {cell_of(f[0]), cell_of(f[1]), cell_of(f[2])};
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    if (c[0] == c[2]) c = {c[0], c[0], c[1]};  // two corners in one cell: one form of three
    out.push_back(c);
  }
  std::sort(out.begin(), out.end());
  return out;
}

/// The largest distance between a decoded texture coordinate and the nearest of those that belong
/// to its cell [pixels].
double texture_error(const GlbPrimitive& input,
                     const std::vector<uint32_t>& cell_of,
                     const Decoded& decoded,
                     const Cells& cells) {
  if (decoded.texcoords.size() != (input.texcoords.empty() ? 0 : decoded.positions.size())) {
    fail("texture coordinates of '" + input.name + "' are lost");
  }
  std::vector<std::pair<uint32_t, uint32_t>> by_cell(input.texcoords.size());
  for (uint32_t i = 0; i < by_cell.size(); ++i) by_cell[i] = {cell_of[i], i};
  std::sort(by_cell.begin(), by_cell.end());
  double worst = 0;
  for (uint32_t i = 0; i < decoded.texcoords.size(); ++i) {
    const uint32_t cell = cells.of_decoded(i);
    double nearest = std::numeric_limits<double>::infinity();
    auto it = std::lower_bound(by_cell.begin(), by_cell.end(), std::pair(cell, uint32_t{0}));
    for (; it != by_cell.end() && it->first == cell; ++it) {
      const Eigen::Vector2d off = (decoded.texcoords[i] - input.texcoords[it->second])
                                      .cast<double>()
                                      .cwiseProduct(input.texture_size.cast<double>());
      nearest = std::min(nearest, off.norm());
    }
    worst = std::max(worst, nearest);
  }
  return worst;
}

struct Losses {
  double position = 0;  // the largest move [units of the file]
  double texture = 0;   // the same [pixels]
  size_t collapsed_faces = 0;
};

/// What went in against what came out.
Losses compare(const GlbPrimitive& input, const Decoded& decoded, const DracoGrid& grid) {
  const Cells cells(decoded.positions, grid);
  std::vector<uint32_t> cell_of(input.positions.size());
  std::vector<bool> hit(cells.size(), false);
  Losses out;
  for (size_t i = 0; i < input.positions.size(); ++i) {
    const std::optional<uint32_t> cell = cells.nearest(input.positions[i]);
    if (!cell) fail("vertex " + std::to_string(i) + " of '" + input.name + "' is lost");
    cell_of[i] = *cell;
    hit[*cell] = true;
    const Eigen::Vector3f move = cells.place(*cell) - input.positions[i];
    out.position = std::max(out.position, move.cast<double>().norm());
  }
  if (std::find(hit.begin(), hit.end(), false) != hit.end()) fail("a vertex appeared");
  const auto before = faces_by_cell(input.faces, [&](uint32_t v) { return cell_of[v]; });
  const auto after = faces_by_cell(decoded.faces, [&](uint32_t v) { return cells.of_decoded(v); });
  if (before != after) fail("faces of '" + input.name + "' changed");
  out.texture = texture_error(input, cell_of, decoded, cells);
  if (!(out.texture <= kDracoTextureError)) {
    fail("texture coordinates of '" + input.name + "' moved by " + std::to_string(out.texture) +
         " pixels");
  }
  out.collapsed_faces = static_cast<size_t>(std::count_if(
      after.begin(), after.end(), [](const auto& f) { return f[0] == f[1] || f[1] == f[2]; }));
  return out;
}

}  // namespace

DracoPrimitive draco_compress(const GlbPrimitive& primitive, const DracoGrid& grid, int speed) {
  DracoPrimitive out;
  try {
    out.bytes = encode(primitive, grid, speed, out.attribute_ids);
    const Decoded decoded = decode(out.bytes);
    out.vertices = decoded.positions.size();
    out.faces = decoded.faces.size();
    const Losses losses = compare(primitive, decoded, grid);
    out.max_error = losses.position;
    out.max_texture_error = losses.texture;
    out.collapsed_faces = losses.collapsed_faces;
    out.min = out.max = decoded.positions.front();
    for (const Eigen::Vector3f& p : decoded.positions) {
      out.min = out.min.cwiseMin(p);
      out.max = out.max.cwiseMax(p);
    }
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail(error.what());
  }
  return out;
}

}  // namespace cgs
