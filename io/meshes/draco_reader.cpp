// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/meshes/draco_reader.h"

#include <memory>
#include <stdexcept>

#include <draco/compression/decode.h>
#include <draco/mesh/mesh.h>

#include "io/bytes/byte_reader.h"
#include "io/bytes/byte_writer.h"
#include "io/bytes/isolated.h"

namespace cgs {

namespace {

std::unique_ptr<draco::Mesh> decode(std::string_view bytes) {
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  auto result = decoder.DecodeMeshFromBuffer(&buffer);
  if (!result.ok()) throw std::runtime_error("Draco: " + result.status().error_msg_string());
  return std::move(result).value();
}

void append_attribute(std::string& out, const draco::PointAttribute& attribute, uint32_t points) {
  const int components = attribute.num_components();
  const bool normalized = attribute.normalized() && attribute.data_type() != draco::DT_FLOAT32;
  append_bytes(out, static_cast<int32_t>(attribute.unique_id()));
  append_bytes(out, static_cast<int32_t>(components));
  append_bytes(out, static_cast<uint8_t>(normalized));
  std::vector<float> value(static_cast<size_t>(components));
  for (uint32_t i = 0; i < points; ++i) {
    const draco::AttributeValueIndex index = attribute.mapped_index(draco::PointIndex(i));
    if (index.value() >= attribute.size() ||
        !attribute.ConvertValue<float>(index, static_cast<int8_t>(components), value.data())) {
      throw std::runtime_error("Draco: an attribute lacks values");
    }
    for (const float v : value) append_bytes(out, v);
  }
}

// What passes through the pipe: counts, faces, attributes.
std::string flat(std::string_view bytes) {
  const std::unique_ptr<draco::Mesh> mesh = decode(bytes);
  std::string out;
  append_bytes(out, static_cast<uint64_t>(mesh->num_points()));
  append_bytes(out, static_cast<uint64_t>(mesh->num_faces()));
  append_bytes(out, static_cast<uint32_t>(mesh->num_attributes()));
  for (uint32_t i = 0; i < mesh->num_faces(); ++i) {
    for (const draco::PointIndex& corner : mesh->face(draco::FaceIndex(i))) {
      if (corner.value() >= mesh->num_points()) {
        throw std::runtime_error("Draco: a face names a vertex that is not there");
      }
      append_bytes(out, corner.value());
    }
  }
  for (int i = 0; i < mesh->num_attributes(); ++i) {
    append_attribute(out, *mesh->attribute(i), mesh->num_points());
  }
  return out;
}

}  // namespace

DracoMesh read_draco(std::string_view bytes, const std::filesystem::path& path) {
  const std::string content = run_isolated([&] { return flat(bytes); }, path);
  ByteReader in(content, path);
  DracoMesh out;
  out.vertices = in.get<uint64_t>("vertices");
  out.faces.resize(in.get<uint64_t>("faces"));
  const auto attributes = in.get<uint32_t>("attributes");
  for (auto& face : out.faces) face = in.get<std::array<uint32_t, 3>>("face");
  for (uint32_t i = 0; i < attributes; ++i) {
    const auto id = in.get<int32_t>("id");
    DracoMesh::Attribute attribute;
    attribute.components = in.get<int32_t>("components");
    attribute.is_normalized = in.get<uint8_t>("normalized") != 0;
    const size_t values = out.vertices * static_cast<size_t>(attribute.components);
    in.expect_records(values, sizeof(float), "values");
    attribute.values.resize(values);
    for (float& v : attribute.values) v = in.get<float>("value");
    out.attributes[id] = std::move(attribute);
  }
  return out;
}

}  // namespace cgs
