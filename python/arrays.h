// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <pybind11/numpy.h>

#include "libcgs/core/error.h"
#include "libcgs/core/raster.h"

// NumPy arrays of what the libraries hold, and back.

namespace cgs {

/// An array of what another Python object holds, which it keeps alive.
/// \tparam Scalar  of the array: float for Eigen::Vector3f, bool for a mask
template <typename Scalar>
pybind11::object view_of(void* data,
                         std::vector<pybind11::ssize_t> shape,
                         const pybind11::object& holder) {
  return pybind11::array(pybind11::dtype::of<Scalar>(), std::move(shape), data, holder);
}

/// A raster as an array of height x width, None if it is empty.
template <typename Scalar, typename T>
pybind11::object raster_view(Raster<T>& raster, const pybind11::object& holder) {
  if (raster.empty()) return pybind11::none();
  std::vector<pybind11::ssize_t> shape = {raster.height, raster.width};
  if constexpr (sizeof(T) > sizeof(Scalar)) shape.push_back(sizeof(T) / sizeof(Scalar));
  return view_of<Scalar>(raster.data.data(), std::move(shape), holder);
}

/// A vector as an array of one row per entry, None if it is empty and `needed` is false.
template <typename Scalar, typename T>
pybind11::object rows_view(std::vector<T>& rows,
                           const pybind11::object& holder,
                           bool needed = false) {
  if (rows.empty() && !needed) return pybind11::none();
  std::vector<pybind11::ssize_t> shape = {static_cast<pybind11::ssize_t>(rows.size())};
  if constexpr (sizeof(T) > sizeof(Scalar)) shape.push_back(sizeof(T) / sizeof(Scalar));
  return view_of<Scalar>(rows.data(), std::move(shape), holder);
}

/// The same, not to be changed in place: it was checked.
template <typename Scalar, typename T>
pybind11::object checked_rows_view(std::vector<T>& rows,
                                   const pybind11::object& holder,
                                   bool needed = false) {
  pybind11::object out = rows_view<Scalar>(rows, holder, needed);
  if (!out.is_none()) out.attr("flags").attr("writeable") = false;
  return out;
}

/// Makes an array that Python may see another one of the same size, in its place: NumPy arrays of
/// the old one would else show memory that is gone. Of another size the old one is kept for as long
/// as the module is, as nobody knows who still looks at it.
template <typename T>
void replace(std::vector<T>& old, std::vector<T>&& by) {
  if (old.size() == by.size()) {
    std::copy(by.begin(), by.end(), old.begin());
    return;
  }
  static std::vector<std::vector<T>> kept;
  if (!old.empty()) kept.push_back(std::move(old));
  old = std::move(by);
}
template <typename T>
void replace(Raster<T>& old, Raster<T>&& by) {
  old.width = by.width;
  old.height = by.height;
  replace(old.data, std::move(by.data));
}

/// An array as it may come in: of any type and layout, converted.
template <typename Scalar>
using ArrayIn = pybind11::array_t<Scalar, pybind11::array::c_style | pybind11::array::forcecast>;

/// "(480, 640, 3)"
inline std::string shape_text(const pybind11::array& array) {
  std::ostringstream out;
  out << "(";
  for (pybind11::ssize_t i = 0; i < array.ndim(); ++i) out << (i > 0 ? ", " : "") << array.shape(i);
  out << (array.ndim() == 1 ? ",)" : ")");
  return out.str();
}

/// A copy of an array as rows of what they hold.
/// \throws InvalidInput if it is no array of N x sizeof(T) / sizeof(Scalar), or N for one
template <typename T, typename Scalar>
std::vector<T> rows_of(const ArrayIn<Scalar>& array, const char* name) {
  constexpr auto kWidth = static_cast<pybind11::ssize_t>(sizeof(T) / sizeof(Scalar));
  const bool fits = kWidth == 1 ? array.ndim() == 1 : array.ndim() == 2 && array.shape(1) == kWidth;
  require(fits,
          std::string(name) + " must have the shape " +
              (kWidth == 1 ? "(N,)" : "(N, " + std::to_string(kWidth) + ")"),
          shape_text(array));
  std::vector<T> out(static_cast<size_t>(array.shape(0)));
  if (!out.empty())
    std::memcpy(static_cast<void*>(out.data()), array.data(), out.size() * sizeof(T));
  return out;
}

/// A copy of an array of integers as rows of what they hold, to be checked before they are made
/// smaller: ArrayIn would cut 2.9 and 2**32 + 2 down to 2.
/// \tparam T  int64_t, or an array of them
/// \throws InvalidInput if it holds other than integers, and as rows_of()
template <typename T>
std::vector<T> integers_of(const pybind11::object& object, const char* name) {
  const auto array = pybind11::array::ensure(object);
  require(bool(array),
          std::string(name) + " must be an array",
          std::string(pybind11::str(pybind11::type::of(object))));
  const char kind = array.dtype().kind();
  require(array.size() == 0 || kind == 'i' || kind == 'u',
          std::string(name) + " must be integers",
          std::string(pybind11::str(array.dtype())));
  return rows_of<T, int64_t>(ArrayIn<int64_t>::ensure(array), name);
}

/// A copy of an array as a raster.
/// \throws InvalidInput if it is no array of height x width (x channels)
template <typename T, typename Scalar>
Raster<T> raster_of(const ArrayIn<Scalar>& array, int width, int height, const char* name) {
  constexpr auto kChannels = static_cast<pybind11::ssize_t>(sizeof(T) / sizeof(Scalar));
  const bool fits = array.ndim() == (kChannels == 1 ? 2 : 3) && array.shape(0) == height &&
                    array.shape(1) == width && (kChannels == 1 || array.shape(2) == kChannels);
  require(fits,
          std::string(name) + " must have the shape (" + std::to_string(height) + ", " +
              std::to_string(width) +
              (kChannels == 1 ? ")" : ", " + std::to_string(kChannels) + ")") + " of its camera",
          shape_text(array));
  Raster<T> out;
  out.width = width;
  out.height = height;
  out.data.resize(static_cast<size_t>(width) * static_cast<size_t>(height));
  std::memcpy(static_cast<void*>(out.data.data()), array.data(), out.data.size() * sizeof(T));
  return out;
}

}  // namespace cgs
