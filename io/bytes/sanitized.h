// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

namespace cgs {

/// True in a build with AddressSanitizer, whose shadow takes terabytes of addresses. GCC defines a
/// macro, Clang knows a feature.
#if defined(__SANITIZE_ADDRESS__)
inline constexpr bool kIsSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
inline constexpr bool kIsSanitized = true;
#else
inline constexpr bool kIsSanitized = false;
#endif
#else
inline constexpr bool kIsSanitized = false;
#endif

}  // namespace cgs
