// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/page_files.h"

// The assembler takes the files in as they are; CMake names them and knows that this source
// depends on them. No file, no bytes.
#define CGS_EMBED(name, path)                                              \
  asm(".pushsection .rodata\n" name "_begin:\n.incbin \"" path "\"\n" name \
      "_end:\n.byte 0\n.popsection\n")

CGS_EMBED("cgs_page_style", CGS_PAGE_STYLE);
CGS_EMBED("cgs_viewer_markup", CGS_VIEWER_MARKUP);
CGS_EMBED("cgs_scene_script", CGS_SCENE_SCRIPT);
CGS_EMBED("cgs_viewer_script", CGS_VIEWER_SCRIPT);
CGS_EMBED("cgs_three_licence", CGS_THREE_LICENCE);
#ifdef CGS_THREE
CGS_EMBED("cgs_three", CGS_THREE);
CGS_EMBED("cgs_orbit_controls", CGS_ORBIT_CONTROLS);
#endif

extern "C" {
// NOLINTBEGIN(modernize-avoid-c-arrays): places the assembler names
extern const char cgs_page_style_begin[], cgs_page_style_end[];
extern const char cgs_viewer_markup_begin[], cgs_viewer_markup_end[];
extern const char cgs_scene_script_begin[], cgs_scene_script_end[];
extern const char cgs_viewer_script_begin[], cgs_viewer_script_end[];
extern const char cgs_three_licence_begin[], cgs_three_licence_end[];
#ifdef CGS_THREE
extern const char cgs_three_begin[], cgs_three_end[];
extern const char cgs_orbit_controls_begin[], cgs_orbit_controls_end[];
#endif
// NOLINTEND(modernize-avoid-c-arrays)
}

namespace cgs {

PageFiles page_files() {
  PageFiles out;
  out.style = {cgs_page_style_begin, cgs_page_style_end};
  out.viewer_markup = {cgs_viewer_markup_begin, cgs_viewer_markup_end};
  out.scene_script = {cgs_scene_script_begin, cgs_scene_script_end};
  out.viewer_script = {cgs_viewer_script_begin, cgs_viewer_script_end};
  out.three_licence = {cgs_three_licence_begin, cgs_three_licence_end};
#ifdef CGS_THREE
  out.three = {cgs_three_begin, cgs_three_end};
  out.orbit_controls = {cgs_orbit_controls_begin, cgs_orbit_controls_end};
#endif
  return out;
}

}  // namespace cgs
