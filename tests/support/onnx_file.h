// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace cgs::test {

// Just enough of protocol buffers and ONNX to write a network by hand; field numbers are those of
// onnx.proto.
inline std::string varint(uint64_t value) {
  std::string out;
  for (; value >= 0x80; value >>= 7) out += static_cast<char>(value | 0x80);
  return out + static_cast<char>(value);
}
inline std::string field(int number, uint64_t value) {
  return varint(uint64_t(number) << 3) + varint(value);
}
inline std::string field(int number, const std::string& bytes) {
  return varint(uint64_t(number) << 3 | 2) + varint(bytes.size()) + bytes;
}
inline std::string tensor(const std::string& name,
                          const std::vector<uint64_t>& shape,
                          const std::vector<float>& values) {
  std::string out;
  for (const uint64_t side : shape) out += field(1, side);
  out += field(2, 1);  // float
  std::string raw(values.size() * sizeof(float), '\0');
  if (!raw.empty()) std::memcpy(raw.data(), values.data(), raw.size());
  return out + field(8, name) + field(9, raw);
}
inline std::string value_info(const std::string& name, const std::vector<uint64_t>& shape) {
  std::string dimensions;
  for (const uint64_t side : shape) dimensions += field(1, field(1, side));
  return field(1, name) + field(2, field(1, field(1, 1) + field(2, dimensions)));
}
inline std::string ints_attribute(const std::string& name, const std::vector<uint64_t>& values) {
  std::string out = field(1, name);
  for (const uint64_t value : values) out += field(8, value);
  return out + field(20, 7);  // INTS
}

inline constexpr std::array<float, 3> kOnnxWeights = {0.5f, -0.25f, 1.5f};
inline constexpr float kOnnxBias = 0.75f;

/// value = weights . normalised colour + bias, pixel by pixel, of pictures of the given size.
inline std::string onnx_network(uint64_t width,
                                uint64_t height,
                                const std::string& operation = "Conv") {
  const std::string node = field(1, "x") + field(1, "w") + field(1, "b") + field(2, "y") +
                           field(3, "n") + field(4, operation) +
                           field(5, ints_attribute("kernel_shape", {1, 1}));
  const std::string graph =
      field(1, node) + field(2, "g") +
      field(5, tensor("w", {1, 3, 1, 1}, {kOnnxWeights.begin(), kOnnxWeights.end()})) +
      field(5, tensor("b", {1}, {kOnnxBias})) + field(11, value_info("x", {1, 3, height, width})) +
      field(12, value_info("y", {1, 1, height, width}));
  return field(1, 7) + field(2, "test") + field(7, graph) + field(8, field(1, "") + field(2, 11));
}

}  // namespace cgs::test
