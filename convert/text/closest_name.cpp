// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/closest_name.h"

#include <algorithm>
#include <utility>

namespace cgs {

namespace {

// Source: Damerau 1964, of neighbours swapped once ("optimal string alignment").
size_t changes_between(std::string_view a, std::string_view b) {
  std::vector<size_t> two_before(b.size() + 1);
  std::vector<size_t> before(b.size() + 1);
  std::vector<size_t> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    std::swap(two_before, before);
    std::swap(before, row);
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const bool is_same = a[i - 1] == b[j - 1];
      row[j] = std::min({before[j] + 1, row[j - 1] + 1, before[j - 1] + (is_same ? 0 : 1)});
      const bool is_swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (is_swapped) row[j] = std::min(row[j], two_before[j - 2] + 1);
    }
  }
  return row[b.size()];
}

}  // namespace

std::string closest_name(std::string_view typed, const std::vector<std::string>& names) {
  constexpr size_t kMost = 2;
  constexpr size_t kLongest = 100;  // of any name there is; the work grows with it
  if (typed.size() > kLongest) return {};
  size_t fewest = std::min(kMost + 1, (typed.size() + 1) / 2);
  std::string out;
  for (const std::string& name : names) {
    const size_t changes = changes_between(typed, name);
    if (changes >= fewest) continue;
    fewest = changes;
    out = name;
  }
  return out;
}

}  // namespace cgs
