# SPDX-License-Identifier: GPL-3.0-or-later
# find_package(cgs) gives cgs::cgs (cameras, depth, Gaussians), cgs::io (files) and cgs::meshing
# (volumes, meshes, measuring), and the compiler options that must agree with them:
#
# - -march=x86-64-v3: public headers hold vectors of eight lanes (libcgs/core/lanes.h), which another
#   instruction set passes on differently. Whoever runs the program needs AVX2.
# - EIGEN_MAX_ALIGN_BYTES=16: Debian's libraries are compiled so. With another value, matrices lie
#   elsewhere in a struct than the library believes.
# - -ffp-contract=off: not needed to link, but for the bits that the documentation promises.
include(${CMAKE_CURRENT_LIST_DIR}/dependencies.cmake)
include(${CMAKE_CURRENT_LIST_DIR}/cgsTargets.cmake)
