// SPDX-License-Identifier: GPL-3.0-or-later
#include "convert/report/page_files.h"

// The assembler takes a file in as it is, between two names. CMake says where the files are, and
// that this source depends on them.
#define CGS_EMBED(name, path)                                                          \
  asm(".pushsection .rodata\n" #name "Begin:\n.incbin \"" path "\"\n" #name            \
      "End:\n.byte 0\n.popsection\n");                                                 \
  extern "C" const char name##Begin[]; /* NOLINT(modernize-avoid-c-arrays): a place */ \
  extern "C" const char name##End[]    // NOLINT(modernize-avoid-c-arrays)

CGS_EMBED(kPageStyle, CGS_PAGE_STYLE);
CGS_EMBED(kViewerMarkup, CGS_VIEWER_MARKUP);
CGS_EMBED(kSceneScript, CGS_SCENE_SCRIPT);
CGS_EMBED(kViewerScript, CGS_VIEWER_SCRIPT);
CGS_EMBED(kFilmMarkup, CGS_FILM_MARKUP);
CGS_EMBED(kFilmScript, CGS_FILM_SCRIPT);
CGS_EMBED(kThreeLicence, CGS_THREE_LICENCE);
#ifdef CGS_THREE
CGS_EMBED(kThree, CGS_THREE);
CGS_EMBED(kOrbitControls, CGS_ORBIT_CONTROLS);
#endif

namespace cgs {

PageFiles page_files() {
  PageFiles out;
  out.style = {kPageStyleBegin, kPageStyleEnd};
  out.viewer_markup = {kViewerMarkupBegin, kViewerMarkupEnd};
  out.scene_script = {kSceneScriptBegin, kSceneScriptEnd};
  out.viewer_script = {kViewerScriptBegin, kViewerScriptEnd};
  out.film_markup = {kFilmMarkupBegin, kFilmMarkupEnd};
  out.film_script = {kFilmScriptBegin, kFilmScriptEnd};
  out.three_licence = {kThreeLicenceBegin, kThreeLicenceEnd};
#ifdef CGS_THREE
  out.three = {kThreeBegin, kThreeEnd};
  out.orbit_controls = {kOrbitControlsBegin, kOrbitControlsEnd};
#endif
  return out;
}

}  // namespace cgs
