// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <cstdint>
#include <exception>
#include <utility>

namespace cgs {

/// What a caller can do about an error. Libraries say so in their own words; programs name the
/// option beside.
enum class Remedy : uint8_t {
  None,
  NoTraining,
  FocalLength,     ///< State it.
  KnownDistance,   ///< State one, for the scale.
  ChosenViews,     ///< Name others.
  SceneUnit,       ///< State the unit of the cameras, not that of depth.
  DepthFolder,     ///< Name it.
  ExternalFiles,   ///< Allow them.
  NoRegistration,  ///< Compare surfaces where they lie.
  PoissonSpacing,  ///< State it, or remove outliers.
  NoWater,         ///< Take photographs as they are.
  LargerVoxels,    ///< Or more memory.
};

/// An error that has a remedy is one of these, too.
class Remediable {
 public:
  explicit Remediable(Remedy remedy) : remedy_(remedy) {}
  virtual ~Remediable() = default;
  Remedy remedy() const { return remedy_; }

 private:
  Remedy remedy_;
};

/// The error E with a remedy. To keep it while something else is tried, keep its exception_ptr: a
/// copy as E has none.
template <typename E>
class WithRemedy : public E, public Remediable {
 public:
  template <typename... Arguments>
  explicit WithRemedy(Remedy remedy, Arguments&&... arguments)
      : E(std::forward<Arguments>(arguments)...), Remediable(remedy) {}
};

inline Remedy remedy_of(const std::exception& error) {
  const auto* const has_one = dynamic_cast<const Remediable*>(&error);
  return has_one != nullptr ? has_one->remedy() : Remedy::None;
}

}  // namespace cgs
