// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/film_page.h"

#include <sstream>
#include <string>

#include "convert/report/page_files.h"
#include "convert/text/html.h"
#include "io/bytes/atomic_file.h"

namespace cgs {

namespace {

// The masks that lie over a frame where the page is told to show them.
std::string overlays(const RenderedPicture& frame) {
  std::string out;
  const auto add = [&](const char* looks, const char* mask) {
    out += std::string("<img class=\"") + looks + "\" alt=\"\" src=\"" + frame.name + mask + "\">";
  };
  if (frame.holes) add("hole", ".hole.png");
  if (frame.painted) add("hole painted", ".painted.png");
  return out;
}

std::string caption(const RenderedPicture& frame) {
  std::string out = frame.name;
  if (frame.holes) out += ": no photograph saw " + percent(frame.holes->hole()) + " of it";
  if (frame.painted) out += ", " + percent(*frame.painted) + " is painted";
  return out;
}

}  // namespace

void write_film_page(const std::filesystem::path& folder,
                     const std::vector<RenderedPicture>& frames) {
  const PageFiles files = page_files();
  std::ostringstream html;
  html << "<!doctype html>\n<html lang=en><head><meta charset=utf-8>"
          "<meta name=viewport content=\"width=device-width,initial-scale=1\"><title>"
       << frames.size() << " frames</title>\n<style>" << files.style << "</style></head><body>\n"
       << files.film_markup << "<div class=film id=film>\n";
  for (const RenderedPicture& frame : frames) {
    html << "<figure" << (&frame == &frames.front() ? "" : " hidden")
         << "><div class=picture><img decoding=sync alt=\"\" src=\"" << frame.name << ".png\">"
         << overlays(frame) << "</div><figcaption>" << caption(frame) << "</figcaption></figure>\n";
  }
  html << "</div>\n<script>" << files.film_script << "</script></body></html>\n";
  write_file(folder / "film.html", html.str());
}

}  // namespace cgs
