// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <string_view>

namespace cgs {

/// The text files of the report page and of films, held in the program since it was built.
struct PageFiles {
  std::string_view style;           ///< convert/viewer/page.css
  std::string_view viewer_markup;   ///< convert/viewer/viewer.html
  std::string_view scene_script;    ///< convert/viewer/scene.js
  std::string_view viewer_script;   ///< convert/viewer/viewer.js
  std::string_view film_markup;     ///< convert/viewer/film.html
  std::string_view film_script;     ///< convert/viewer/film.js
  std::string_view three;           ///< three.js; empty if it was not there when this was built.
  std::string_view orbit_controls;  ///< OrbitControls.js of three.js; likewise.
  std::string_view three_licence;   ///< convert/viewer/three.LICENSE, to go with the two.
};

PageFiles page_files();

}  // namespace cgs
