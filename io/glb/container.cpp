// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/glb/container.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#include "io/bytes/byte_reader.h"
#include "io/glb/meshopt.h"

namespace cgs {

namespace {

constexpr uint32_t kMagic = 0x46546C67;      // "glTF"
constexpr uint32_t kJsonChunk = 0x4E4F534A;  // "JSON"
constexpr uint32_t kBinaryChunk = 0x004E4942;

// componentType of glTF.
constexpr int kByte = 5120;
constexpr int kUnsignedByte = 5121;
constexpr int kShort = 5122;
constexpr int kUnsignedShort = 5123;
constexpr int kUnsignedInt = 5125;
constexpr int kFloat = 5126;

uint64_t component_size(int type) {
  switch (type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

template <typename T>
T at(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

template <typename T>
float whole_as_float(const char* bytes, bool is_normalized) {
  const auto value = static_cast<float>(at<T>(bytes));
  if (!is_normalized) return value;
  return std::max(-1.0f, value / static_cast<float>(std::numeric_limits<T>::max()));
}

float component(const char* bytes, int type, bool is_normalized) {
  switch (type) {
    case kByte:
      return whole_as_float<int8_t>(bytes, is_normalized);
    case kUnsignedByte:
      return whole_as_float<uint8_t>(bytes, is_normalized);
    case kShort:
      return whole_as_float<int16_t>(bytes, is_normalized);
    case kUnsignedShort:
      return whole_as_float<uint16_t>(bytes, is_normalized);
    case kUnsignedInt:
      return whole_as_float<uint32_t>(bytes, is_normalized);
    default:
      return at<float>(bytes);
  }
}

}  // namespace

std::vector<double> numbers_or(const JsonValue& object,
                               const char* key,
                               std::vector<double> otherwise) {
  const auto list = object.find(key);
  if (!list) return otherwise;
  if (list->size() != otherwise.size()) list->fail(Defect::Count, "has the wrong length");
  for (size_t i = 0; i < otherwise.size(); ++i) otherwise[i] = list->at(i).number();
  return otherwise;
}

uint64_t whole_number(const JsonValue& value) {
  constexpr double kLargest = 9007199254740992.0;  // 2^53
  const double number = value.number();
  if (!(number >= 0 && number <= kLargest) || number != std::floor(number)) {
    value.fail(Defect::Schema, "is not a whole number of 0 or more");
  }
  return static_cast<uint64_t>(number);
}

GlbContainer::GlbContainer(const std::filesystem::path& path)
    : GlbContainer(read_file(path), path) {}

GlbContainer::GlbContainer(std::string content, const std::filesystem::path& path)
    : path_(path), content_(std::move(content)) {
  refuse_foreign_content(path, content_, "GLB");
  ByteReader in(content_, path);
  if (in.get<uint32_t>("magic") != kMagic) {
    throw BadInput(Defect::Magic, path, "not a binary glTF file: does not start with 'glTF'");
  }
  if (const auto version = in.get<uint32_t>("version"); version != 2) {
    throw BadInput(
        Defect::Unsupported, path, "glTF version " + std::to_string(version) + "; 2 is read");
  }
  if (const auto length = in.get<uint32_t>("length"); length > content_.size()) {
    throw BadInput(Defect::Truncated,
                   path,
                   std::to_string(content_.size()) + " of " + std::to_string(length) + " bytes");
  }
  const auto json_bytes = in.get<uint32_t>("size of the first chunk");
  if (in.get<uint32_t>("type of the first chunk") != kJsonChunk) {
    throw BadInput(Defect::Syntax, path, "the first chunk is not JSON");
  }
  if (json_bytes > ReadLimits{}.max_json_bytes) {
    throw LimitError(printable(path) + ": " + std::to_string(json_bytes) +
                     " bytes of JSON, allowed are " + std::to_string(ReadLimits{}.max_json_bytes));
  }
  json_ = parse_json(in.take(json_bytes, "JSON chunk"), path);
  refuse_other_version();
  constexpr size_t kChunkHeader = 8;
  if (in.remaining() < kChunkHeader) return;
  const auto size = in.get<uint32_t>("size of the second chunk");
  if (in.get<uint32_t>("type of the second chunk") == kBinaryChunk) {
    binary_ = in.take(size, "binary chunk");
  }
  decode_views();
}

// The container has a version of its own.
void GlbContainer::refuse_other_version() const {
  const auto asset = root().find("asset");
  const auto require = [&](const char* key, std::string_view start) {
    const auto version = asset ? asset->find(key) : std::nullopt;
    if (version && version->text().rfind(start, 0) != 0) {
      throw BadInput(Defect::Unsupported, path_, "glTF " + version->text() + "; 2.0 is read");
    }
  };
  require("version", "2.");
  require("minVersion", "2.0");
}

JsonValue GlbContainer::element(const char* array, const JsonValue& index) const {
  const auto list = root().find(array);
  const uint64_t i = whole_number(index);
  if (!list || i >= list->size()) {
    index.fail(Defect::Ref,
               "names " + std::string(array) + "[" + std::to_string(i) + "], there are " +
                   std::to_string(list ? list->size() : 0));
  }
  return list->at(static_cast<size_t>(i));
}

// Of a buffer view, or of the extension of one that is compressed.
std::string_view GlbContainer::chunk_bytes(const JsonValue& part) const {
  const JsonValue buffer = element("buffers", part.at("buffer"));
  if (buffer.find("uri") || whole_number(part.at("buffer")) != 0) {
    buffer.fail(Defect::Unsupported, "lies in another file; only files in one piece are read");
  }
  const auto start = part.find("byteOffset");
  const uint64_t offset = start ? whole_number(*start) : 0;
  const uint64_t length = whole_number(part.at("byteLength"));
  if (offset > binary_.size() || length > binary_.size() - offset) {
    part.fail(Defect::Count,
              "ends at byte " + std::to_string(offset + length) + " of a binary chunk of " +
                  std::to_string(binary_.size()));
  }
  return binary_.substr(offset, length);
}

// Several views may name the same stream: together they hold no more than one that fills the file.
void GlbContainer::decode_views() {
  const auto views = root().find("bufferViews");
  uint64_t room = kMostMeshoptRatio * binary_.size();
  for (size_t i = 0; views && i < views->size(); ++i) {
    const auto extensions = views->at(i).find("extensions");
    const auto meshopt = extensions ? extensions->find(kMeshopt) : std::nullopt;
    if (!meshopt) continue;
    std::string bytes = meshopt_decoded(*meshopt, chunk_bytes(*meshopt));
    if (bytes.size() > room) {
      throw LimitError(printable(path_) + ": compressed buffer views hold more than " +
                       std::to_string(kMostMeshoptRatio) + " times the bytes of the file");
    }
    room -= bytes.size();
    const uint64_t stated = whole_number(views->at(i).at("byteLength"));
    if (stated != bytes.size()) {
      views->at(i).fail(Defect::Count,
                        "has " + std::to_string(stated) + " bytes, its stream holds " +
                            std::to_string(bytes.size()));
    }
    decoded_[i] = {std::move(bytes), whole_number(meshopt->at("byteStride"))};
  }
}

std::string_view GlbContainer::view_bytes(const JsonValue& index) const {
  const JsonValue view = element("bufferViews", index);
  const auto decoded = decoded_.find(whole_number(index));
  return decoded != decoded_.end() ? std::string_view(decoded->second.bytes) : chunk_bytes(view);
}

GlbContainer::Elements GlbContainer::elements(const JsonValue& accessor, int components) const {
  static constexpr std::array<const char*, 4> kTypes = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  const char* type = kTypes.at(static_cast<size_t>(components) - 1);
  if (accessor.at("type").text() != type) {
    accessor.at("type").fail(Defect::Schema, std::string("is not ") + type);
  }
  if (accessor.find("sparse")) accessor.fail(Defect::Unsupported, "is sparse");
  Elements out;
  out.component_type = accessor.at("componentType").count();
  const uint64_t size = component_size(out.component_type) * static_cast<uint64_t>(components);
  if (size == 0) accessor.at("componentType").fail(Defect::Schema, "is not a component type");
  if (const auto normalized = accessor.find("normalized")) {
    out.is_normalized = normalized->boolean() && out.component_type != kFloat;
  }
  out.count = whole_number(accessor.at("count"));
  const auto view_index = accessor.find("bufferView");
  if (!view_index) accessor.fail(Defect::Unsupported, "has no buffer view");
  const JsonValue view = element("bufferViews", *view_index);
  const auto stride = view.find("byteStride");
  const auto decoded = decoded_.find(whole_number(*view_index));
  const uint64_t packed = decoded != decoded_.end() ? decoded->second.stride : size;
  out.stride = stride ? whole_number(*stride) : packed;
  if (out.stride < size) view.fail(Defect::Value, "has a stride smaller than an element");
  const auto start = accessor.find("byteOffset");
  const uint64_t offset = start ? whole_number(*start) : 0;
  out.bytes = view_bytes(*view_index);
  const uint64_t room = offset <= out.bytes.size() ? out.bytes.size() - offset : 0;
  const uint64_t most = room >= size ? (room - size) / out.stride + 1 : 0;
  if (out.count > most) {
    accessor.fail(Defect::Count,
                  "has " + std::to_string(out.count) + " elements, its buffer view holds " +
                      std::to_string(most));
  }
  out.bytes.remove_prefix(std::min<uint64_t>(offset, out.bytes.size()));
  return out;
}

std::vector<float> GlbContainer::floats(const JsonValue& accessor, int components) const {
  const Elements in = elements(accessor, components);
  std::vector<float> out;
  out.reserve(in.count * static_cast<uint64_t>(components));
  for (uint64_t i = 0; i < in.count; ++i) {
    const char* element = in.bytes.data() + i * in.stride;
    for (int k = 0; k < components; ++k) {
      const auto size = component_size(in.component_type);
      out.push_back(component(
          element + static_cast<uint64_t>(k) * size, in.component_type, in.is_normalized));
    }
  }
  return out;
}

std::vector<uint32_t> GlbContainer::indices(const JsonValue& accessor) const {
  const Elements in = elements(accessor, 1);
  std::vector<uint32_t> out;
  out.reserve(in.count);
  for (uint64_t i = 0; i < in.count; ++i) {
    const char* element = in.bytes.data() + i * in.stride;
    switch (in.component_type) {
      case kUnsignedByte:
        out.push_back(at<uint8_t>(element));
        break;
      case kUnsignedShort:
        out.push_back(at<uint16_t>(element));
        break;
      case kUnsignedInt:
        out.push_back(at<uint32_t>(element));
        break;
      default:
        accessor.at("componentType").fail(Defect::Schema, "is not one of indices");
    }
  }
  return out;
}

}  // namespace cgs
