// SPDX-License-Identifier: GPL-3.0-or-later
#include "io/bytes/significance.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "libcgs/core/error.h"
#include "libcgs/core/frame.h"

namespace cgs {

std::string check_significance(const std::filesystem::path& path,
                               const Eigen::AlignedBox3d& box,
                               int digits) {
  const int refused_below = digits == kFloatDigits ? 10 : 20;
  const int odd_below = digits == kFloatDigits ? 14 : 20;
  const double extent = box.sizes().maxCoeff();
  const double bits = significant_bits(box, digits);
  if (extent == 0 || bits >= odd_below) return "";
  std::ostringstream text;
  text << "input has only " << std::max(0, static_cast<int>(std::floor(bits)))
       << " significant bits: it is " << extent
       << " wide, and its coordinates are stored in steps of " << extent * std::exp2(-bits);
  if (bits >= refused_below) return text.str();
  text << "; at least " << refused_below
       << " bits are needed, so move it nearer to the origin where it is made";
  throw BadInput(Defect::Value, path, text.str());
}

}  // namespace cgs
