// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "libcgs/core/raster.h"
#include "libcgs/core/scene.h"

namespace cgs {

/// A network that guesses depth from one photograph, in the form of MiDaS: input 1 x 3 x H x W, RGB
/// less the mean and divided by the deviation of ImageNet; output one value per pixel, disparity or
/// depth up to scale and offset.
class DepthNetwork {
 public:
  /// \param onnx  content of the file
  /// \param file  its name, for messages
  /// \throws BadInput Unsupported for what OpenCV cannot run, Schema for other inputs
  DepthNetwork(const std::string& onnx, const std::filesystem::path& file);
  ~DepthNetwork();
  DepthNetwork(DepthNetwork&&) noexcept;
  DepthNetwork& operator=(DepthNetwork&&) noexcept;

  /// Values at the size of the photograph, moved so that the smallest is a hundredth of their
  /// range; NaN where the photograph is masked. The photograph is resized to the input of the
  /// network, or to 256 x 256 where that takes any size, and the output back. Runs in one thread:
  /// the same bits every time.
  /// \pre the image of the view is loaded
  /// \throws BadInput Unsupported (OpenCV fails on the way), Schema (not one value per pixel),
  ///         Value (values that are not finite)
  DepthMap operator()(const View& view);

 private:
  struct Net;
  std::unique_ptr<Net> net_;
};

}  // namespace cgs
