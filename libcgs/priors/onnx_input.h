// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace cgs {

/// The shape that an ONNX network states for its first input that is no weight; 0 for sides that
/// may be anything, empty where none is stated or the bytes are no such network. OpenCV reads it
/// but does not give it away.
/// Source: onnx.proto of ONNX 1.12 (ModelProto, GraphProto, ValueInfoProto, TensorShapeProto);
///         protocol buffers encoding.
std::vector<int64_t> onnx_input_shape(std::string_view onnx);

}  // namespace cgs
