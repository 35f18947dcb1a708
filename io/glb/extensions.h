// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "io/glb/container.h"

namespace cgs {

/// Refuses a file that cannot be read without an extension that is not known.
/// \throws BadInput Unsupported, which names it
void refuse_unknown_extensions(const JsonValue& root);

/// One line for each extension that a file uses although it can do without, that may change shape
/// or colour and is not read. Those of textures are told where a texture is left out.
std::vector<std::string> unread_extensions(const JsonValue& root);

/// An extension of an object; nothing without it.
std::optional<JsonValue> extension_of(const JsonValue& object, const char* name);

}  // namespace cgs
