// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "convert/monitor/two_dates.h"
#include "libcgs/core/raster.h"

namespace cgs {

/// One place seen at both dates.
struct DatePicture {
  std::string view;   ///< Of the later date, by whose camera both are seen.
  ColorImage before;  ///< The earlier model.
  ColorImage after;   ///< The photograph of the later date.
  MaskMap gained;     ///< Where `after` shows a piece that stands out over the earlier surface.
  MaskMap lost;       ///< Where `before` shows one that stands out over the later surface.
};

/// Pictures by up to four of the later input cameras, evenly spread. Loads their photographs.
/// \throws Error as load_images()
std::vector<DatePicture> date_pictures(TwoDates& dates,
                                       const DateChanges& changes,
                                       const Progress& progress);

/// index.html: both dates at a slider, what changed at a switch, and the figures; loads nothing
/// from elsewhere.
/// \param report  as monitor_json()
/// \param earlier  surface of the earlier date, in whose world places are told
/// \throws IoError
void write_monitor_page(const std::filesystem::path& path,
                        const nlohmann::ordered_json& report,
                        const MeasurableMesh& earlier,
                        const std::vector<DatePicture>& pictures);

}  // namespace cgs
