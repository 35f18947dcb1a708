// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <vector>

namespace cgs {

/// A form of a file that was tried.
struct TriedSize {
  double detail = 0;  ///< Length that what is left out of the form may have.
  size_t bytes = 0;
};

struct SizeSearch {
  std::optional<double> detail;  ///< The finest that fits among the tried; none if none fits.
  std::vector<TriedSize> tried;  ///< In the order they were tried.

  /// \pre something was tried
  size_t smallest() const;
};

/// Searches the finest detail at which a file is no larger than a limit. Sizes are expensive to
/// tell and fall with coarser detail, roughly as a power of it; where they do not, what is returned
/// was still seen to fit.
///
/// The search goes from fine to coarse until a form fits, then narrows the interval down by the
/// power law through its ends, until the form fills 97 % of the limit, the interval is 2 % wide, or
/// eight more forms were tried. The coarsest four are the same for every limit.
/// \param finest, coarsest  0 < finest <= coarsest
/// \param bytes_at          size of the form at a detail
SizeSearch finest_within(size_t limit,
                         double finest,
                         double coarsest,
                         const std::function<size_t(double)>& bytes_at);

}  // namespace cgs
