// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/onnx_input.h"

#include <optional>
#include <set>
#include <string>

namespace cgs {

namespace {

/// One field of a message: a number or, for messages and strings, bytes.
struct Field {
  uint64_t number = 0;
  uint64_t value = 0;
  std::string_view bytes;
};

/// The fields of a message, which cannot lead out of its bytes.
class Message {
 public:
  explicit Message(std::string_view bytes) : rest_(bytes) {}

  // The next field; nothing at the end or where the bytes make no sense.
  std::optional<Field> next() {
    const auto key = varint();
    if (!key) return std::nullopt;
    Field out;
    out.number = *key >> 3;
    switch (*key & 7) {
      case 0: {
        const auto value = varint();
        if (!value) return std::nullopt;
        out.value = *value;
        return out;
      }
      case 1:
        return skip(8) ? std::optional(out) : std::nullopt;
      case 2: {
        const auto length = varint();
        if (!length || *length > rest_.size()) return std::nullopt;
        out.bytes = rest_.substr(0, *length);
        rest_.remove_prefix(*length);
        return out;
      }
      case 5:
        return skip(4) ? std::optional(out) : std::nullopt;
      default:
        return std::nullopt;
    }
  }

 private:
  bool skip(size_t bytes) {
    if (bytes > rest_.size()) return false;
    rest_.remove_prefix(bytes);
    return true;
  }
  std::optional<uint64_t> varint() {
    uint64_t out = 0;
    for (unsigned shift = 0; shift < 64 && !rest_.empty(); shift += 7) {
      const auto byte = static_cast<unsigned char>(rest_.front());
      rest_.remove_prefix(1);
      out |= uint64_t{byte & 0x7fu} << shift;
      if (byte < 0x80) return out;
    }
    return std::nullopt;
  }
  std::string_view rest_;
};

// The first field of a number; empty bytes if there is none.
std::string_view part(std::string_view message, uint64_t number) {
  Message fields(message);
  while (const auto field = fields.next()) {
    if (field->number == number) return field->bytes;
  }
  return {};
}

std::vector<int64_t> shape_of(std::string_view value_info) {
  constexpr uint64_t kType = 2;
  constexpr uint64_t kTensor = 1;
  constexpr uint64_t kShape = 2;
  std::vector<int64_t> out;
  Message dimensions(part(part(part(value_info, kType), kTensor), kShape));
  while (const auto dimension = dimensions.next()) {
    constexpr uint64_t kValue = 1;
    int64_t side = 0;
    Message fields(dimension->bytes);
    while (const auto field = fields.next()) {
      if (field->number == kValue) side = static_cast<int64_t>(field->value);
    }
    out.push_back(side);
  }
  return out;
}

}  // namespace

std::vector<int64_t> onnx_input_shape(std::string_view onnx) {
  constexpr uint64_t kGraph = 7;
  constexpr uint64_t kWeights = 5;
  constexpr uint64_t kWeightName = 8;
  constexpr uint64_t kInput = 11;
  constexpr uint64_t kInputName = 1;
  const std::string_view graph = part(onnx, kGraph);
  std::set<std::string_view> weights;
  Message fields(graph);
  while (const auto field = fields.next()) {
    if (field->number == kWeights) weights.insert(part(field->bytes, kWeightName));
  }
  Message again(graph);
  while (const auto field = again.next()) {
    if (field->number != kInput || weights.contains(part(field->bytes, kInputName))) continue;
    return shape_of(field->bytes);
  }
  return {};
}

}  // namespace cgs
