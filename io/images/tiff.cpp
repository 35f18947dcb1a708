// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/images/tiff.h"

#include <vector>

#include <opencv2/imgcodecs.hpp>

#include "libcgs/core/error.h"
#include "libcgs/core/opencv_memory.h"

namespace cgs {

std::string encode_tiff(const Raster<float>& values) {
  require(!values.empty(), "a TIFF file needs pixels, width", values.width);
  constexpr int kDeflate = 8;  // "Adobe Deflate", which every reader knows
  // OpenCV takes no const data, and does not change it.
  const cv::Mat view(values.height, values.width, CV_32FC1, const_cast<float*>(values.data.data()));
  std::vector<unsigned char> bytes;
  try {
    if (!cv::imencode(".tif", view, bytes, {cv::IMWRITE_TIFF_COMPRESSION, kDeflate})) {
      throw NumericalError("TIFF encoder: refused the picture");
    }
  } catch (const cv::Exception& error) {
    throw_if_out_of_memory(error);
    throw NumericalError(std::string("TIFF encoder: ") + error.what());
  }
  return {bytes.begin(), bytes.end()};
}

}  // namespace cgs
