// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

// Included before anything else where races are looked for. What OpenVDB's library has instances of
// would be taken from there, where ThreadSanitizer does not see what orders the work of threads;
// without this macro it is compiled with the rest.
#include <openvdb/version.h>
#undef OPENVDB_USE_EXPLICIT_INSTANTIATION
