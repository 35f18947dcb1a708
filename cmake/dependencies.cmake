# SPDX-License-Identifier: GPL-3.0-or-later
# What the libraries are built and linked with. Read by the build, and, installed beside cgsConfig.cmake,
# by the projects that use them: a static library leaves its own libraries to whoever links it.
find_package(Eigen3 3.4 REQUIRED)
find_package(TBB REQUIRED CONFIG)
find_package(Ceres REQUIRED)
find_package(OpenCV 4.6 REQUIRED COMPONENTS core imgproc imgcodecs calib3d features2d dnn aruco)
find_package(OpenEXR 3.1 REQUIRED CONFIG)
find_package(JPEG REQUIRED)
find_package(PNG REQUIRED)
find_package(TIFF REQUIRED)
find_package(ZLIB REQUIRED)
find_package(ICU REQUIRED COMPONENTS uc)
find_package(CGAL REQUIRED)
find_package(OpenMesh REQUIRED CONFIG)
find_package(draco REQUIRED)
find_package(meshoptimizer REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(pugixml REQUIRED)
find_package(EXPAT REQUIRED)
find_package(OpenMP REQUIRED COMPONENTS CXX)
# FindOpenVDB.cmake lies beside a FindTBB.cmake that breaks Ceres: on the path for this line only.
list(APPEND CMAKE_MODULE_PATH /usr/lib/${CMAKE_LIBRARY_ARCHITECTURE}/cmake/OpenVDB)
find_package(OpenVDB 10 REQUIRED COMPONENTS openvdb)
list(POP_BACK CMAKE_MODULE_PATH)

# Libraries without a file for CMake, or with one that does not work: dnnl-config.cmake asks for
# OpenCL headers that its package does not bring.
foreach(library 3MF exif heif lcms2 zstd webp dnnl)
  if(NOT TARGET cgs::${library})
    find_library(CGS_LIBRARY_${library} ${library} REQUIRED)
    mark_as_advanced(CGS_LIBRARY_${library})
    add_library(cgs::${library} UNKNOWN IMPORTED)
    set_target_properties(cgs::${library} PROPERTIES IMPORTED_LOCATION ${CGS_LIBRARY_${library}})
  endif()
endforeach()
# oneDNN's threads. Linked without -fopenmp, with which Eigen would start some of its own.
if(NOT TARGET cgs::openmp)
  add_library(cgs::openmp INTERFACE IMPORTED)
  target_link_libraries(cgs::openmp INTERFACE ${OpenMP_CXX_LIBRARIES})
endif()
