// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "libcgs/core/raster.h"

namespace cgs {

/// A mask as OpenCV takes it, of the same memory.
inline cv::Mat1b mask_matrix(MaskMap& mask) { return {mask.height, mask.width, mask.data.data()}; }

/// 1 where it is 0, and 0 elsewhere.
inline MaskMap inverted(MaskMap mask) {
  for (uint8_t& value : mask.data) value = value == 0 ? 1 : 0;
  return mask;
}

/// All pixels that lie near set ones: up to `reach` to each side.
inline MaskMap dilated(MaskMap mask, int reach) {
  const int side = 2 * reach + 1;
  const cv::Mat element = cv::getStructuringElement(cv::MORPH_RECT, {side, side});
  cv::dilate(mask_matrix(mask), mask_matrix(mask), element);
  return mask;
}

/// Clears connected pixels that are fewer.
inline void remove_specks(MaskMap& mask, double fewest) {
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centroids;
  cv::connectedComponentsWithStats(mask_matrix(mask), labels, stats, centroids);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      const int area = stats.at<int>(labels.at<int>(y, x), cv::CC_STAT_AREA);
      if (area < fewest) mask(x, y) = 0;
    }
  }
}

}  // namespace cgs
