// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <new>

#include <opencv2/core.hpp>

namespace cgs {

/// Turns an error of OpenCV that means a lack of memory into one: the input is not to blame for it.
/// \throws std::bad_alloc
inline void throw_if_out_of_memory(const cv::Exception& error) {
  if (error.code == cv::Error::StsNoMem) throw std::bad_alloc();
}

}  // namespace cgs
