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

/// \param typed  the object with its component type
uint32_t index_at(const char* bytes, int type, const JsonValue& typed) {
  switch (type) {
    case kUnsignedByte:
      return at<uint8_t>(bytes);
    case kUnsignedShort:
      return at<uint16_t>(bytes);
    case kUnsignedInt:
      return at<uint32_t>(bytes);
    default:
      typed.at("componentType").fail(Defect::Schema, "is not one of indices");
  }
}

[[noreturn]] void refuse_long_json(const std::filesystem::path& path, uint64_t bytes) {
  throw LimitError(printable(path) + ": " + std::to_string(bytes) + " bytes of JSON, allowed are " +
                   std::to_string(ReadLimits{}.max_json_bytes));
}

}  // namespace

bool is_gltf_text(std::string_view content) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
  if (content.starts_with(kByteOrderMark)) content.remove_prefix(kByteOrderMark.size());
  const size_t first = content.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && content[first] == '{';
}

std::vector<double> numbers_or(const JsonValue& object,
                               const char* key,
                               std::vector<double> otherwise) {
  const auto list = object.find(key);
  if (!list) return otherwise;
  if (list->size() != otherwise.size()) list->fail(Defect::Count, "has the wrong length");
  return numbers_of(*list);
}

std::vector<double> numbers_of(const JsonValue& array) {
  std::vector<double> out(array.size());
  for (size_t i = 0; i < out.size(); ++i) out[i] = array.at(i).number();
  return out;
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
    : path_(path), content_(std::move(content)), files_(path) {
  refuse_foreign_content(path, content_, "glTF");
  if (!is_gltf_text(content_)) {
    take_apart();
  } else if (content_.size() > ReadLimits{}.max_json_bytes) {
    refuse_long_json(path, content_.size());
  } else {
    json_ = parse_json(content_, path);
  }
  refuse_other_version();
  find_buffers();
  decode_views();
}

void GlbContainer::take_apart() {
  ByteReader in(content_, path_);
  if (in.get<uint32_t>("magic") != kMagic) {
    throw BadInput(Defect::Magic, path_, "not a binary glTF file: does not start with 'glTF'");
  }
  if (const auto version = in.get<uint32_t>("version"); version != 2) {
    throw BadInput(
        Defect::Unsupported, path_, "glTF version " + std::to_string(version) + "; 2 is read");
  }
  if (const auto length = in.get<uint32_t>("length"); length > content_.size()) {
    throw BadInput(Defect::Truncated,
                   path_,
                   std::to_string(content_.size()) + " of " + std::to_string(length) + " bytes");
  }
  const auto json_bytes = in.get<uint32_t>("size of the first chunk");
  if (in.get<uint32_t>("type of the first chunk") != kJsonChunk) {
    throw BadInput(Defect::Syntax, path_, "the first chunk is not JSON");
  }
  if (json_bytes > ReadLimits{}.max_json_bytes) refuse_long_json(path_, json_bytes);
  json_ = parse_json(in.take(json_bytes, "JSON chunk"), path_);
  constexpr size_t kChunkHeader = 8;
  if (in.remaining() < kChunkHeader) return;
  const auto size = in.get<uint32_t>("size of the second chunk");
  if (in.get<uint32_t>("type of the second chunk") == kBinaryChunk) {
    binary_ = in.take(size, "binary chunk");
  }
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

// The first one of a binary file is its chunk; those that only stand in for compressed data have
// none.
void GlbContainer::find_buffers() {
  const auto list = root().find("buffers");
  const bool is_binary = !is_gltf_text(content_);
  for (size_t i = 0; list && i < list->size(); ++i) {
    const JsonValue buffer = list->at(i);
    if (buffer.find("uri")) {
      buffers_.emplace_back(files_.bytes(buffer));
    } else {
      buffers_.push_back(i == 0 && is_binary ? std::optional(binary_) : std::nullopt);
    }
  }
}

// Of a buffer view, or of the extension of one that is compressed.
std::string_view GlbContainer::chunk_bytes(const JsonValue& part) const {
  const JsonValue buffer = element("buffers", part.at("buffer"));
  const std::optional<std::string_view>& bytes = buffers_[whole_number(part.at("buffer"))];
  if (!bytes) buffer.fail(Defect::Unsupported, "has neither a binary chunk nor a uri");
  const auto start = part.find("byteOffset");
  const uint64_t offset = start ? whole_number(*start) : 0;
  const uint64_t length = whole_number(part.at("byteLength"));
  if (offset > bytes->size() || length > bytes->size() - offset) {
    part.fail(Defect::Count,
              "ends at byte " + std::to_string(offset + length) + " of a buffer of " +
                  std::to_string(bytes->size()));
  }
  return bytes->substr(offset, length);
}

// Several views may name the same stream: together they hold no more than one that fills the file.
void GlbContainer::decode_views() {
  const auto views = root().find("bufferViews");
  uint64_t room = kMostMeshoptRatio * (binary_.size() + files_.size());
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

std::string_view GlbContainer::image_bytes(const JsonValue& image) {
  const auto view = image.find("bufferView");
  return view ? view_bytes(*view) : files_.bytes(image);
}

GlbContainer::Layout GlbContainer::layout(const JsonValue& accessor, int components) const {
  static constexpr std::array<const char*, 4> kTypes = {"SCALAR", "VEC2", "VEC3", "VEC4"};
  const char* type = kTypes.at(static_cast<size_t>(components) - 1);
  if (accessor.at("type").text() != type) {
    accessor.at("type").fail(Defect::Schema, std::string("is not ") + type);
  }
  Layout out;
  out.component_type = accessor.at("componentType").count();
  out.size = component_size(out.component_type) * static_cast<uint64_t>(components);
  if (out.size == 0) accessor.at("componentType").fail(Defect::Schema, "is not a component type");
  if (const auto normalized = accessor.find("normalized")) {
    out.is_normalized = normalized->boolean() && out.component_type != kFloat;
  }
  out.count = whole_number(accessor.at("count"));
  return out;
}

// Of an accessor, or of the indices or values of a sparse one.
GlbContainer::Elements GlbContainer::stored(const JsonValue& part, const Layout& in) const {
  const JsonValue index = part.at("bufferView");
  const JsonValue view = element("bufferViews", index);
  const auto stride = view.find("byteStride");
  const auto decoded = decoded_.find(whole_number(index));
  const uint64_t packed = decoded != decoded_.end() ? decoded->second.stride : in.size;
  Elements out;
  out.stride = stride ? whole_number(*stride) : packed;
  if (out.stride < in.size) view.fail(Defect::Value, "has a stride smaller than an element");
  const auto start = part.find("byteOffset");
  const uint64_t offset = start ? whole_number(*start) : 0;
  out.bytes = view_bytes(index);
  const uint64_t room = offset <= out.bytes.size() ? out.bytes.size() - offset : 0;
  const uint64_t most = room >= in.size ? (room - in.size) / out.stride + 1 : 0;
  if (in.count > most) {
    part.fail(Defect::Count,
              "has " + std::to_string(in.count) + " elements, its buffer view holds " +
                  std::to_string(most));
  }
  out.bytes.remove_prefix(std::min<uint64_t>(offset, out.bytes.size()));
  return out;
}

// Nothing in the file bounds how many there are, but each is for a vertex that lies in it.
std::string GlbContainer::zeros(const JsonValue& accessor, const Layout& in) const {
  constexpr uint64_t kMostRatio = 64;  // as of compressed vertices
  const uint64_t bytes = content_.size() + files_.size();
  if (in.count > kMostRatio * bytes / in.size) {
    accessor.fail(Defect::Count,
                  "has " + std::to_string(in.count) + " zeros, in a file of " +
                      std::to_string(bytes) + " bytes");
  }
  return std::string(in.count * in.size, '\0');
}

// Source: glTF 2.0, section 3.6.2.3 (sparse accessors).
void GlbContainer::replace_some(const JsonValue& sparse,
                                const Layout& in,
                                std::string& values) const {
  Layout replaced = in;
  replaced.count = whole_number(sparse.at("count"));
  const JsonValue places = sparse.at("indices");
  Layout numbers{replaced.count, 0, places.at("componentType").count(), false};
  numbers.size = component_size(numbers.component_type);
  if (numbers.size == 0) places.at("componentType").fail(Defect::Schema, "is not one of indices");
  const Elements at = stored(places, numbers);
  const Elements with = stored(sparse.at("values"), replaced);
  for (uint64_t i = 0; i < replaced.count; ++i) {
    const uint32_t k = index_at(at.bytes.data() + i * at.stride, numbers.component_type, places);
    if (k >= in.count) {
      places.fail(Defect::Ref,
                  "names element " + std::to_string(k) + " of " + std::to_string(in.count));
    }
    std::memcpy(values.data() + k * in.size, with.bytes.data() + i * with.stride, in.size);
  }
}

// \param own  holds them where the file does not, as they are to be read
GlbContainer::Elements GlbContainer::elements(const JsonValue& accessor,
                                              const Layout& in,
                                              std::string& own) const {
  const auto sparse = accessor.find("sparse");
  const bool has_view = accessor.find("bufferView").has_value();
  if (has_view && !sparse) return stored(accessor, in);
  if (!has_view) {
    own = zeros(accessor, in);
  } else {
    const Elements base = stored(accessor, in);
    own.resize(in.count * in.size);
    for (uint64_t i = 0; i < in.count; ++i) {
      std::memcpy(own.data() + i * in.size, base.bytes.data() + i * base.stride, in.size);
    }
  }
  if (sparse) replace_some(*sparse, in, own);
  return {own, in.size};
}

std::vector<float> GlbContainer::floats(const JsonValue& accessor, int components) const {
  const Layout in = layout(accessor, components);
  std::string own;
  const Elements from = elements(accessor, in, own);
  const uint64_t size = component_size(in.component_type);
  std::vector<float> out;
  out.reserve(in.count * static_cast<uint64_t>(components));
  for (uint64_t i = 0; i < in.count; ++i) {
    const char* element = from.bytes.data() + i * from.stride;
    for (uint64_t k = 0; k < static_cast<uint64_t>(components); ++k) {
      out.push_back(component(element + k * size, in.component_type, in.is_normalized));
    }
  }
  return out;
}

std::vector<uint32_t> GlbContainer::indices(const JsonValue& accessor) const {
  const Layout in = layout(accessor, 1);
  std::string own;
  const Elements from = elements(accessor, in, own);
  std::vector<uint32_t> out;
  out.reserve(in.count);
  for (uint64_t i = 0; i < in.count; ++i) {
    out.push_back(index_at(from.bytes.data() + i * from.stride, in.component_type, accessor));
  }
  return out;
}

}  // namespace cgs
