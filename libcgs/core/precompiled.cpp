// SPDX-License-Identifier: GPL-3.0-or-later
// Nothing: CMake wants a source for each target that owns a precompiled header.
