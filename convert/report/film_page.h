// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <filesystem>
#include <vector>

#include "convert/model/views.h"

namespace cgs {

/// film.html: plays the pictures that write_path() wrote into a folder, with what no photograph saw
/// in magenta, and in violet what was painted there, at a key. The pictures stay files of
/// their own, beside the page.
/// \throws IoError
void write_film_page(const std::filesystem::path& folder,
                     const std::vector<RenderedPicture>& frames);

}  // namespace cgs
