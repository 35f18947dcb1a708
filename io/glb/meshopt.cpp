// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/meshopt.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <map>
#include <vector>

#include <meshoptimizer.h>
#include <nlohmann/json.hpp>

#include "io/bytes/byte_reader.h"
#include "io/glb/bytes.h"
#include "io/glb/container.h"
#include "libcgs/core/error.h"

namespace cgs {

namespace {

using Json = nlohmann::json;

const unsigned char* unsigned_bytes(std::string_view bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

unsigned char* unsigned_bytes(std::string& bytes) {
  return reinterpret_cast<unsigned char*>(bytes.data());
}

template <typename T>
void reorder(std::vector<T>& values, const std::vector<unsigned int>& remap) {
  std::vector<T> out(values.size());
  for (size_t v = 0; v < values.size(); ++v) out[remap[v]] = values[v];
  values = std::move(out);
}

/// What a stream of the extension holds, and how.
struct Stream {
  std::string mode = "ATTRIBUTES";  ///< ATTRIBUTES, TRIANGLES or INDICES.
  std::string filter = "NONE";      ///< NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL.
  size_t count = 0;                 ///< Elements.
  size_t stride = 0;                ///< Bytes of each.
};

/// Decodes into count * stride bytes; false if the bytes are no such stream.
bool decode(const Stream& stream, std::string_view bytes, std::string& out) {
  out.resize(stream.count * stream.stride);
  const auto failed = [&] {
    if (stream.mode == "TRIANGLES") {
      return meshopt_decodeIndexBuffer(
          out.data(), stream.count, stream.stride, unsigned_bytes(bytes), bytes.size());
    }
    if (stream.mode == "INDICES") {
      return meshopt_decodeIndexSequence(
          out.data(), stream.count, stream.stride, unsigned_bytes(bytes), bytes.size());
    }
    return meshopt_decodeVertexBuffer(
        out.data(), stream.count, stream.stride, unsigned_bytes(bytes), bytes.size());
  };
  return failed() == 0;
}

void undo_filter(const Stream& stream, std::string& bytes) {
  if (stream.filter == "OCTAHEDRAL") {
    meshopt_decodeFilterOct(bytes.data(), stream.count, stream.stride);
  } else if (stream.filter == "QUATERNION") {
    meshopt_decodeFilterQuat(bytes.data(), stream.count, stream.stride);
  } else if (stream.filter == "EXPONENTIAL") {
    meshopt_decodeFilterExp(bytes.data(), stream.count, stream.stride);
  }
}

std::string octahedral(std::string_view normals, size_t count) {
  std::vector<float> vectors(4 * count);
  for (size_t i = 0; i < vectors.size(); ++i) {
    vectors[i] = static_cast<float>(static_cast<signed char>(normals[i])) / 127;
  }
  std::string out(4 * count, '\0');
  meshopt_encodeFilterOct(out.data(), count, 4, 8, vectors.data());
  return out;
}

std::string exponential(std::string_view floats, size_t count) {
  constexpr int kBits = 9;  // with the sign; to a 250th
  std::vector<float> values(count);
  std::memcpy(values.data(), floats.data(), count * sizeof(float));
  std::string out(count * sizeof(float), '\0');
  meshopt_encodeFilterExp(out.data(), count, sizeof(float), kBits, values.data());
  return out;
}

std::string encoded_faces(const Stream& stream, std::string_view bytes) {
  std::vector<unsigned int> indices(stream.count);
  unsigned int largest = 0;
  for (size_t i = 0; i < indices.size(); ++i) {
    std::memcpy(&indices[i], bytes.data() + i * stream.stride, stream.stride);  // little-endian
    largest = std::max(largest, indices[i]);
  }
  std::string out(meshopt_encodeIndexBufferBound(stream.count, largest + 1), '\0');
  meshopt_encodeIndexVersion(1);  // the one that the extension has
  out.resize(
      meshopt_encodeIndexBuffer(unsigned_bytes(out), out.size(), indices.data(), indices.size()));
  return out;
}

/// Triangles may begin at another corner after decoding.
std::string from_smallest_corner(const Stream& stream, std::string bytes) {
  const size_t size = stream.stride;
  for (size_t at = 0; at + 3 * size <= bytes.size(); at += 3 * size) {
    std::array<uint32_t, 3> corners{};
    for (size_t k = 0; k < 3; ++k) std::memcpy(&corners.at(k), &bytes[at + k * size], size);
    std::rotate(corners.begin(), std::min_element(corners.begin(), corners.end()), corners.end());
    for (size_t k = 0; k < 3; ++k) std::memcpy(&bytes[at + k * size], &corners.at(k), size);
  }
  return bytes;
}

std::string encoded(const Stream& stream, const std::string& filtered) {
  std::string out;
  if (stream.mode == "TRIANGLES") {
    out = encoded_faces(stream, filtered);
  } else {
    out.resize(meshopt_encodeVertexBufferBound(stream.count, stream.stride));
    meshopt_encodeVertexVersion(0);
    out.resize(meshopt_encodeVertexBuffer(
        unsigned_bytes(out), out.size(), filtered.data(), stream.count, stream.stride));
  }
  std::string again;
  bool same = decode(stream, out, again);
  if (same && stream.mode == "TRIANGLES") {
    same = from_smallest_corner(stream, again) == from_smallest_corner(stream, filtered);
  } else {
    same = same && again == filtered;
  }
  if (!same) throw NumericalError("meshopt compression: a stream does not decode to what went in");
  return out;
}

/// Buffer views of vertices and faces, by their number.
std::map<size_t, Stream> streams_of(const Json& document) {
  std::map<size_t, Stream> out;
  const auto add = [&](size_t accessor_number, const std::string& attribute) {
    const Json& accessor = document["accessors"][accessor_number];
    const size_t number = accessor["bufferView"];
    const Json& view = document["bufferViews"][number];
    Stream& stream = out[number];
    stream.count = accessor["count"];
    stream.stride = view["byteLength"].get<size_t>() / stream.count;
    if (attribute.empty()) stream.mode = "TRIANGLES";
    if (attribute == "NORMAL") stream.filter = "OCTAHEDRAL";
    if (attribute == "_SIGMA") stream.filter = "EXPONENTIAL";
  };
  for (const Json& primitive : document["meshes"][0]["primitives"]) {
    for (const auto& [name, accessor] : primitive["attributes"].items()) add(accessor, name);
    add(primitive["indices"], "");
  }
  return out;
}

std::string filtered(const Stream& stream, std::string_view bytes) {
  if (stream.filter == "OCTAHEDRAL") return octahedral(bytes, stream.count);
  if (stream.filter == "EXPONENTIAL") return exponential(bytes, stream.count);
  return std::string(bytes);
}

/// Appends bytes at the next multiple of four. \return where they begin
size_t append_aligned(std::string& out, std::string_view bytes) {
  out.resize((out.size() + 3) / 4 * 4, '\0');
  const size_t offset = out.size();
  out += bytes;
  return offset;
}

void require_fit(const JsonValue& extension, const Stream& stream) {
  const bool is_vertex = stream.mode == "ATTRIBUTES";
  if (!is_vertex && stream.mode != "TRIANGLES" && stream.mode != "INDICES") {
    extension.at("mode").fail(Defect::Value, "is not ATTRIBUTES, TRIANGLES or INDICES");
  }
  const bool fits = is_vertex ? stream.stride % 4 == 0 && stream.stride > 0 && stream.stride <= 256
                              : stream.stride == 2 || stream.stride == 4;
  if (!fits) extension.at("byteStride").fail(Defect::Value, "does not fit the mode");
  if (stream.mode == "TRIANGLES" && stream.count % 3 != 0) {
    extension.at("count").fail(Defect::Value, "is no multiple of three");
  }
  const bool filter_fits =
      stream.filter == "NONE" || (stream.filter == "EXPONENTIAL" && is_vertex) ||
      (stream.filter == "QUATERNION" && is_vertex && stream.stride == 8) ||
      (stream.filter == "OCTAHEDRAL" && is_vertex && (stream.stride == 4 || stream.stride == 8));
  if (!filter_fits) extension.at("filter").fail(Defect::Value, "is not known or fits no stride");
}

}  // namespace

GlbPrimitive in_cache_order(GlbPrimitive primitive) {
  const size_t vertices = primitive.positions.size();
  const size_t corners = 3 * primitive.faces.size();
  unsigned int* const indices = primitive.faces.data()->data();
  const std::vector<unsigned int> before(indices, indices + corners);
  meshopt_optimizeVertexCacheStrip(indices, before.data(), corners, vertices);
  std::vector<unsigned int> remap(vertices);
  meshopt_optimizeVertexFetchRemap(remap.data(), indices, corners, vertices);
  for (auto& face : primitive.faces) {
    for (uint32_t& corner : face) corner = remap[corner];
  }
  reorder(primitive.positions, remap);
  reorder(primitive.normals, remap);
  reorder(primitive.texcoords, remap);
  reorder(primitive.colors, remap);
  reorder(primitive.support, remap);
  reorder(primitive.sigma, remap);
  return primitive;  // features are all the same
}

std::string meshopt_compressed(std::string_view glb) {
  constexpr size_t kHeader = 12;
  constexpr size_t kChunkHeader = 8;
  uint32_t json_size = 0;
  std::memcpy(&json_size, glb.data() + kHeader, sizeof json_size);
  Json document = Json::parse(glb.substr(kHeader + kChunkHeader, json_size));
  const std::string_view binary = glb.substr(kHeader + 2 * kChunkHeader + json_size);
  const std::map<size_t, Stream> streams = streams_of(document);
  std::string out;
  size_t decoded_bytes = 0;
  for (size_t i = 0; i < document["bufferViews"].size(); ++i) {
    Json& view = document["bufferViews"][i];
    const std::string_view bytes =
        binary.substr(view.value("byteOffset", size_t{0}), view["byteLength"]);
    const auto stream = streams.find(i);
    if (stream == streams.end()) {
      view["byteOffset"] = append_aligned(out, bytes);
      continue;
    }
    const std::string packed = encoded(stream->second, filtered(stream->second, bytes));
    view["extensions"][kMeshopt] = {{"buffer", 0},
                                    {"byteOffset", append_aligned(out, packed)},
                                    {"byteLength", packed.size()},
                                    {"byteStride", stream->second.stride},
                                    {"count", stream->second.count},
                                    {"mode", stream->second.mode},
                                    {"filter", stream->second.filter}};
    view["buffer"] = 1;
    view["byteOffset"] = decoded_bytes;
    decoded_bytes += (bytes.size() + 3) / 4 * 4;
  }
  document["buffers"] = {
      {{"byteLength", out.size()}},
      {{"byteLength", decoded_bytes}, {"extensions", {{kMeshopt, {{"fallback", true}}}}}}};
  document["extensionsUsed"].push_back(kMeshopt);
  document["extensionsRequired"].push_back(kMeshopt);
  return glb_bytes(document.dump(), std::move(out));
}

std::string meshopt_decoded(const JsonValue& extension, std::string_view bytes) {
  Stream stream;
  stream.mode = extension.at("mode").text();
  if (const auto filter = extension.find("filter")) stream.filter = filter->text();
  stream.count = whole_number(extension.at("count"));
  stream.stride = whole_number(extension.at("byteStride"));
  require_fit(extension, stream);
  if (stream.count > kMostMeshoptRatio * bytes.size() / stream.stride) {
    extension.at("count").fail(Defect::Count,
                               "is " + std::to_string(stream.count) + " for a stream of " +
                                   std::to_string(bytes.size()) + " bytes");
  }
  std::string out;
  if (!decode(stream, bytes, out)) {
    extension.fail(Defect::Syntax, "does not decode as " + stream.mode);
  }
  undo_filter(stream, out);
  return out;
}

}  // namespace cgs
