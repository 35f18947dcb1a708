// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace cgs {

/// The shape that an ONNX network states for its first input that is no weight; 0 for sides that
/// may be anything, empty where none is stated or the bytes are no such network. OpenCV reads it
/// but has no function for it.
/// Source: onnx.proto of ONNX 1.12 (ModelProto, GraphProto, ValueInfoProto, TensorShapeProto);
///         protocol buffers encoding.
std::vector<int64_t> onnx_input_shape(std::string_view onnx);

/// What is wrong with the weights and constants of an ONNX network, for messages: they lie in
/// another file, or are not as many as their shape says; empty if nothing is. Runtimes believe both
/// and read past what is there. Tensors of nested graphs are not looked at.
/// Source: onnx.proto, TensorProto.
std::string onnx_weights_defect(std::string_view onnx);

}  // namespace cgs
