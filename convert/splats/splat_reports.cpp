// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/splats/splat_reports.h"

#include <cmath>

#include <nlohmann/json.hpp>

namespace cgs {

using Json = nlohmann::ordered_json;

Json floaters_to_json(const Floaters& f, const Frame& frame) {
  return {{"removed", f.doubtful ? 0 : f.count()},
          {"haze", f.haze},
          {"needles", f.needles},
          {"islands", f.islands},
          {"not_judged", f.outside},
          {"doubtful", f.doubtful},
          {"cell", f.cell * frame.scale}};
}

Json thinning_to_json(const ThinnedSplats& thinned, size_t before) {
  Json out = {{"kept", thinned.splats.size()},
              {"of", before},
              {"chosen", nullptr},
              {"most_loss_db", kMostThinningLoss},
              {"unseen_psnr", nullptr},
              {"tried", Json::array()}};
  // Numbers of the ladder as they are written there, not as float has them.
  const auto as_written = [](float cost) { return std::round(double(cost) * 1e6) / 1e6; };
  if (thinned.most_cost) out["chosen"] = as_written(*thinned.most_cost);
  if (thinned.unseen_psnr) out["unseen_psnr"] = *thinned.unseen_psnr;
  for (const ThinningTrial& t : thinned.tried) {
    out["tried"].push_back(
        {{"most_cost", as_written(t.most_cost)}, {"splats", t.splats}, {"loss_db", t.loss}});
  }
  return out;
}

std::string with_synthetic(std::string evidence, size_t count) {
  if (count == 0) return evidence;
  if (!evidence.empty()) evidence += "; ";
  return evidence + "with " + std::to_string(count) + " synthetic Gaussians";
}

}  // namespace cgs
