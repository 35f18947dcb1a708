# SPDX-License-Identifier: GPL-3.0-or-later
# Packages of Debian: `cpack -G DEB` in the build folder writes cgs (the program), libcgs-dev (the
# libraries below it) and python3-cgs (the module). tests/package_test.sh tries them.
set(CGS_MAINTAINER "cgs maintainers <maintainers@cgs.example.org>" CACHE STRING
    "Who answers for the packages: NAME <MAIL>")

# package(<component> <name> <section> <summary> <description>)
macro(package component name section summary description)
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${summary}\n${description}")
  # These are for packages, and no part of `cmake --install`.
  install(FILES ${CMAKE_CURRENT_SOURCE_DIR}/cmake/debian/copyright
                ${debian}/changelog.gz ${debian}/changelog.Debian.gz
          DESTINATION share/doc/${name} COMPONENT ${component} EXCLUDE_FROM_ALL)
  # It is not for Debian itself, where somebody would have asked for it first.
  file(CONFIGURE OUTPUT ${debian}/${name} CONTENT "${name}: initial-upload-closes-no-bugs\n")
  install(FILES ${debian}/${name} DESTINATION share/lintian/overrides
          COMPONENT ${component} EXCLUDE_FROM_ALL)
endmacro()

set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(debian ${CMAKE_CURRENT_BINARY_DIR}/debian)
configure_file(cmake/debian/changelog.in ${debian}/changelog.Debian @ONLY)
configure_file(CHANGELOG.md ${debian}/changelog COPYONLY)
add_custom_command(OUTPUT ${debian}/changelog.gz ${debian}/changelog.Debian.gz
  COMMAND gzip -9nkf ${debian}/changelog ${debian}/changelog.Debian
  DEPENDS ${debian}/changelog ${debian}/changelog.Debian VERBATIM)
add_custom_target(cgs_changelogs ALL DEPENDS ${debian}/changelog.gz)

set(what "A few photographs of a rigid scene, with or without known cameras, become 3D
Gaussians, depth, an OpenVDB volume, a watertight mesh and compressed glTF.
Every part of a surface says whether it was observed, estimated or invented.\n\n")
package(program cgs graphics "photographs to 3D assets that say what was seen"
  "${what}This package holds the program, its manual and its guides. It needs a processor
with AVX2.")
package(development libcgs-dev libdevel "photographs to 3D assets - libraries for C++"
  "${what}This package holds static libraries, headers and files for CMake.")
if(TARGET cgs_python)
  package(python python3-cgs python "photographs to 3D assets - Python module"
    "${what}This package holds the Python module cgs, which works on NumPy arrays, and its
types.")
  math(EXPR next_python "${Python_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= 3.${Python_VERSION_MINOR}~), python3 (<< 3.${next_python}), python3-numpy")
endif()

# What cgsConfig.cmake finds: the libraries that samples/install.sh installs to build, but for those
# that only sources of ours include.
file(STRINGS samples/packages.txt packages)
set(libraries)
foreach(line IN LISTS packages)
  if(line MATCHES "^# tests only")
    break()
  elseif(line MATCHES "-dev$" AND NOT line MATCHES "^(libtinygltf|libstb|libcli11|python3|pybind11)-dev$")
    list(APPEND libraries ${line})
  endif()
endforeach()
list(JOIN libraries ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "${CGS_MAINTAINER}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
