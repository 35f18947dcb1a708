// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/text/advice.h"

#include "libcgs/core/remedy.h"

namespace cgs {

namespace {

const char* options_for(Remedy remedy) {
  switch (remedy) {
    case Remedy::None:
      break;
    case Remedy::NoTraining:
      return "--set steps=0";
    case Remedy::FocalLength:
      return "--focal";
    case Remedy::KnownDistance:
      return "--known-distance";
    case Remedy::ChosenViews:
      return "--views";
    case Remedy::SceneUnit:
      return "--assume-unit, without --depth-kind metric and --depth-scale";
    case Remedy::DepthFolder:
      return "--depth";
    case Remedy::ExternalFiles:
      return "--allow-external";
    case Remedy::NoRegistration:
      return "without --icp";
    case Remedy::PoissonSpacing:
      return "--op statistical-outliers=NEIGHBOURS,SIGMAS; --op poisson=SPACING";
    case Remedy::NoWater:
      return "--medium none";
    case Remedy::LargerVoxels:
      return "--voxel-size, --memory-limit";
  }
  return "";
}

}  // namespace

std::string words_of(const Error& error) {
  const std::string options = options_for(remedy_of(error));
  return options.empty() ? error.what() : std::string(error.what()) + " (" + options + ")";
}

}  // namespace cgs
