// SPDX-License-Identifier: GPL-3.0-or-later
#include "libcgs/priors/onnx_input.h"

#include <algorithm>
#include <array>
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
  bool has_bytes = false;
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
        out.has_bytes = true;
        rest_.remove_prefix(*length);
        return out;
      }
      case 5:
        return skip(4) ? std::optional(out) : std::nullopt;
      default:
        return std::nullopt;
    }
  }

  // The next number of a packed field, or of a key.
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

 private:
  bool skip(size_t bytes) {
    if (bytes > rest_.size()) return false;
    rest_.remove_prefix(bytes);
    return true;
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

// Numbers without field keys, as packed fields hold them.
uint64_t count_of_varints(std::string_view bytes) {
  return static_cast<uint64_t>(std::count_if(
      bytes.begin(), bytes.end(), [](char c) { return static_cast<unsigned char>(c) < 0x80; }));
}

// Bytes of a value by data_type of onnx.proto; 0 for what is no plain number.
uint64_t bytes_each(uint64_t data_type) {
  constexpr std::array<uint64_t, 17> kBytes = {0, 4, 1, 1, 2, 2, 4, 8, 0, 1, 2, 8, 4, 8, 0, 0, 2};
  return data_type < kBytes.size() ? kBytes[data_type] : 0;
}

// What a tensor says that it holds, and what it does.
class Tensor {
 public:
  explicit Tensor(std::string_view message) {
    Message fields(message);
    while (const auto field = fields.next()) read(*field);
  }

  std::string defect() const {
    if (is_external_) return "the weights lie in another file; only networks in one file are read";
    const uint64_t each = bytes_each(data_type_);
    if (each == 0) return "";  // whoever runs the network refuses what is no number
    const bool fits =
        raw_.empty() ? values_ == count_ : raw_.size() % each == 0 && raw_.size() / each == count_;
    if (fits) return "";
    const uint64_t found = raw_.empty() ? values_ : raw_.size() / each;
    return "a tensor holds " + std::to_string(found) + " values, which is not its shape";
  }

 private:
  void read(const Field& field) {
    constexpr uint64_t kSide = 1;
    constexpr uint64_t kDataType = 2;
    constexpr uint64_t kFloat = 4;
    constexpr uint64_t kInt32 = 5;
    constexpr uint64_t kInt64 = 7;
    constexpr uint64_t kRaw = 9;
    constexpr uint64_t kDouble = 10;
    constexpr uint64_t kUint64 = 11;
    constexpr uint64_t kLocation = 14;
    switch (field.number) {
      case kSide:
        if (!field.has_bytes) return multiply(field.value);
        return multiply_all(field.bytes);
      case kDataType:
        data_type_ = field.value;
        return;
      case kFloat:
        values_ += field.has_bytes ? field.bytes.size() / sizeof(float) : 1;
        return;
      case kInt32:
      case kInt64:
      case kUint64:
        values_ += field.has_bytes ? count_of_varints(field.bytes) : 1;
        return;
      case kDouble:
        values_ += field.has_bytes ? field.bytes.size() / sizeof(double) : 1;
        return;
      case kRaw:
        raw_ = field.bytes;
        return;
      case kLocation:
        is_external_ = field.value != 0;
        return;
      default:
        return;
    }
  }
  void multiply_all(std::string_view packed) {
    Message sides(packed);
    while (const auto side = sides.varint()) multiply(*side);
  }
  // Stays at what no file can hold once it is there.
  void multiply(uint64_t side) {
    constexpr uint64_t kMost = uint64_t{1} << 40;
    const bool is_too_large = side != 0 && count_ > kMost / side;
    count_ = is_too_large ? kMost : count_ * side;
  }

  std::string_view raw_;
  uint64_t data_type_ = 0;
  uint64_t count_ = 1;   // of the shape
  uint64_t values_ = 0;  // that are not raw
  bool is_external_ = false;
};

// Of the tensors that the attributes of a node hold, as those of Constant do.
std::string node_defect(std::string_view node) {
  constexpr uint64_t kAttribute = 5;
  constexpr uint64_t kTensor = 5;
  Message attributes(node);
  while (const auto attribute = attributes.next()) {
    if (attribute->number != kAttribute) continue;
    Message fields(attribute->bytes);
    while (const auto field = fields.next()) {
      if (field->number != kTensor || !field->has_bytes) continue;
      std::string found = Tensor(field->bytes).defect();
      if (!found.empty()) return found;
    }
  }
  return "";
}

}  // namespace

std::string onnx_weights_defect(std::string_view onnx) {
  constexpr uint64_t kGraph = 7;
  constexpr uint64_t kNode = 1;
  constexpr uint64_t kWeights = 5;
  Message model(onnx);
  while (const auto graph = model.next()) {
    if (graph->number != kGraph) continue;
    Message fields(graph->bytes);
    while (const auto field = fields.next()) {
      std::string found;
      if (field->number == kNode) found = node_defect(field->bytes);
      if (field->number == kWeights) found = Tensor(field->bytes).defect();
      if (!found.empty()) return found;
    }
  }
  return "";
}

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
